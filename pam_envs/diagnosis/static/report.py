"""Report of a diagnosis of settled readings."""

import hashlib
from typing import Any

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import BAR, MM
from pam_envs.data.tables import ContractionTable
from pam_envs.diagnosis.audit.tables import audit_table
from pam_envs.diagnosis.causes import catalogue
from pam_envs.diagnosis.static import compare
from pam_envs.diagnosis.static.findings import Findings, sentences
from pam_envs.diagnosis.static.law import Law, separated
from pam_envs.diagnosis.static.models import TERMS, Number, Term, predict, units
from pam_envs.diagnosis.static.search import RULE, Stage, Trial
from pam_envs.diagnosis.static.structure import isolability, structure
from pam_envs.wording import package

Json = dict[str, Any]

STATIC = (
    "a table of settled readings has no time and no measured pressure: pressure channel, delays, "
    "rates and closed loop are not diagnosed"
)


def report(f: Findings, seed: int) -> Json:
    """Return the report without ``runtime_s``."""
    cells, models = f.study.cells, {"before": f.base, "after": f.model}
    floor = {"value": f.floor, "unit": "mm", "from": "repeats" if np.isfinite(f.floor) else None}
    return {
        "schema": 1,
        "verdict": f.verdict,
        "text": sentences(f),
        "causes": causes(f),
        "rivals": rivals(f),
        "noise_floor": {"contraction": floor, "pressure": None},
        "held_out": None,
        "error_before": error(f, f.base),
        "error_after": error(f, f.model),
        "residual_structure": {when: structure(cells, model) for when, model in models.items()},
        "isolability": isolability(f.study),
        "experiment": experiment(f),
        "closed_loop": None,
        "closed_loop_reason": "settled readings have no time",
        "calibration": [calibrated(f, number) for number in f.base.fit.numbers],
        "not_testable": not_testable(f),
        "warnings": warnings(f),
        "rule_version": RULE,
        "provenance": provenance(f.table, seed),
        "readings": {
            "ladder": [stage_of(stage) for stage in f.search.stages],
            "pairs": [
                {
                    "names": [term.cause for term in pair.terms],
                    "p_alone": list(pair.alone),
                    "p_beside": list(pair.beside),
                    "masked": [term.cause for term in pair.masked],
                }
                for pair in f.search.pairs
            ],
            "loads_left_out": loads_left_out(f),
            "load_laws": [load_law(law) for law in f.laws],
            "lack_of_fit": {when: misfit(f, model) for when, model in models.items()},
            "set_points": [vars(point) for point in f.set_points],
            "curves": curves(f),
        },
    }


def _value(value: float, unit: str = "mm") -> Json:
    return {"value": value, "unit": unit}


def _number(f: Findings, number: Number) -> Json:
    scale = units(number, f.study.cells.scale)
    value, (low, high) = f.estimate(number.name)
    return {
        "name": number.name,
        "value": value * scale,
        "unit": number.unit,
        "interval": [low * scale, high * scale],
        "neutral": number.neutral * scale,
    }


def effect(f: Findings, term: Term) -> Array:
    """Return the contribution of a cause to the contraction of each cell [mm]."""
    values, cells = f.model.fit.values(), f.study.cells
    without = {k: v for k, v in values.items() if k != term.number.name}
    return np.asarray((predict(cells, values) - predict(cells, without))[0] * cells.millimetres)


def _form(trial: Trial) -> Json:
    """Return a form with its gain."""
    return {
        "name": trial.term.cause,
        "title": trial.term.title,
        "form": trial.term.form,
        "gain": {"value": trial.gain, "interval": list(trial.interval)},
    }


def causes(f: Findings) -> list[Json]:
    """Return the named causes in the order of evidence."""
    noise, _ = compare.pure_error(f.study.cells)
    made = []
    for trial in f.search.accepted:
        size = float(np.sqrt(np.mean(effect(f, trial.term)[f.study.cells.used] ** 2)))
        more = {"effect": {"contraction": _value(size)}, "size": size / noise}
        made.append({**_form(trial), "parameters": [_number(f, trial.term.number)], **more})
    return made


