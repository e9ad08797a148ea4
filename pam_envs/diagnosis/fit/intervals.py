"""Confidence intervals of fitted parameters, robust against noise that is correlated in blocks."""

from typing import Any

import numpy as np
from scipy.special import stdtrit

from pam_envs.arrays import Array
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import complete_jacobian
from pam_envs.diagnosis.fit.least_squares import Fit, Free, Problem, normal_equations

Json = dict[str, Any]

LEAST_LEFT = 2
"""Least number of degrees of freedom, for records with hardly more blocks than parameters."""
NEAR_BOUND = 1e-9
"""Distance from a bound, over the value or over the span, that counts as at the bound."""
WIDE_LOG, WIDE = 10.0, 0.5
"""An interval wider than this factor, or this share of the bounds, is not identified."""


def at_bound(free: Free, value: float) -> bool:
    """Return whether a parameter is at one of its bounds, within the rounding of a logarithm."""
    slack = NEAR_BOUND * (abs(value) if free.log else free.high - free.low)
    return bool(value <= free.low + slack or value >= free.high - slack)


def middle(free: Free) -> float:
    """Return the middle of a parameter's bounds, the geometric one on a logarithmic scale."""
    return float(np.sqrt(free.low * free.high)) if free.log else 0.5 * (free.low + free.high)


def interval_half_widths(problem: Problem, blocks: Blocks, fit: Fit) -> Array:
    """Return half-widths of the 95 % confidence intervals of a fit's internal coordinates.

    Sandwich estimate from the curvature of the fit and the scatter of the blocks' gradients, valid
    for noise that is correlated within a block; never less than the value for white noise of the
    declared size. Student's t with the number of blocks less that of parameters. Parameters at a
    bound do not widen the other intervals.
    """
    complete_jacobian(problem, fit)
    normal, _ = normal_equations(problem, fit)
    n = problem.sampled
    of = np.tile(blocks.of, len(problem.measured))[problem.order[:n]]
    pulls = fit.slopes[:, :n] * fit.residual[:n]
    sums = np.stack([np.bincount(of, row, minlength=len(blocks.held_out)) for row in pulls])
    scatter, values = sums @ sums.T, fit.values()
    may_be_within = np.array([not at_bound(f, values[f.name]) for f in fit.frees])
    number = len(np.unique(of))
    found = np.zeros(len(fit.frees))
    for places in (np.arange(len(found)), np.flatnonzero(may_be_within)):
        part = np.ix_(places, places)
        inverse = np.linalg.pinv(normal[part], rcond=1e-12, hermitian=True)
        left = max(number - len(places), LEAST_LEFT)
        spread = np.diag(inverse @ scatter[part] @ inverse) * number / left
        wide = np.sqrt(np.maximum(spread, np.diag(inverse)))
        found[places] = float(stdtrit(left, 0.975)) * wide
    return found


def spans(problem: Problem, blocks: Blocks, fit: Fit) -> dict[str, Json]:
    """Return the 95 % confidence interval of each parameter [SI] and its flags."""
    made, values = {}, fit.values()
    for free, z, half in zip(
        fit.frees, fit.z, interval_half_widths(problem, blocks, fit), strict=True
    ):
        made[free.name] = span(free, values[free.name], float(z), float(half))
    return made


def span(free: Free, value: float, z: float, half: float) -> Json:
    """Return the interval of one parameter, open on the side where the fit is at a bound."""
    low, high = (float(v) for v in free.outer(np.array([z - half, z + half])))
    if free.log:
        wide = low <= 0.0 or high > WIDE_LOG * low
    else:
        wide = high - low > WIDE * (free.high - free.low)
    return {
        "interval": [
            None if at_bound(free, value) and value < middle(free) else low,
            None if at_bound(free, value) and value >= middle(free) else high,
        ],
        "at_bound": at_bound(free, value),
        "not_identified": bool(wide),
    }
