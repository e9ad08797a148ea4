"""How a diagnosis decides: models with more and more causes, the evidence, the verdict."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.decide.rule import Judgement, Rule, judge, required_gain
from pam_envs.diagnosis.decide.search import search
from pam_envs.diagnosis.decide.structure import Regressors, flexible_r2, spectral_peak
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import Candidate, refit, without_each_cause
from pam_envs.diagnosis.fit.least_squares import Problem, column_of

Array = NDArray[np.float64]

CROSS_ROUNDS = 4
"""Rounds of a fit to other blocks."""
PERFECT = 0.93
"""Mean square over the noise of a perfect model, if the noise is a little less than assumed."""
KEPT = 12
"""How many rivals of a level are judged."""


@dataclass(frozen=True)
class Level:
    """The best model with so many causes, its rivals, and what it leaves.

    Attributes
    ----------
    model : Candidate
        The best.
    rivals : list of Candidate
        With as many causes, the best first.
    left : dict
        See :func:`left_over`.
    """

    model: Candidate
    rivals: list[Candidate]
    left: dict[str, Any]


@dataclass
class Decision:
    """What was decided, and on what.

    Attributes
    ----------
    verdict : {"adequate", "named", "ambiguous", "unexplained", "insufficient"}
        In a word.
    model : Candidate
        The base with the causes named.
    rivals, open_rivals : list of Candidate
        What else was fitted, the best first; those of them that are not excluded.
    structure : dict
        What is left before and after.
    evidence : dict
        All that the rule looked at, in plain types: see :func:`judge`.
    """

    verdict: str
    model: Candidate
    rivals: list[Candidate] = field(default_factory=list)
    open_rivals: list[Candidate] = field(default_factory=list)
    structure: dict[str, Any] = field(default_factory=dict)
    evidence: dict[str, Any] = field(default_factory=dict)


def remaining_structure(
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
    levels = [Level(base, [], remaining_structure(problem, blocks, base, regressors))]
    for model, rivals in _ladder(problem, family, blocks, base, causes, rule):
        levels.append(Level(model, rivals, remaining_structure(problem, blocks, model, regressors)))
    evidence = evidence_of(problem, blocks, levels, rule, seed)
    judged = judge(evidence, rule)
    if judged.verdict == "ambiguous":
        cross_validate_level(problem, blocks, levels, regressors, judged, evidence, rule, seed)
        judged = judge(evidence, rule)
    selected = levels[judged.level]
    rivals = selected.rivals if judged.level else levels[min(1, len(levels) - 1)].rivals
    return Decision(
        judged.verdict,
        selected.model,
        rivals,
        [rivals[k] for k in judged.open_rivals],
        {"before": levels[0].left, "after": selected.left},
        evidence,
    )


def cross_validate_level(
    problem: Problem,
    blocks: Blocks,
    levels: list[Level],
    regressors: Regressors,
    judged: Judgement,
    evidence: dict[str, Any],
    rule: Rule,
    seed: int,
) -> None:
    """Compare what is not excluded on all blocks, and order level and evidence anew.

    What was excluded stays so: its gain is of other blocks than the new ones.
    """
    level, found = levels[judged.level], evidence["levels"][judged.level]
    places = [0, *judged.open_rivals]
    smaller = levels[judged.level - 1].model
    base, before, *again = cross_validate(
        problem, blocks, [levels[0].model, smaller, *(level.rivals[k] for k in places)], rule
    )
    every = replace(blocks, held_out=np.ones_like(blocks.held_out))
    ranked = sorted(again, key=lambda c: -penalised_gain(every, base, c, rule))
    order = prefer_simpler(every, base, ranked, rule)
    draws = every.draws(rule.draws, seed)
    rows = [_row(every, base, c, order[0], draws, rule) for c in order]
    places = [places[next(i for i, c in enumerate(again) if c is o)] for o in order]
    others = [k for k in range(len(level.rivals)) if k not in places]
    found["rivals"] = rows + [
        found["rivals"][k] | {"out": True} for k in others if k < len(found["rivals"])
    ]
    found["crossed"] = len(rows)
    found["gain"] = rows[0]["gain"]
    found["added"] = penalised_gain(every, before, order[0], rule)
    found["unsure"] = p_value(problem, blocks, smaller, level.rivals[places[0]], len(level.rivals))
    rivals = [level.rivals[k] for k in (*places, *others)]
    if rivals[0] is not level.model:
        found["left"] = remaining_structure(problem, blocks, rivals[0], regressors)
    levels[judged.level] = Level(rivals[0], rivals, found["left"])


def _ladder(
    problem: Problem,
    family: Any,
    blocks: Blocks,
    base: Candidate,
    causes: Sequence[Cause],
    rule: Rule,
) -> list[tuple[Candidate, list[Candidate]]]:
    """Return the best model with one cause, two, ... and its rivals, while a cause may pay."""
    rivals = search(problem, family, blocks, base, causes)
    if not rivals:
        return []
    rivals = prefer_simpler(blocks, base, rivals, rule)
    found, mended = [(rivals[0], rivals)], False
    while len(found) < rule.most:
        larger = _larger(problem, family, blocks, base, causes, found, rule)
        if not larger:
            break
        better = (
            None
            if mended
            else with_one_cause_less(problem, blocks, base, larger[0], found[-1], rule)
        )
        mended = better is not None
        if better is not None:  # what was added only mended a fit that had stuck
            found[-1] = better
            continue
        found.append((larger[0], larger))
    return found


def _larger(
    problem: Problem,
    family: Any,
    blocks: Blocks,
    base: Candidate,
    causes: Sequence[Cause],
    found: Sequence[tuple[Candidate, list[Candidate]]],
    rule: Rule,
) -> list[Candidate]:
    """Return models with one more cause than the last found, the best first; none if none pays."""
    model, rivals = found[-1]
    first_gain = penalised_gain(blocks, base, found[0][0], rule)
    possible = possible_gain(blocks, model)
    wanted = required_gain(first_gain, possible, rule)
    if first_gain < rule.least_gain or possible < wanted:
        return []
    larger = search(problem, family, blocks, model, causes, 2, rule.hint * wanted)
    if max((penalised_gain(blocks, model, c, rule) for c in larger), default=0.0) < wanted:
        return []
    if len(found) == 1:
        for first in rivals[1 : rule.beam]:
            larger += search(problem, family, blocks, first, causes, 2)[:4]
    larger.sort(key=lambda c: -penalised_gain(blocks, base, c, rule))
    return prefer_simpler(blocks, base, distinct(larger), rule)


def with_one_cause_less(
    problem: Problem,
    blocks: Blocks,
    base: Candidate,
    model: Candidate,
    known: tuple[Candidate, list[Candidate]],
    rule: Rule,
) -> tuple[Candidate, list[Candidate]] | None:
    """Return the models with a cause less, if one begun at a larger model does better than known.

    A fit that has stuck borrows a second cause to get away; without it, it may then stay there.
    """
    made = list(without_each_cause(problem, blocks, base, model).values())
    best = max(made, key=lambda c: penalised_gain(blocks, base, c, rule))
    if (
        penalised_gain(blocks, base, best, rule)
        < penalised_gain(blocks, base, known[0], rule) + rule.simpler
    ):
        return None
    rivals = [best, *(r for r in known[1] if set(r.names) != set(best.names))]
    rivals = prefer_simpler(blocks, base, rivals, rule)
    return rivals[0], rivals


def possible_gain(blocks: Blocks, model: Candidate) -> float:
    """Return the gain of a model that leaves nothing but noise, on all blocks."""
    some = blocks.counts.sum(axis=1) > 0
    whole = blocks.means(model.errors, np.ones_like(blocks.held_out))[some]
    return float(np.sum(np.log(np.maximum(whole / PERFECT, 1.0))))


def penalised_gain(blocks: Blocks, base: Candidate, candidate: Candidate, rule: Rule) -> float:
    """Return a candidate's gain over a smaller one, less the penalty for having looked often."""
    known = set(base.names)
    trials = sum(np.log(form.trials) for cause, form in candidate.causes if cause.name not in known)
    return blocks.gain(base.errors, candidate.errors) - rule.trial_penalty * float(trials)


