"""A diagnosis in numbers and sentences: the contents of ``report.json``."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.diagnosis.fitting import Fit, Problem, differentiate, normal_equations
from pam_envs.diagnosis.held_out import kind_of
from pam_envs.diagnosis.isolability import channel_size, complement, projected
from pam_envs.diagnosis.rule import Rule
from pam_envs.diagnosis.search import Blocks, Candidate
from pam_envs.diagnosis.single_muscle import declared
from pam_envs.diagnosis.structure import binned_r2, flexible_r2, ljung_box, spectral_peak
from pam_envs.diagnosis.verdict import traces_of

Array = NDArray[np.float64]

Z = 1.96
PRESSURE_UNIT = {"contraction": "mm", "pressure": "bar"}
SCALE = {"contraction": 1e-3, "pressure": 1e5}
MOST_RIVALS = 14


def report_of(study: Any, rule: Rule, seed: int, warnings: tuple[str, ...]) -> dict[str, Any]:
    """Return the report of a study, in the order of the documented keys."""
    decision, held = study.decision, study.held
    draws = study.blocks.draws(rule.draws, seed)
    named = decision.verdict in ("named", "ambiguous") or bool(decision.model.causes)
    causes = _causes(study, rule, seed) if named else []
    floors = _floors(study)
    before = _errors(study, held.base, seed)
    after = _errors(study, held.model, seed) if named else None
    report = {
        "schema": 1,
        "verdict": decision.verdict,
        "text": "",
        "causes": causes,
        "rivals": _rivals(study, draws, rule),
        "noise_floor": floors,
        "error_before": before,
        "error_after": after,
        "residual_structure": {
            "before": _structure(study, study.base),
            "after": _structure(study, study.model),
        },
        "isolability": _isolability(study),
        "experiment": study.proposal,
        "closed_loop": study.loop,
        "calibration": _calibration(study),
        "not_testable": [{"name": n, "reason": r} for n, r in study.not_testable.items()],
        "warnings": list(dict.fromkeys(warnings)),
        "rule_version": rule.version,
        "provenance": {
            "recording": {"source": study.recording.source, "digest": study.recording.digest},
            "rig": study.sheet.plant,
            "plant_before": study.start.digest(),
            "plant_after": study.plant_of(study.model).digest(),
            "package": _package(),
            "seed": seed,
        },
    }
    report["text"] = sentence(report)
    return report


def _package() -> str:
    try:
        return f"pam-envs {version('pam-envs')}"
    except PackageNotFoundError:
        return "pam-envs"


def _seen(study: Any) -> list[tuple[int, str]]:
    """Return the channels that were measured, with their rows."""
    return [
        (k, c)
        for k, c in enumerate(study.family.channels)
        if np.isfinite(study.problem.measured[k]).any()
    ]


def _floors(study: Any) -> dict[str, Any]:
    made = {}
    for _, c in _seen(study):
        value, source = study.floor_of(c)
        made[c] = {"value": value / SCALE[c], "unit": PRESSURE_UNIT[c], "from": source}
    return made


def _errors(study: Any, candidate: Candidate, seed: int) -> dict[str, Any]:
    """Return errors on what was held out, by channel."""
    held, blocks = study.held, study.blocks
    rows = held.problem.rows(candidate.fit.residual)
    made: dict[str, Any] = {}
    rng = np.random.default_rng(seed)
    labels = np.array([kind_of(s) for s in study.recording.segments])[study.recording.segment]
    for k, c in _seen(study):
        use = held.rows & np.isfinite(study.problem.measured[k])
        squares = np.where(use, rows[k] ** 2, 0.0)
        sums = np.bincount(blocks.of, squares, minlength=len(blocks.held_out))
        counts = np.bincount(blocks.of, use, minlength=len(blocks.held_out))
        places = np.flatnonzero(counts)
        if not len(places):
            continue
        drawn = rng.choice(places, (400, len(places)))
        spread = np.sqrt(sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1))
        scale = study.problem.noise[k] / SCALE[c]
        value = float(np.sqrt(squares.sum() / max(use.sum(), 1)))
        made[c] = {
            "value": value * scale,
            "unit": PRESSURE_UNIT[c],
            "interval": [float(v) * scale for v in np.quantile(spread, [0.025, 0.975])],
            "times_floor": value * study.problem.noise[k] / study.floor_of(c)[0],
            "kinds": {
                str(kind): float(np.sqrt(np.mean(rows[k][use & (labels == kind)] ** 2))) * scale
                for kind in dict.fromkeys(labels[use].tolist())
            },
        }
    return made


def intervals(problem: Problem, blocks: Blocks, fit: Fit) -> dict[str, tuple[float, float]]:
    """Return 95 % intervals of a fit's parameters, in SI.

    From the curvature of the fit and the scatter of the blocks' gradients, so that noise that is
    correlated within a block counts as it should.
    """
    if fit.shared is not None or len(fit.slopes) != len(fit.frees):
        fit.shared = None
        differentiate(problem, [fit])
    normal, _ = normal_equations(problem, fit)
    n = problem.seen
    of = np.tile(blocks.of, len(problem.measured))[problem.order[:n]]
    pulls = fit.slopes[:, :n] * fit.residual[:n]
    sums = np.stack([np.bincount(of, row, minlength=len(blocks.held_out)) for row in pulls])
    inverse = np.linalg.pinv(normal, rcond=1e-12, hermitian=True)
    spread = np.sqrt(np.maximum(np.diag(inverse @ (sums @ sums.T) @ inverse), 0.0))
    made = {}
    for free, z, sd in zip(fit.frees, fit.z, spread, strict=True):
        ends = free.outer(np.array([z - Z * sd, z + Z * sd]))
        made[free.name] = (float(ends[0]), float(ends[1]))
    return made


def _causes(study: Any, rule: Rule, seed: int) -> list[dict[str, Any]]:
    model, problem, family = study.model, study.problem, study.family
    spans = intervals(problem, study.blocks, model.fit)
    values = model.fit.values()
    traces = traces_of(problem, family, study.base, model)
    basis = complement(study.base.fit)
    draws = study.blocks.draws(rule.draws, seed)
    total = study.blocks.gain(study.base.errors, model.errors)
    spread = np.quantile(study.blocks.gains(study.base.errors, model.errors, draws), [0.025, 0.975])
    made = []
    for cause, form in model.causes:
        trace = traces[cause.name]
        flat = np.where(np.isfinite(problem.measured), trace, 0.0) / problem.noise[:, None]
        left = projected(flat.ravel()[problem.order][None], basis)[0]
        made.append(
            {
                "name": cause.name,
                "title": cause.title,
                "form": form.name,
                "parameters": [
                    _parameter(family, t.name, values[t.name], spans[t.name]) for t in form.terms
                ],
                "gain": {"value": total, "interval": spread.tolist()},
                "effect": {
                    c: {
                        "value": float(np.sqrt(np.mean(trace[k] ** 2))) / SCALE[c],
                        "unit": PRESSURE_UNIT[c],
                    }
                    for k, c in _seen(study)
                },
                "size": channel_size(left, problem),
            }
        )
    return sorted(made, key=lambda c: -c["size"])


def _parameter(family: Any, name: str, value: float, span: tuple[float, float]) -> dict[str, Any]:
    d = declared(family.plant, name)
    return {
        "name": name,
        "value": value,
        "unit": d.unit,
        "interval": list(span),
        "neutral": d.neutral,
    }


def _rivals(study: Any, draws: NDArray[np.int64], rule: Rule) -> list[dict[str, Any]]:
    decision, blocks = study.decision, study.blocks
    open_names = {frozenset(c.names) for c in decision.open_rivals}
    best = decision.model if decision.model.causes else study.base
    made = []
    for rival in decision.rivals[:MOST_RIVALS]:
        gains = blocks.gains(study.base.errors, rival.errors, draws)
        behind = blocks.gains(rival.errors, best.errors, draws)
        names = frozenset(rival.names)
        stays = names == frozenset(best.names) or names in open_names
        made.append(
            {
                "name": "+".join(rival.names),
                "title": " and ".join(c.title for c, _ in rival.causes),
                "form": ", ".join(f.name for _, f in rival.causes),
                "gain": {
                    "value": blocks.gain(study.base.errors, rival.errors),
                    "interval": np.quantile(gains, [0.025, 0.975]).tolist(),
                },
                "behind": {
                    "value": blocks.gain(rival.errors, best.errors),
                    "interval": np.quantile(behind, [0.025, 0.975]).tolist(),
                },
                "excluded": not stays,
            }
        )
    return made


def _structure(study: Any, candidate: Candidate) -> dict[str, Any]:
    rows = study.problem.rows(candidate.fit.residual)
    made = {}
    for k, c in _seen(study):
        residual = np.where(np.isfinite(study.problem.measured[k]), rows[k], np.nan)
        frequency, ratio = spectral_peak(
            residual, study.recording.period, study.regressors.values["pressure"]
        )
        values = study.regressors.values
        made[c] = {
            "ljung_box_p": ljung_box(residual),
            "r2": {n: binned_r2(residual, v, study.blocks) for n, v in values.items()},
            "flexible_r2": flexible_r2(residual, study.regressors, study.blocks)[0],
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


def _calibration(study: Any) -> list[dict[str, Any]]:
    """Return the refitted parameters, those of the final model."""
    spans = intervals(study.problem, study.blocks, study.model.fit)
    after, made = study.model.fit.values(), []
    column = study.family.column
    for free in study.base.fit.frees:
        low, high = free.low, free.high
        value, before = after[free.name], float(column[free.place])
        unit = "1" if free.name.startswith("memory.weight") else ""
        if not unit:
            unit = declared(study.family.plant, free.name).unit
        tolerance = study.sheet.tolerance.get(free.name)
        made.append(
            {
                "name": free.name,
                "unit": unit,
                "before": before,
                "after": value,
                "interval": list(spans[free.name]),
                "at_bound": bool(value <= low or value >= high),
                "outside_tolerance": bool(
                    tolerance is not None and abs(value - before) > tolerance * abs(before)
                ),
            }
        )
    return made


def sentence(report: dict[str, Any]) -> str:
    """Return the verdict in a few sentences."""
    verdict = report["verdict"]
    titles = " and ".join(c["title"] for c in report["causes"])
    if verdict == "insufficient":
        text = "The recording does not excite what would have to be decided"
        return f"{text}: {len(report['not_testable'])} causes cannot be tested on it."
    if verdict == "adequate":
        return f"The plant is adequate: {_held(report, 'error_before')}, and nothing is left that \
this recording could show."
    if verdict == "unexplained":
        text = f"Something is missing that no candidate carries: {_held(report, 'error_before')}"
        flexible = max(
            (s["flexible_r2"] for s in report["residual_structure"]["after"].values()), default=0.0
        )
        return f"{text}; a flexible model could explain {100 * flexible:.0f} % of what is left."
    text = f"Your simulation misses {titles}: with it {_fell(report)}."
    if verdict == "ambiguous":
        others = [r["name"] for r in report["rivals"][1:] if not r["excluded"]]
        text += f" Not excluded: {', '.join(others)}."
        if report["experiment"] is not None:
            e = report["experiment"]
            text += (
                f" To tell them apart, {e['description']}."
                if e["enough"]
                else " No experiment of the list tells them apart; "
                f"{e['sensor'] or 'another sensor'} would."
            )
    if report["closed_loop"] is not None:
        text += f" {report['closed_loop']['text']}"
    return text


def _held(report: dict[str, Any], key: str) -> str:
    floors = report["noise_floor"]
    parts = [
        f"{e['value']:.3g} {e['unit']} (noise floor {floors[c]['value']:.3g})"
        for c, e in report[key].items()
    ]
    return "the held-out error is " + " and ".join(parts)


def _fell(report: dict[str, Any]) -> str:
    before, after, floors = report["error_before"], report["error_after"], report["noise_floor"]
    worst = max(before, key=lambda c: before[c]["value"] / max(after[c]["value"], 1e-12))
    a, b = before[worst], after[worst]
    return (
        f"the held-out error of the {worst} falls from {a['value']:.3g} to {b['value']:.3g} "
        f"{a['unit']} (noise floor {floors[worst]['value']:.3g})"
    )
