"""Content of ``report.json``."""

from __future__ import annotations

from typing import Any

import numpy as np

from pam_envs.diagnosis.decide.held_out import HeldOut, kind_of
from pam_envs.diagnosis.decide.rule import Rule
from pam_envs.diagnosis.decide.structure import binned_r2, flexible_r2, ljung_box, spectral_peak
from pam_envs.diagnosis.fit.candidate import Candidate
from pam_envs.diagnosis.report.summary_causes import SCALE, UNITS, calibration, causes, rivals, seen
from pam_envs.diagnosis.report.summary_text import sentence
from pam_envs.wording import package


def report_of(study: Any, rule: Rule, warnings: tuple[str, ...]) -> dict[str, Any]:
    """Return the report of a study, in the order of the documented keys."""
    decision, held = study.decision, study.held
    compared = rivals(study, rule)
    report = {
        "schema": 1,
        "verdict": decision.verdict,
        "text": "",
        "causes": causes(study),
        "rivals": compared,
        "noise_floor": _floors(study),
        "held_out": {
            "by": held.choice.by,
            "kinds": list(held.choice.kinds),
            "share": float(held.rows.mean()),
        },
        "error_before": _errors(study, held.base),
        "error_after": _errors(study, held.model) if decision.model.causes else None,
        "residual_structure": {
            "before": _structure(study, study.base),
            "after": _structure(study, study.model),
        },
        "isolability": _isolability(study),
        "experiment": study.proposal,
        "closed_loop": study.loop,
        "closed_loop_reason": study.loop_reason,
        "calibration": calibration(study),
        "not_testable": [{"name": n, "reason": r} for n, r in study.not_testable.items()],
        "warnings": list(dict.fromkeys((*warnings, *_against(compared)))),
        "rule_version": rule.version,
        "provenance": {
            "recording": {"source": study.recording.source, "digest": study.recording.digest},
            "rig": {"source": study.sheet.source, "digest": study.sheet.digest},
            "plant_before": study.start.digest(),
            "plant_after": study.plant_of(study.model).digest(),
            "package": package(),
            "seed": held.seed,
        },
    }
    report["text"] = sentence(report, rule)
    return report


def _floors(study: Any) -> dict[str, Any]:
    made = {}
    for _, c in seen(study):
        value, source = study.floor_of(c)
        made[c] = {"value": value / SCALE[c], "unit": UNITS[c], "from": source}
    return made


def _errors(study: Any, candidate: Candidate) -> dict[str, Any]:
    """Return the errors on the held-out data, by channel."""
    held: HeldOut = study.held
    rows = held.problem.rows(candidate.fit.residual)
    labels = np.array([kind_of(s) for s in study.recording.segments])[study.recording.segment]
    made: dict[str, Any] = {}
    for k, c in seen(study):
        use = held.rows & np.isfinite(study.problem.measured[k])
        if not use.any():
            continue
        counts = held.draws @ held.blocks.counts[k]
        spread = np.sqrt(held.draws @ candidate.errors[k] / np.maximum(counts, 1.0))
        scale = study.problem.noise[k] / SCALE[c]
        value = float(np.sqrt(np.mean(rows[k][use] ** 2)))
        made[c] = {
            "value": value * scale,
            "unit": UNITS[c],
            "interval": held.interval(spread * scale),
            "times_floor": value * study.problem.noise[k] / study.floor_of(c)[0],
            "kinds": {
                str(kind): float(np.sqrt(np.mean(rows[k][use & (labels == kind)] ** 2))) * scale
                for kind in dict.fromkeys(labels[use].tolist())
            },
        }
    return made


def _against(rivals: list[dict[str, Any]]) -> list[str]:
    """Return warnings on excluded rivals that predict the held-out data better."""
    found = []
    for rival in rivals:
        high = (rival["behind"]["interval"] or (0.0, 0.0))[1]
        if rival["why"] not in ("the best", "not excluded") and high < 0.0:
            found.append(
                f"on the held-out data {rival['name']} has a larger gain than the selected plant, "
                f"by {-rival['behind']['value']:.2g}; it is excluded ({rival['why']}) because the "
                "decision is based on blocks of the whole recording"
            )
    return found


def _structure(study: Any, candidate: Candidate) -> dict[str, Any]:
    rows = study.problem.rows(candidate.fit.residual)
    made = {}
    for k, c in seen(study):
        residual = np.where(np.isfinite(study.problem.measured[k]), rows[k], np.nan)
        frequency, ratio = spectral_peak(
            residual, study.recording.period, study.regressors.values["pressure"]
        )
        values = study.regressors.values
        made[c] = {
            "ljung_box_p": ljung_box(residual),
            "r2": {n: binned_r2(residual, v, study.blocks) for n, v in values.items()},
            "flexible_r2": flexible_r2(residual, study.regressors, study.blocks),
            "peak": {"frequency_hz": frequency, "ratio": ratio},
        }
    return made


def _isolability(study: Any) -> dict[str, Any] | None:
    iso = study.isolability
    if iso is None or len(iso.names) < 2:
        return None
    return {
        "names": list(iso.names),
        "cosine": iso.cosine.tolist(),
        "absorbed": dict(zip(iso.names, iso.absorbed.tolist(), strict=True)),
    }