def prefer_simpler(
    blocks: Blocks, base: Candidate, rivals: Sequence[Candidate], rule: Rule, seed: int = 0
) -> list[Candidate]:
    """Return rivals, best first, a cause that another one contains before it where both are close.

    A drift that is over before the record begins is a bias, and a very fast resonance a delay:
    what can imitate another cause has to gain more than that one, and surely.
    """
    order = sorted(rivals, key=lambda c: -penalised_gain(blocks, base, c, rule))
    best = penalised_gain(blocks, base, order[0], rule)
    margin = max(rule.simpler, rule.simpler_share * best)
    draws = blocks.draws(rule.draws, seed)
    for rival in order[1:]:
        if not imitates(order[0], rival):
            continue
        behind = best - penalised_gain(blocks, base, rival, rule)
        if behind < margin or _better(blocks, rival, order[0], draws) > rule.doubt:
            return [rival, *(r for r in order if r is not rival)]
    return order


def imitates(model: Candidate, other: Candidate) -> bool:
    """Return whether the model, with one cause in a limit, is the other."""
    mine, its = set(model.names), set(other.names)
    if len(model.names) != len(other.names) or len(mine - its) != 1:
        return False
    (own,), (other_cause,) = mine - its, its - mine
    return any(cause.name == own and other_cause in cause.contains for cause, _ in model.causes)