def rivals(f: Findings) -> list[Json]:
    """Return the rival forms, each at the stage of its decision."""
    named = {trial.term.cause for trial in f.search.accepted}
    stages, made = f.search.stages, dict[str, Json]()
    for stage in stages:
        here = stage.chosen.term.cause if stage.chosen else None
        for trial in stage.trials:
            last = stage is stages[-1] and trial.term.cause not in named
            if trial.term.cause == here or last:
                made.setdefault(trial.term.form, _rival(trial, trial is stage.chosen))
    return list(made.values())


def _rival(trial: Trial, chosen: bool) -> Json:
    reasons = (
        (chosen, "the best"),
        (not trial.passes, "gains too little"),
        (trial.excluded, "surely worse"),
        (True, "not excluded"),
    )
    return {
        **_form(trial),
        "behind": {"value": trial.behind, "interval": list(trial.behind_interval)},
        "why": next(reason for applies, reason in reasons if applies),
        "excluded": not chosen and (trial.excluded or not trial.passes),
    }


def error(f: Findings, model: compare.Model) -> Json:
    """Return the error on held-out readings and loads."""
    loads = f.study.cells.loads[: f.study.lanes.loads]
    kinds = {f"{f.study.lanes.kind}, one held out": model.held_out, "cells, fitted": model.rms}
    for load, value in zip(loads, model.by_load.tolist(), strict=True):
        kinds[f"{load:g} kg held out"] = value
    if loads:
        kinds["loads, one held out (mean)"] = model.left_load
    more = {
        "interval": list(compare.error_interval(f.study, model.held)),
        "times_floor": model.held_out / f.floor,
        "kinds": kinds,
    }
    return {"contraction": {**_value(model.held_out), **more}, "pressure": None}


def experiment(f: Findings) -> Json | None:
    """Return the loads to measure next if two models are not separated."""
    if f.next is None:
        return None
    names = (
        [law.term.form for law in f.laws] if f.bent else [t.term.cause for t in f.search.ties[0]]
    )
    loads = " and ".join(f"{load:.1f} kg" for load in f.next.best)
    return {
        "between": names[:2],
        "name": "more loads",
        "description": (
            f"measure {loads} with the same cycles and repeats: the largest difference of the two "
            f"is {f.next.apart:.2f} mm RMS over a cycle at {f.next.load:.1f} kg (the "
            "separation is in variances of a cell's mean)"
        ),
        "segments": [],
        "separation": f.next.separation,
        "enough": bool(f.next.separation >= 1.0),
        "sensor": None,
    }


def calibrated(f: Findings, number: Number) -> Json:
    """Return a fitted parameter of the load-blind base, which has no earlier value."""
    made, scale = _number(f, number), units(number, f.study.cells.scale)
    value, span = made["value"], (number.high - number.low) * scale
    near = min(value - number.low * scale, number.high * scale - value)
    return {
        "name": number.name,
        "unit": number.unit,
        "before": None,
        "after": value,
        "interval": made["interval"],
        "at_bound": bool(near < 1e-6 * span),
        "outside_tolerance": False,
    }


def not_testable(f: Findings) -> list[Json]:
    """Return the causes that a table of readings, or this one, cannot show."""
    shown = {term.cause for term in TERMS}
    reasons = {c.name: c.settled for c in catalogue() if c.name not in shown}
    have = len(f.study.cells.loads)
    for term in TERMS:
        if term.both_ways and not f.study.cells.falling.any():
            reasons[term.cause] = "the pressure was never lowered"
        if term.loads > have:
            reasons[term.cause] = "there is one load"
    return [{"name": name, "reason": reasons[name]} for name in sorted(reasons)]


def warnings(f: Findings) -> list[str]:
    """Return the warnings."""
    texts = [*audit_table(f.table), *(point.sentence for point in f.set_points), STATIC]
    texts += [_zeros(f)] if _zeros(f) else []
    if not np.isfinite(f.floor):
        texts.append("without differing repeats the noise floor is unknown")
    if f.bent and f.laws[0].post_hoc:
        texts.append(
            "an exponent or a dead zone of the load was fitted to all loads: its error on a "
            "held-out load is post hoc"
        )
    if f.bent and not separated(f.study, f.laws):
        one, other = f.laws[:2]
        texts.append(
            f"a power {one.value:.2f} of the load and a dead zone of {other.value:.2f} kg fit "
            f"equally well ({one.model.rms:.3f} and {other.model.rms:.3f} mm on the cells): the "
            "readings do not separate them"
        )
    return texts


