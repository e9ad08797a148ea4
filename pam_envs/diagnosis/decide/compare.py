"""Comparison of fitted models: penalised gains, preference for simpler causes, significance."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import stdtr

from pam_envs.arrays import Flags, Indices
from pam_envs.diagnosis.decide.rule import Rule
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import Candidate, refit
from pam_envs.diagnosis.fit.least_squares import Problem

CROSS_ROUNDS = 4  # rounds of a fit to other blocks
PERFECT = 0.93
"""Mean square over the noise variance of a perfect model, if the noise is slightly overrated."""


def penalised_gain(blocks: Blocks, base: Candidate, candidate: Candidate, rule: Rule) -> float:
    """Return the gain over a smaller model, less the multiple-comparison penalty."""
    known = set(base.names)
    added = [form for cause, form in candidate.causes if cause.name not in known]
    penalty = sum(np.log(form.trials) for form in added)
    return blocks.gain(base.errors, candidate.errors) - rule.trial_penalty * float(penalty)


def possible_gain(blocks: Blocks, model: Candidate) -> float:
    """Return the gain of a model that leaves only noise over this one, on all blocks."""
    some = blocks.counts.sum(axis=1) > 0
    means = blocks.means(model.errors, np.ones_like(blocks.held_out))[some]
    return float(np.sum(np.log(np.maximum(means / PERFECT, 1.0))))


def prefer_simpler(
    blocks: Blocks, base: Candidate, rivals: Sequence[Candidate], rule: Rule, seed: int = 0
) -> list[Candidate]:
    """Return rivals sorted by penalised gain, with a nearly equal simpler cause put first.

    A drift that has ended before the record starts is a bias, and a very fast resonance a delay:
    a cause that can imitate another one must have a clear and significant gain over it.
    """
    order = sorted(rivals, key=lambda c: -penalised_gain(blocks, base, c, rule))
    best = penalised_gain(blocks, base, order[0], rule)
    margin = max(rule.simpler, rule.simpler_share * best)
    draws = blocks.draws(rule.draws, seed)
    for rival in order[1:]:
        if not imitates(order[0], rival):
            continue
        behind = best - penalised_gain(blocks, base, rival, rule)
        if behind < margin or share_ahead(blocks, rival, order[0], draws) > rule.doubt:
            return [rival, *(r for r in order if r is not rival)]
    return order


def imitates(model: Candidate, other: Candidate) -> bool:
    """Return whether one cause of the model contains the corresponding cause of the other."""
    mine, its = set(model.names), set(other.names)
    if len(model.names) != len(other.names) or len(mine - its) != 1:
        return False
    (own,), (contained,) = mine - its, its - mine
    return any(cause.name == own and contained in cause.contains for cause, _ in model.causes)


def cross_validate(
    problem: Problem, blocks: Blocks, candidates: Sequence[Candidate], rule: Rule
) -> list[Candidate]:
    """Return candidates with errors on every block, each from a fit that left the block out.

    A block that alone shows a shape, like that of a start, is in every fit.
    """
    errors = [candidate.errors.copy() for candidate in candidates]
    fold = (np.arange(len(blocks.held_out)) - np.flatnonzero(blocks.held_out)[0]) % rule.folds
    alone = showing_alone(problem, blocks)
    for k in range(1, rule.folds):
        out = (fold == k) & ~alone
        part = replace(blocks, held_out=out)
        again = replace(problem, train=part.train)
        for candidate, kept in zip(candidates, errors, strict=True):
            kept[:, out] = refit(again, part, candidate, CROSS_ROUNDS, problem).errors[:, out]
    return [replace(c, errors=e) for c, e in zip(candidates, errors, strict=True)]


def showing_alone(problem: Problem, blocks: Blocks) -> Flags:
    """Return the blocks with more than half of the square of a shape, (n,)."""
    found = np.zeros(len(blocks.held_out), bool)
    for shape in problem.shapes:
        sizes = np.bincount(blocks.of, shape**2, minlength=len(found))
        found |= sizes > 0.5 * sizes.sum()
    return found


def p_value(
    problem: Problem, blocks: Blocks, before: Candidate, after: Candidate, looked: int = 1
) -> float:
    """Return the probability of so good a held-out fit if the added cause is absent.

    Without the cause the residual ``e`` of the smaller model is noise. Its product with the change
    ``d`` that the cause makes then has mean zero and at most the variance ``s |d|^2``, with ``s``
    the long-run variance of the noise (its spectrum at frequency zero), estimated from block sums
    of the larger model's residual. One-sided Student test, multiplied by the number of causes
    among which the best was chosen (Bonferroni).
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


def share_ahead(blocks: Blocks, rival: Candidate, best: Candidate, draws: Indices) -> float:
    """Return the share of bootstrap samples of the blocks in which a rival beats the best."""
    return float(np.mean(blocks.gains(rival.errors, best.errors, draws) <= 0.0))


def distinct(candidates: Iterable[Candidate]) -> list[Candidate]:
    """Return candidates, the first of each set of causes."""
    kept: dict[frozenset[str], Candidate] = {}
    for candidate in candidates:
        kept.setdefault(frozenset(candidate.names), candidate)
    return list(kept.values())
