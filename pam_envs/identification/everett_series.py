"""Printed inverse (3.5) of fluidic_muscles: a sum over an inverted Everett map.

    u = u_min + sum_i G(F_(i+1), F_i) + G(f, F_k),   G(f_alpha, f_alphabeta) = u_alpha - u_beta

with ``F_i`` the past extrema of the output. ``G`` is read from first-order curves: the sum is exact
up to the first turn, and after two turns only for a map that depends on ``alpha - beta`` alone. The
exact inverse is :meth:`~pam_envs.hysteresis.preisach.Preisach.inverse_step`; this one serves as a
comparison.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from pam_envs.hysteresis.everett import everett
from pam_envs.hysteresis.preisach import Preisach

Array = NDArray[np.float64]


def series_inverse(model: Preisach, outputs: ArrayLike) -> Array:
    """Return the inputs (T,) that (3.5) gives for outputs (T,) of a model that starts low."""
    if model.start != "low":
        raise ValueError(f"start is {model.start!r}; (3.5) counts from u_min: use start='low'")
    stack, found = [model.start_output], []
    for f in np.asarray(outputs, float):
        stack = _dominant(stack, float(f))
        steps = pairwise(stack)
        found.append(model.low + sum(_difference(model, late, early) for early, late in steps))
    return np.array(found)


def _dominant(stack: list[float], f: float) -> list[float]:
    """Return the extrema that an output leaves, and itself at the end."""
    kept = list(stack)
    while len(kept) > 1:
        last, before = kept[-1], kept[-2]
        if (f - last) * (last - before) >= 0.0:  # onward
            kept.pop()
        elif len(kept) > 2 and (f - before) * (before - last) >= 0.0:  # a closed loop
            kept = kept[:-2]
        else:
            break
    return [*kept, f]


def _difference(model: Preisach, late: float, early: float) -> float:
    """Return ``G``: on the first-order curve that turns at the larger output."""
    if late == early:
        return 0.0
    high, low = max(late, early), min(late, early)
    alpha = _root(model, lambda u: _map(model, u, model.low) + model.start_output - high)
    beta = _root(model, lambda u: high - low - _map(model, alpha, u))
    return (alpha - beta) if late > early else (beta - alpha)


def _map(model: Preisach, a: float, b: float) -> float:
    cells = model.inverse_cell
    return float(everett((a - model.low) * cells, (b - model.low) * cells, model.everett))


def _root(model: Preisach, function: Callable[[float], float]) -> float:
    """Return where a rising function crosses 0, or the nearer end of the range."""
    low, high = function(model.low), function(model.high)
    if low >= 0.0 or high <= 0.0:
        return model.low if low >= 0.0 else model.high
    return float(brentq(function, model.low, model.high, xtol=1e-15, rtol=1e-15))
