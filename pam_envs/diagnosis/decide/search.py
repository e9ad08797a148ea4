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
POLISHED = 4  # number of the best rivals that are polished, by cost and by gain
CLOSE, CONVERGED = 0.5, 14
"""Share of the best gain from which a fit is continued, and the largest number of its rounds."""


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
        lsq.improve(problem, fits, rounds, 1e-4, lsq.FEW_DAMPINGS, boxed=True)
        _drop(fits, base.fit.cost, kept, share_kept)
        if least > 0.0 and np.log(base.fit.cost / min(f.cost for f in fits)) < least:
            return []
    ranked = converged(problem, blocks, base, fits, polished)
    found = [
        candidates.Candidate(
            (*base.causes, fit.label), fit, blocks.errors(problem.rows(fit.residual))
        )
        for fit in ranked
    ]
    return sorted(found, key=lambda c: -blocks.gain(base.errors, c.errors))


def converged(
    problem: lsq.Problem,
    blocks: Blocks,
    base: candidates.Candidate,
    fits: Sequence[lsq.Fit],
    polished: int,
) -> list[lsq.Fit]:
    """Return the best fit of each cause, for the leading causes after convergence.

    All forms of a leading cause are fitted with a Jacobian of their own: with slopes that hold only
    near the base's optimum, another form of a cause may come first.
    """

    def gain(fit: lsq.Fit) -> float:
        return blocks.gain(base.errors, blocks.errors(problem.rows(fit.residual)))

    of_forms = list(candidates.best_by_name((id(fit.label[1]), fit) for fit in fits).values())
    leading: set[str] = set()
    for order in (lambda fit: fit.cost), (lambda fit: -gain(fit)):
        names = dict.fromkeys(fit.label[0].name for fit in sorted(of_forms, key=order))
        leading |= set(list(names)[:polished])
    selected = [fit for fit in of_forms if fit.label[0].name in leading]
    candidates.polish(problem, selected, boxed=True)
    most = max(map(gain, selected))
    close = [fit for fit in selected if gain(fit) >= CLOSE * most]
    for fit in close:
        fit.done, fit.damping = False, 1.0
    lsq.improve(problem, close, CONVERGED, 1e-4, boxed=True)
    best = candidates.best_by_name((fit.label[0].name, fit) for fit in of_forms)
    return sorted(best.values(), key=lambda fit: fit.cost)


def _drop(fits: Sequence[lsq.Fit], start: float, kept: int, part: float) -> None:
    """Stop fits with little gain, except for some of the best."""
    gains = np.log([max(start / f.cost, 1e-12) for f in fits])
    line = np.sort(gains)[::-1][min(kept, len(fits)) - 1]
    for fit, gain in zip(fits, gains, strict=True):
        fit.done = fit.done or (gain < line and gain < part * gains.max())