def cross_validate(
    problem: Problem, blocks: Blocks, candidates: Sequence[Candidate], rule: Rule
) -> list[Candidate]:
    """Return candidates with errors on all blocks, each from a fit to other blocks."""
    errors = [candidate.errors.copy() for candidate in candidates]
    fold = (np.arange(len(blocks.held_out)) - np.flatnonzero(blocks.held_out)[0]) % rule.folds
    for k in range(1, rule.folds):
        out = fold == k
        part = replace(blocks, held_out=out)
        again = replace(problem, train=part.train)
        for candidate, kept in zip(candidates, errors, strict=True):
            kept[:, out] = refit(again, part, candidate, CROSS_ROUNDS).errors[:, out]
    return [replace(c, errors=e) for c, e in zip(candidates, errors, strict=True)]


def evidence_of(
    problem: Problem, blocks: Blocks, levels: Sequence[Level], rule: Rule, seed: int = 0
) -> dict[str, Any]:
    """Return what a rule decides on, in plain types.

    ``blocks`` counts those held out. Under ``levels``, one entry for each number of causes from
    none: ``gain`` over the base, ``added`` over the level before, what it would be if nothing but
    noise were left (``possible``), how ``unsure`` it is, what is ``left``, and the ``rivals``, the
    best first, each with ``names``, ``forms``, ``gain``, ``better``: the part of the samples of
    blocks in which it is ahead of the best, ``imitates``: whether it has the best as a limit, and
    ``out``: whether it was excluded before the others were compared on all blocks.
    """
    base = levels[0].model
    draws = blocks.draws(rule.draws, seed)
    made = []
    for k, level in enumerate(levels):
        before = levels[max(k - 1, 0)].model
        made.append(
            {
                "gain": penalised_gain(blocks, base, level.model, rule),
                "added": penalised_gain(blocks, before, level.model, rule),
                "possible": possible_gain(blocks, before),
                "unsure": p_value(problem, blocks, before, level.model, len(level.rivals)),
                "left": level.left,
                "rivals": [
                    _row(blocks, base, rival, level.model, draws, rule)
                    for rival in level.rivals[:KEPT]
                ],
            }
        )
    return {"blocks": int(blocks.held_out.sum()), "levels": made}


def _row(
    blocks: Blocks,
    base: Candidate,
    rival: Candidate,
    best: Candidate,
    draws: NDArray[np.int64],
    rule: Rule,
) -> dict[str, Any]:
    """Return what the rule looks at of a rival."""
    return {
        "names": list(rival.names),
        "forms": [form.name for _, form in rival.causes],
        "gain": penalised_gain(blocks, base, rival, rule),
        "better": _better(blocks, rival, best, draws),
        "imitates": imitates(rival, best),
        "out": False,
    }


def p_value(
    problem: Problem, blocks: Blocks, before: Candidate, after: Candidate, looked: int = 1
) -> float:
    """Return how likely a cause fits the held-out blocks as well if it is not there.

    Without it the residual ``e`` of the smaller model is noise, and its product with the change
    ``d`` that the cause makes has mean zero and at most the variance ``s |d|^2``, with ``s`` the
    long-run variance of the noise (its spectrum at frequency zero, where that of slow noise is
    largest), taken from sums over blocks of what the larger model leaves. One-sided, of Student's
    distribution, times the number of causes among which the best was chosen (Bonferroni).
    """
    here = blocks.held_out[blocks.of]
    left = problem.rows(after.fit.residual)
    change = problem.rows(before.fit.residual) - left
    product, variance = 0.0, 0.0
    for e, d, counts in zip(left, change, blocks.counts, strict=True):
        sums = np.bincount(blocks.of, e, minlength=len(counts))
        slow = float(np.mean((sums**2)[counts > 0] / counts[counts > 0])) if counts.any() else 0.0
        variance += max(slow, 1.0) * float(np.sum(d[here] ** 2))
        product += float(np.sum((e + d)[here] * d[here]))
    freedom = max(1, int((blocks.counts.max(axis=0) > 0).sum()) - 1)
    likely = stdtr(freedom, -product / max(np.sqrt(variance), 1e-12))
    return float(min(1.0, max(looked, 1) * likely))


def _better(blocks: Blocks, rival: Candidate, best: Candidate, draws: NDArray[np.int64]) -> float:
    return float(np.mean(blocks.gains(rival.errors, best.errors, draws) <= 0.0))


def distinct(candidates: Iterable[Candidate]) -> list[Candidate]:
    """Return candidates without repetitions of the same set of causes."""
    seen, kept = set(), []
    for c in candidates:
        key = frozenset(c.names)
        if key not in seen:
            seen.add(key)
            kept.append(c)
    return kept


def effect_traces(
    problem: Problem, family: Any, base: Candidate, model: Candidate
) -> dict[str, Array]:
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
