"""Content of ``report.json``, and the verdict in a few sentences."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pam_envs.diagnosis.decide.held_out import HeldOut, kind_of
from pam_envs.diagnosis.decide.isolability import SHORT
from pam_envs.diagnosis.decide.rule import Rule
from pam_envs.diagnosis.decide.structure import binned_r2, flexible_r2, ljung_box, spectral_peak
from pam_envs.diagnosis.fit.blocks import BLOCK_SECONDS
from pam_envs.diagnosis.fit.candidate import Candidate
from pam_envs.diagnosis.report.summary_causes import (
    calibration,
    causes,
    rivals,
    scale_of,
    seen,
    unit_of,
)
from pam_envs.wording import enumeration, package


def report_of(study: Any, rule: Rule, warnings: tuple[str, ...]) -> dict[str, Any]:
    """Return the report of a study, in the order of the documented keys."""
    decision, held = study.decision, study.held
    compared = rivals(study, rule)
    floors = {c: study.floor_of(c) for _, c in seen(study)}
    report = {
        "schema": 1,
        "verdict": decision.verdict,
        "text": "",
        "causes": causes(study),
        "rivals": compared,
        "noise_floor": {
            c: {"value": value / scale_of(study, c), "unit": unit_of(study, c), "from": source}
            for c, (value, source) in floors.items()
        },
        "held_out": {
            "by": held.choice.by,
            "kinds": list(held.choice.kinds),
            "share": float(held.rows.mean()),
        },
        "error_before": _errors(study, held.base),
        "error_after": _errors(study, held.model) if decision.model.causes else None,
        "explained": _explained(study) if decision.model.causes else None,
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
    report["incomplete"] = decision.verdict == "named" and (
        decision.incomplete or _incomplete(report)
    )
    report["text"] = sentence(report, rule)
    return report


FAR = 1.5
"""Error over the noise floor, and over the black box, from which a named cause is incomplete."""


def _explained(study: Any) -> dict[str, Any]:
    """Return what the causes explain of the error above the noise floor, by channel.

    ``share`` is the removed share of the mean square above the floor; ``black_box`` the held-out
    error of the extended plant with a flexible regression of its residual, fitted to the same
    training blocks, and ``depends_on`` the variables that the rest varies with.
    """
    held: HeldOut = study.held
    made: dict[str, Any] = {}
    for k, c in seen(study):
        use = held.rows & np.isfinite(study.problem.measured[k])
        if not use.any():
            continue
        scale = study.problem.noise[k] / scale_of(study, c)
        floor = study.floor_of(c)[0] / scale_of(study, c)
        rows = [held.problem.rows(m.fit.residual)[k] for m in (held.base, held.model)]
        before, after = (float(np.sqrt(np.mean(row[use] ** 2))) * scale for row in rows)
        left = np.where(np.isfinite(study.problem.measured[k]), rows[1], np.nan)
        over = before**2 - floor**2
        lower = np.sqrt(max(0.0, 1.0 - flexible_r2(left, study.regressors, study.blocks)))
        shares = {n: binned_r2(left, v, study.blocks) for n, v in study.regressors.values.items()}
        made[c] = {
            "before": before,
            "after": after,
            "floor": floor,
            "black_box": after * lower,
            "unit": unit_of(study, c),
            "share": min(1.0, (before**2 - max(after, floor) ** 2) / over) if over > 0.0 else None,
            "depends_on": [n for n, share in shares.items() if share > VARIES_WITH],
        }
    return made


def _incomplete(report: Mapping[str, Any]) -> bool:
    """Return whether a named cause leaves an error far above floor and black box."""
    return any(
        e["after"] > FAR * e["floor"] and e["after"] > FAR * e["black_box"]
        for e in (report["explained"] or {}).values()
    )


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
        scale = study.problem.noise[k] / scale_of(study, c)
        value = float(np.sqrt(np.mean(rows[k][use] ** 2)))
        made[c] = {
            "value": value * scale,
            "unit": unit_of(study, c),
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
        frequency, ratio = spectral_peak(residual, study.recording.period, study.regressors.motion)
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


Report = Mapping[str, Any]

VARIES_WITH = 0.05
"""Share of a residual explained by one variable above which the variable is named."""


def sentence(report: Report, rule: Rule) -> str:
    """Return the verdict in a few sentences."""
    verdict = report["verdict"]
    if verdict == "insufficient":
        return _insufficient(report)
    if verdict == "adequate":
        return (
            f"The plant is adequate: the held-out error is {_error_text(report, 'error_before')}, "
            f"{_where(report)}, and this recording shows no remaining error."
        )
    if verdict == "unexplained":
        return _unexplained(report, rule)
    doubtful = [r for r in report["rivals"] if r["why"] == "not excluded"]
    unseen = [rival["title"] for rival in doubtful if rival.get("unseen")]
    names = enumeration(_titles(report))
    if unseen:
        names += f", or {enumeration(unseen)}, which this recording cannot test"
    text = f"The simulation lacks {names}: with {_titles(report)[0]} {_fell(report)}."
    if len(report["causes"]) > 1 or not unseen:
        text = f"The simulation lacks {names}: with it {_fell(report)}."
    text += _share_text(report) + _doubts(report)
    if verdict == "ambiguous":
        text += _not_excluded(report)
    if report["closed_loop"] is not None:
        text += f" {report['closed_loop']['text']}"
    return text


def _share_text(report: Report) -> str:
    """Return the explained share of the error, and what the rest depends on."""
    text = ""
    for channel, e in (report.get("explained") or {}).items():
        if e["share"] is None or e["before"] <= FAR * e["floor"]:
            continue
        text += f" This explains {100 * max(e['share'], 0.0):.0f} % of the error of the {channel}"
        text += f" above the noise ({e['before']:.3g} to {e['after']:.3g} {e['unit']}"
        text += f", black box {e['black_box']:.3g})."
    if report.get("incomplete"):
        rest = {n for e in report["explained"].values() for n in e["depends_on"]}
        text += " The cause is incomplete: an error above the noise remains that no candidate "
        text += "explains"
        words = enumeration([n.replace("_", " ") for n in sorted(rest)])
        text += f", which varies with {words}." if rest else "."
    return text


def _insufficient(report: Report) -> str:
    short = [w for w in report["warnings"] if w.startswith(SHORT)]
    if short:
        return short[0]
    text = "The recording does not excite the effects in question"
    return f"{text}: {len(report['not_testable'])} causes cannot be tested."


def _titles(report: Report) -> list[str]:
    return [c["title"] for c in report["causes"]]


def _where(report: Report) -> str:
    """Return the held-out data in words."""
    held = report["held_out"]
    if held["by"] == "blocks":
        return f"on held-out blocks of {BLOCK_SECONDS:g} s"
    word = "kind" if len(held["kinds"]) == 1 else "kinds"
    return f"on held-out experiments of the {word} {enumeration(held['kinds'])}"


def _error_text(report: Report, key: str) -> str:
    floors = report["noise_floor"]
    return " and ".join(
        f"{e['value']:.3g} {e['unit']} (noise floor {floors[c]['value']:.3g})"
        for c, e in report[key].items()
    )


def _fell(report: Report) -> str:
    before, after, floors = report["error_before"], report["error_after"], report["noise_floor"]
    worst = max(before, key=lambda c: before[c]["value"] / max(after[c]["value"], 1e-12))
    a, b = before[worst], after[worst]
    word = "falls" if b["value"] < a["value"] else "goes"
    return (
        f"the held-out error of the {worst} {word} from {a['value']:.3g} to {b['value']:.3g} "
        f"{a['unit']} (noise floor {floors[worst]['value']:.3g}), {_where(report)}"
    )


def _doubts(report: Report) -> str:
    """Return the causes without a significant gain on the held-out data."""
    text = ""
    for cause in report["causes"]:
        low, high = cause["gain"]["interval"] or (None, None)
        if low is not None and low <= 0.0:
            text += (
                f" The gain of {cause['title']} is not significant on the held-out data: "
                f"{cause['gain']['value']:.2g} (95 % interval {low:.2g} to {high:.2g})."
            )
    return text


def _not_excluded(report: Report) -> str:
    others = [r["name"] for r in report["rivals"] if r["why"] == "not excluded"]
    text = f" Not excluded: {', '.join(others)}." if others else ""
    plan = report["experiment"]
    if plan is None:
        return text
    if plan["enough"]:
        return f"{text} To separate them, {plan['description']}."
    return (
        f"{text} No experiment of the list separates them; "
        f"{plan['sensor'] or 'another sensor'} would."
    )


def _unexplained(report: Report, rule: Rule) -> str:
    text = (
        "The model error is not explained by any candidate: the held-out error is "
        f"{_error_text(report, 'error_before')}, {_where(report)}."
    )
    if report["causes"]:
        text += (
            f" Adding {enumeration(_titles(report))} reduces it to "
            f"{_error_text(report, 'error_after')}, which is not sufficient for a name."
        )
    after = report["residual_structure"]["after"]
    flexible = max((s["flexible_r2"] for s in after.values()), default=0.0)
    text += f" A flexible model explains {100 * flexible:.0f} % of the residual"
    share, name = max(
        ((v or 0.0, n) for s in after.values() for n, v in s["r2"].items()), default=(0.0, "")
    )
    text += f", which varies most with {name.replace('_', ' ')}." if share > VARIES_WITH else "."
    peaks = [(s["peak"]["ratio"], s["peak"]["frequency_hz"]) for s in after.values()]
    if peaks and max(peaks)[0] > rule.peak:
        text += f" Its spectrum has a peak at {max(peaks)[1]:.3g} Hz."
    return text
