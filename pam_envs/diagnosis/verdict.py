"""How a diagnosis decides. Thresholds were frozen before the benchmark's final seeds were drawn."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.fitting import Problem, column_of
from pam_envs.diagnosis.search import Blocks, Candidate, search
from pam_envs.diagnosis.structure import Regressors, flexible_r2, spectral_peak

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rule:
    """The numbers of the decision.

    Attributes
    ----------
    version : str
        Part of every report.
    least_gain : float
        Log mean-square gain on held-out blocks below which nothing is called missing.
    flexible : float
        Share of a residual that a flexible model may explain before it counts as structure.
    peak : float
        Height of a spectral peak, over its neighbourhood, that counts as structure.
    excess : float
        Held-out mean square over that of the noise floor that counts as structure.
    rest : float
        Unexplained when the structure left exceeds this part of the gain.
    close : float
        A rival within this part of the best gain is not excluded...
    doubt : float
        ... if the difference is not surer than this (one-sided, blocks drawn again).
    second_gain, second_share : float
        A further cause has to gain this much, and this part of the first's gain.
    hint : float
        A search for a further cause goes on if its first rounds promise this part of it.
    beam : int
        First causes from which a second is looked for.
    most : int
        Most causes named.
    simpler : float
        What a form with more parameters must gain over one it contains.
    draws : int
        Bootstrap samples.
    """

    version: str = "1"
    least_gain: float = 0.05
    flexible: float = 0.15
    peak: float = 30.0
    excess: float = 1.6
    rest: float = 0.5
    close: float = 0.8
    doubt: float = 0.05
    second_gain: float = 0.1
    second_share: float = 0.1
    hint: float = 0.4
    beam: int = 3
    most: int = 3
    simpler: float = 0.03
    draws: int = 400


@dataclass
class Decision:
    """What was decided, and on what."""

    verdict: str
    model: Candidate
    rivals: list[Candidate] = field(default_factory=list)
    open_rivals: list[Candidate] = field(default_factory=list)
    structure: dict[str, Any] = field(default_factory=dict)
    levels: list[dict[str, Any]] = field(default_factory=list)


def left_over(
    problem: Problem, blocks: Blocks, candidate: Candidate, regressors: Regressors
) -> dict[str, Any]:
    """Return what is left in a candidate's residual: flexible model and spectral peak."""
    rows = problem.rows(candidate.fit.residual)
    r2, rest, peaks = [], 0.0, []
    period = float(regressors.values["time"][1] - regressors.values["time"][0])
    for row, reading in zip(rows, problem.measured, strict=True):
        if not np.isfinite(reading).any():
            r2.append(0.0)
            peaks.append((0.0, 0.0))
            continue
        share, _ = flexible_r2(np.where(np.isfinite(reading), row, np.nan), regressors, blocks)
        r2.append(share)
        rest -= float(np.log(1.0 - min(share, 0.999)))
        peaks.append(spectral_peak(row, period, regressors.values["pressure"]))
    some = blocks.counts.sum(axis=1) > 0
    excess = float(np.max(blocks.means(candidate.errors)[some], initial=0.0))
    return {
        "r2": r2,
        "rest": rest,
        "peaks": peaks,
        "peak": max(p[1] for p in peaks),
        "excess": excess,
    }


def decide(
    problem: Problem,
    family: Any,
    blocks: Blocks,
    base: Candidate,
    causes: Sequence[Cause],
    regressors: Regressors,
    rule: Rule,
    seed: int = 0,
) -> Decision:
    """Search causes, add further ones while they pay, and word the verdict."""
    found = search(problem, family, blocks, base, causes)
    before = left_over(problem, blocks, base, regressors)
    best = found[0] if found else base
    gain = blocks.gain(base.errors, best.errors)
    if gain < rule.least_gain:
        odd = structured(before, rule)
        verdict = "unexplained" if odd else "adequate"
        return Decision(verdict, base, found, [], {"before": before, "after": before})
    model, rivals, first_gain = best, found, gain
    after = left_over(problem, blocks, best, regressors)
    while len(model.causes) < rule.most:
        wanted = max(rule.second_gain, rule.second_share * first_gain)
        larger = search(problem, family, blocks, model, causes, 2, rule.hint * wanted)
        more = blocks.gain(model.errors, larger[0].errors) if larger else 0.0
        if more < wanted:
            break
        if len(model.causes) == 1:
            for first in rivals[1 : rule.beam]:
                larger += search(problem, family, blocks, first, causes, 2)[:4]
            larger.sort(key=lambda c: -blocks.gain(base.errors, c.errors))
        model, rivals = larger[0], distinct(larger)
        gain = blocks.gain(base.errors, model.errors)
        after = left_over(problem, blocks, model, regressors)
    structure = {"before": before, "after": after}
    left = max(after["rest"], float(np.log(max(after["excess"], 1.0))))
    if structured(after, rule) and left > rule.rest * gain:
        return Decision("unexplained", model, rivals, [], structure)
    still = not_excluded(blocks, base, model, rivals, rule, seed)
    verdict = "ambiguous" if still else "named"
    return Decision(verdict, model, rivals, still, structure)


def structured(left: dict[str, Any], rule: Rule) -> bool:
    """Return whether there is more in a residual than noise."""
    return bool(
        max(left["r2"]) > rule.flexible or left["peak"] > rule.peak or left["excess"] > rule.excess
    )


def distinct(candidates: Iterable[Candidate]) -> list[Candidate]:
    """Return candidates without repetitions of the same set of causes."""
    seen, kept = set(), []
    for c in candidates:
        key = frozenset(c.names)
        if key not in seen:
            seen.add(key)
            kept.append(c)
    return kept


def not_excluded(
    blocks: Blocks,
    base: Candidate,
    best: Candidate,
    rivals: Sequence[Candidate],
    rule: Rule,
    seed: int,
) -> list[Candidate]:
    """Return the rivals that are close and not surely worse."""
    gain = blocks.gain(base.errors, best.errors)
    draws = blocks.draws(rule.draws, seed)
    still = []
    for rival in rivals:
        if frozenset(rival.names) == frozenset(best.names):
            continue
        if len(rival.names) != len(best.names):
            continue
        if blocks.gain(base.errors, rival.errors) < rule.close * gain:
            continue
        ahead = blocks.gains(rival.errors, best.errors, draws)
        if float(np.mean(ahead <= 0.0)) > rule.doubt:
            still.append(rival)
    return still


def traces_of(problem: Problem, family: Any, base: Candidate, model: Candidate) -> dict[str, Array]:
    """Return the contribution of each cause of a model to the outputs, shape (channels, T)."""
    fit = model.fit
    whole = column_of(fit, fit.z)
    columns = [whole]
    for _, form in model.causes:
        without = whole.copy()
        for term in form.terms:
            place = family.free(term.name, log=False).place
            without[place] = family.column[place]
        columns.append(without)
    stacked = np.array(columns)
    problem.tie(stacked)
    found = problem.simulate(stacked)
    return {
        cause.name: found[:, :, 0] - found[:, :, i + 1] for i, (cause, _) in enumerate(model.causes)
    }
