"""Search over causes: rival extensions of one base, fitted side by side."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import (
    Candidate,
    best_by_name,
    complete_jacobian,
    initial_fits,
    polish,
)
from pam_envs.diagnosis.fit.least_squares import (
    FEW_DAMPINGS,
    Fit,
    PlantFamily,
    Problem,
    evaluate,
    improve,
    share,
)

SCHEDULE = ((2, 8, 0.4), (2, 5, 0.6), (4, 4, 0.8))
"""Rounds with the base's Jacobian held; number of fits kept then, or their least share of the best
gain."""
FIRST_SIGHT = 0.3  # share of a required gain that the first round of a search must reach
POLISHED = 3  # number of the best rivals that are polished


def search(
    problem: Problem,
    family: PlantFamily,
    blocks: Blocks,
    base: Candidate,
    causes: Iterable[Cause],
    polished: int = POLISHED,
    least: float = 0.0,
) -> list[Candidate]:
    """Return the base extended by each cause in its best form, best first.

    The result is empty if the first rounds do not reach a gain of ``least``.
    """
    complete_jacobian(problem, base.fit)
    shared = share(problem, base.fit)
    fits = [
        fit
        for cause in causes
        if cause.name not in base.names
        for form in cause.forms
        for fit in initial_fits(problem, family, base.fit, cause, form, shared)
    ]
    if not fits:
        return []
    evaluate(problem, fits)
    if least > 0.0:
        improve(problem, fits, 1, 1e-4, FEW_DAMPINGS)
        if np.log(base.fit.cost / min(f.cost for f in fits)) < FIRST_SIGHT * least:
            return []
    for rounds, kept, share_kept in SCHEDULE:
        improve(problem, fits, rounds, 1e-4, FEW_DAMPINGS)
        _drop(fits, base.fit.cost, kept, share_kept)
        if least > 0.0 and np.log(base.fit.cost / min(f.cost for f in fits)) < least:
            return []
    best = best_by_name((fit.label[0].name, fit) for fit in fits)
    ranked = sorted(best.values(), key=lambda f: f.cost)
    held_out = sorted(ranked, key=lambda f: -_gain(problem, blocks, base, f))
    selected = {f.label[0].name: f for f in (*ranked[:polished], *held_out[:polished])}
    polish(problem, list(selected.values()))
    found = [
        Candidate((*base.causes, fit.label), fit, blocks.errors(problem.rows(fit.residual)))
        for fit in ranked
    ]
    return sorted(found, key=lambda c: -blocks.gain(base.errors, c.errors))


def _gain(problem: Problem, blocks: Blocks, base: Candidate, fit: Fit) -> float:
    return blocks.gain(base.errors, blocks.errors(problem.rows(fit.residual)))


def _drop(fits: Sequence[Fit], start: float, kept: int, part: float) -> None:
    """Stop fits with little gain, except for some of the best."""
    gains = np.log([max(start / f.cost, 1e-12) for f in fits])
    line = np.sort(gains)[::-1][min(kept, len(fits)) - 1]
    for fit, gain in zip(fits, gains, strict=True):
        fit.done = fit.done or (gain < line and gain < part * gains.max())