def _zeros(f: Findings) -> str:
    """Return the warning on a load parameter that depends on the zero of the contraction."""
    accepted = {trial.term.form for trial in f.search.accepted}
    for stage in f.search.stages:
        for trial in stage.trials:
            other = trial.term.number
            same = trial.term.cause == "load_dependent_compliance" and other.unit == "bar/kg"
            if same and trial.passes and not trial.excluded and trial.term.form not in accepted:
                value = float(trial.model.fit.theta[0, -1]) * units(other, f.study.cells.scale)
                return (
                    f"the form '{trial.term.form}' fits equally well, with {value:.3f} bar/kg: the "
                    "stretch of the muscle by a load alone was not measured"
                )
    return ""


def provenance(table: ContractionTable, seed: int) -> Json:
    """Return the inputs and versions."""
    columns = (table.load_kg, table.inflating, table.pressure_pa, table.repeat, table.contraction_m)
    digest = hashlib.sha256(b"".join(column.tobytes() for column in columns)).hexdigest()
    return {
        "recording": f"{len(table.load_kg)} readings, sha256 {digest[:16]}",
        "rig": None,
        "plant_before": None,
        "plant_after": None,
        "package": package(),
        "seed": seed,
    }


def stage_of(stage: Stage) -> Json:
    """Return a stage of the search: the present model, and every form tried on it."""
    return {
        "model": [term.form for term in stage.parent.terms],
        **_errors(stage.parent),
        "chosen": stage.chosen.term.form if stage.chosen else None,
        "tried": [
            {
                "name": trial.term.cause,
                "form": trial.term.form,
                **_errors(trial.model),
                "p": trial.p,
                "p_adjusted": trial.adjusted,
                "gain": {"value": trial.gain, "interval": list(trial.interval)},
                "accepted": trial.passes,
                "excluded": trial.excluded or not trial.passes,
            }
            for trial in stage.trials
        ],
    }


def _errors(model: compare.Model) -> Json:
    return {
        "parameters": len(model.fit.numbers),
        "cells_mm": model.rms,
        "left_out_mm": model.held_out,
        "load_left_out_mm": model.left_load,
        "by_load_mm": model.by_load.tolist(),
    }


def loads_left_out(f: Findings) -> Json | None:
    """Return the decrease of the mean error on held-out loads by effects linear in load."""
    if not f.study.lanes.loads:
        return None
    cut, (low, high) = compare.load_cut(f.study, f.base, f.model)
    return {
        "before": _value(f.base.left_load),
        "after": _value(f.model.left_load),
        "cut_percent": {"value": 100.0 * cut, "interval": [100.0 * low, 100.0 * high]},
    }


def load_law(law: Law) -> Json:
    """Return a load law other than linear."""
    return {
        "law": law.term.form,
        "value": law.value,
        "unit": law.term.number.unit,
        "interval": list(law.interval),
        "p": law.p,
        **_errors(law.model),
        "status": "post hoc, not held out" if law.post_hoc else "held out",
    }


def misfit(f: Findings, model: compare.Model) -> Json:
    """Return the lack of fit: F and p-value against the repeats, and its size."""
    ratio, p, size = compare.lack_of_fit(f.study, model)
    return {"F": ratio, "p": p, "size": _value(size)}


def curves(f: Findings) -> Json:
    """Return the curves of the figures, cell by cell [bar, kg, mm]."""
    cells, mm = f.study.cells, f.study.cells.millimetres
    return {
        "load_kg": [cells.loads[g] for g in cells.group],
        "pressure_bar": (cells.pressure * cells.scale[1] / BAR).tolist(),
        "deflating": cells.falling.tolist(),
        "used": cells.used.tolist(),
        "path": cells.path.tolist(),
        "measured_mm": (cells.mean * mm).tolist(),
        "readings_mm": (cells.readings * (cells.scale[2] / MM)).tolist(),
        "base_mm": (f.base.fit.predict(cells)[0] * mm).tolist(),
        "extended_mm": (f.model.fit.predict(cells)[0] * mm).tolist(),
        "effects_mm": {t.term.cause: effect(f, t.term).tolist() for t in f.search.accepted},
    }
