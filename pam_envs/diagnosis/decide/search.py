"""Search over causes: rival extensions of one base, fitted side by side."""

from collections.abc import Sequence

import numpy as np

from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.decide.screen import Screen, chosen
from pam_envs.diagnosis.fit import candidate as candidates
from pam_envs.diagnosis.fit import least_squares as lsq
from pam_envs.diagnosis.fit.blocks import Blocks

MOST_FITS = 14  # number of starting points that are fitted
SCHEDULE = ((2, 8, 0.4), (2, 5, 0.6), (3, 4, 0.8))
"""Rounds with the base's Jacobian held; number of fits kept then, or their least share of the best
gain."""
FIRST_SIGHT = 0.3  # share of a required gain that the prediction of a search must reach
POLISHED = 3  # number of the best rivals that are polished


def search(
    problem: lsq.Problem,
    family: lsq.PlantFamily,
    blocks: Blocks,
    base: candidates.Candidate,
    causes: Sequence[Cause],
    screen: Screen,
    polished: int = POLISHED,
    least: float = 0.0,
) -> list[candidates.Candidate]:
    """Return the base extended by each cause, best first; empty below a gain of ``least``."""
    candidates.complete_jacobian(problem, base.fit)
    shared = lsq.share(problem, base.fit)
    rivals = [cause for cause in causes if cause.name not in base.names]
    predicted = chosen(screen.predictions(problem, family, base.fit, shared, rivals), MOST_FITS)
    if not predicted:
        return []
    if least > 0.0 and predicted[0][0] < FIRST_SIGHT * -np.expm1(-least) * base.fit.cost:
        return []
    fits = [
        fit
        for _, cause, form, values in predicted
        for fit in candidates.initial_fits(problem, family, base.fit, cause, form, shared, [values])
    ]
    lsq.evaluate(problem, fits)
    for rounds, kept, share_kept in SCHEDULE:
        lsq.improve(problem, fits, rounds, 1e-4, lsq.FEW_DAMPINGS)
        _drop(fits, base.fit.cost, kept, share_kept)
        if least > 0.0 and np.log(base.fit.cost / min(f.cost for f in fits)) < least:
            return []
    best = candidates.best_by_name((fit.label[0].name, fit) for fit in fits)
    ranked = sorted(best.values(), key=lambda f: f.cost)
    held_out = sorted(ranked, key=lambda f: -_gain(problem, blocks, base, f))
    selected = {f.label[0].name: f for f in (*ranked[:polished], *held_out[:polished])}
    candidates.polish(problem, list(selected.values()))
    found = [
        candidates.Candidate(
            (*base.causes, fit.label), fit, blocks.errors(problem.rows(fit.residual))
        )
        for fit in ranked
    ]
    return sorted(found, key=lambda c: -blocks.gain(base.errors, c.errors))


def _gain(problem: lsq.Problem, blocks: Blocks, base: candidates.Candidate, fit: lsq.Fit) -> float:
    return blocks.gain(base.errors, blocks.errors(problem.rows(fit.residual)))


def _drop(fits: Sequence[lsq.Fit], start: float, kept: int, part: float) -> None:
    """Stop fits with little gain, except for some of the best."""
    gains = np.log([max(start / f.cost, 1e-12) for f in fits])
    line = np.sort(gains)[::-1][min(kept, len(fits)) - 1]
    for fit, gain in zip(fits, gains, strict=True):
        fit.done = fit.done or (gain < line and gain < part * gains.max())
