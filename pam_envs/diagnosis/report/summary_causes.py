"""Causes, rivals and fitted parameters in the report."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pam_envs.diagnosis.decide.isolability import base_subspace, projected, size_over_noise
from pam_envs.diagnosis.decide.rule import Rule, not_excluded
from pam_envs.diagnosis.decide.verdict import Decision, effect_traces
from pam_envs.diagnosis.fit.candidate import Candidate
from pam_envs.diagnosis.fit.intervals import spans

Json = dict[str, Any]

BEST, OPEN, IMITATES = "the best", "not excluded", "imitates it"
FEWER, MORE, SAME = "fewer causes", "more causes", "the same causes"
LESS, WORSE, LITTLE = "gains less", "surely worse", "gains too little"
EXCLUDED = (LESS, WORSE, LITTLE)  # reasons of excluded rivals


def unit_of(study: Any, channel: str) -> str:
    """Return the unit in which a channel is reported."""
    return str(study.recording.channel(channel).unit)


def scale_of(study: Any, channel: str) -> float:
    """Return the unit in which a channel is reported, in SI."""
    return float(study.recording.channel(channel).scale)


def seen(study: Any) -> list[tuple[int, str]]:
    """Return the measured channels with their indices."""
    return [
        (k, c)
        for k, c in enumerate(study.family.channels)
        if np.isfinite(study.problem.measured[k]).any()
    ]


def causes(study: Any) -> list[Json]:
    """Return the causes of the extended plant in the order of evidence, common differences last.

    A muscle of another make has another law and another friction; they are no fault.
    """
    model, problem, family, held = study.model, study.problem, study.family, study.held
    if not model.causes:
        return []
    found = spans(problem, study.blocks, model.fit)
    values = model.fit.values()
    traces = effect_traces(problem, family, model)
    basis = base_subspace(study.normal.fit)
    made = []
    for cause, form in model.causes:
        trace = traces[cause.name]
        flat = np.where(np.isfinite(problem.measured), trace, 0.0) / problem.noise[:, None]
        left = projected(problem.vectors(flat.reshape(1, -1)), basis)[0]
        made.append(
            {
                "name": cause.name,
                "title": cause.title_of(form),
                "form": form.name,
                "parameters": [
                    {
                        "name": t.name,
                        "value": values[t.name],
                        "unit": family.declared(t.name).unit,
                        "neutral": family.declared(t.name).neutral,
                        **found[t.name],
                    }
                    for t in form.terms
                ],
                "gain": held.gain(held.without.get(cause.name, held.base), held.model),
                "effect": {
                    c: {
                        "value": float(np.sqrt(np.mean(trace[k] ** 2))) / scale_of(study, c),
                        "unit": unit_of(study, c),
                    }
                    for k, c in seen(study)
                },
                "size": size_over_noise(left, problem),
            }
        )
    common = {c.name: (c.by_nature, c.common and c.lawlike) for c, _ in model.causes}
    return sorted(made, key=lambda c: (common[c["name"]], -c["gain"]["value"]))


def calibration(study: Any) -> list[Json]:
    """Return the parameters of the final model beside those of its causes."""
    found = spans(study.problem, study.blocks, study.model.fit)
    after, made = study.model.fit.values(), []
    column = study.family.column
    of_causes = {t.name for _, form in study.model.causes for t in form.terms}
    for free in study.model.fit.frees:
        if free.name in of_causes:
            continue
        value, before = after[free.name], float(column[free.place])
        unit = study.family.declared(free.name).unit
        tolerance = study.sheet.tolerance.get(free.name)
        outside = tolerance is not None and abs(value - before) > tolerance * abs(before)
        made.append(
            {
                "name": free.name,
                "unit": unit,
                "before": before,
                "after": value,
                **found[free.name],
                "outside_tolerance": bool(outside),
            }
        )
    return made


# --- rivals -------------------------------------------------------------------------------------


def judged(decision: Decision) -> list[tuple[Candidate, Mapping[str, Any]]]:
    """Return the judged rivals, each with its evidence."""
    levels = decision.evidence.get("levels", [])
    if len(levels) < 2:
        return []
    rows = levels[max(decision.level, 1)]["rivals"]
    by_name = {(tuple(r["names"]), tuple(r.get("forms", ()))): r for r in rows}
    found = [
        (c, by_name.get((c.names, tuple(f.name for _, f in c.causes)))) for c in decision.rivals
    ]
    return [(c, row) for c, row in found if row is not None]


def reasons(decision: Decision, rule: Rule) -> list[str]:
    """Return the reason for which each judged rival is kept or excluded."""
    found = judged(decision)
    rows = [row for _, row in found]
    if not decision.level:
        return [LITTLE] * len(found)
    close = set(not_excluded(rows, rule)) if rows else set()
    still = {id(c) for c in decision.open_rivals}
    return [
        _reason(c, row, decision.model, rule, id(c) in still or k in close)
        for k, (c, row) in enumerate(found)
    ]


def _reason(
    rival: Candidate, row: Mapping[str, Any], best: Candidate, rule: Rule, stays: bool
) -> str:
    number = len(rival.names) - len(best.names)
    words = (
        (rival is best, BEST),
        (stays, OPEN),
        (number < 0, FEWER),
        (number > 0, MORE),
        (set(rival.names) == set(best.names), SAME),
        (row["imitates"], IMITATES),
        (row["better"] <= rule.doubt, WORSE),
    )
    return next((word for applies, word in words if applies), LESS)


def rivals(study: Any, rule: Rule) -> list[Json]:
    """Return the rivals of the model, in the order of the decision."""
    return [
        _rival(study, k, rival, row, word)
        for k, ((rival, row), word) in enumerate(
            zip(judged(study.decision), reasons(study.decision, rule), strict=True)
        )
    ]


def _rival(study: Any, k: int, rival: Candidate, row: Mapping[str, Any], why: str) -> Json:
    where, again = study.held, study.held.rivals[k]
    if again is None:
        where, again = study.compared, rival
    return {
        "name": "+".join(rival.names),
        "title": " and ".join(c.title_of(form) for c, form in rival.causes),
        "form": ", ".join(f.name for _, f in rival.causes),
        "held_out": where.choice.by,
        "gain": where.gain(where.base, again),
        "behind": where.gain(again, where.model),
        "judged": {key: row[key] for key in ("gain", "better")},
        "why": why,
        "excluded": why in EXCLUDED,
        "unseen": not {c.name for c in study.unseen}.isdisjoint(rival.names),
    }
