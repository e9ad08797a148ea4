"""Play and Maxwell-slip models from measured loops, by non-negative least squares.

With given thresholds the output is linear in the weights, and the states of the plays follow from
the input alone: the fit is a convex problem. Non-negative weights keep the model passive and
invertible. A loop of amplitude ``a`` does not determine weights of thresholds above ``a``, nor of
two neighbours that begin to move within one sample: the rank of the regressors is returned.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import nnls

from pam_envs.hysteresis.maxwell_slip import MaxwellSlip, PlayOperator

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LoopFit:
    """Identified model and its identifiability.

    Attributes
    ----------
    model : PlayOperator or MaxwellSlip
        The fitted model.
    offset, rms : float
        Constant added to its output, and RMS residual, in the unit of the output.
    rank, unknowns : int
        Rank of the regressors (line, elements, constant) and number of unknowns; more of these
        mean that other weights fit as well.
    """

    model: PlayOperator | MaxwellSlip
    offset: float
    rms: float
    rank: int
    unknowns: int

    @property
    def determined(self) -> bool:
        """True if the record determines every unknown."""
        return self.rank == self.unknowns


def fit_play(
    x: ArrayLike,
    y: ArrayLike,
    thresholds: ArrayLike | None = None,
    initial_state: ArrayLike | None = None,
    elements: int = 8,
) -> LoopFit:
    """Return the play operator, plus a constant, that is nearest to a record.

    Parameters
    ----------
    x, y : array_like, shape (T,)
        Input and output, from a known state on.
    thresholds : array_like, shape (n,), optional
        Rising thresholds; ``elements`` even ones below half the input's span by default.
    initial_state : array_like, shape (n,), optional
        Play positions before the first sample; zeros, the virgin state, by default.
    elements : int
        Number of default thresholds.
    """
    inputs, outputs = measured(x, y)
    ladder = _ladder(inputs, thresholds, elements)
    probe = PlayOperator(ladder, (1.0,) * len(ladder), 1.0)
    plays = _positions(probe, inputs, initial_state)
    return _fit(inputs, plays, outputs, lambda w: PlayOperator(ladder, tuple(w[1:]), w[0]))


def fit_maxwell_slip(
    x: ArrayLike,
    force: ArrayLike,
    break_displacements: ArrayLike | None = None,
    initial_state: ArrayLike | None = None,
    elements: int = 8,
) -> LoopFit:
    """Return the Maxwell-slip model, plus a constant, that is nearest to a record.

    As :func:`fit_play`, for a length ``x``, a ``force`` and an ``initial_state`` of slip positions.
    """
    inputs, outputs = measured(x, force)
    ladder = _ladder(inputs, break_displacements, elements)
    probe = MaxwellSlip(1.0, (1.0,) * len(ladder), ladder)
    stops = inputs[:, None] - _positions(probe, inputs, initial_state)
    return _fit(inputs, stops, outputs, lambda w: MaxwellSlip(w[0], tuple(w[1:]), ladder))


def _fit(
    x: Array, elements: Array, y: Array, model: Callable[[Array], PlayOperator | MaxwellSlip]
) -> LoopFit:
    """Fit a line, elements (T, n) and a constant; ``model`` makes a model of slope and weights."""
    values, offset, rms, rank = non_negative(np.column_stack([x, elements]), y)
    return LoopFit(model(values), offset, rms, rank, len(values) + 1)


def non_negative(columns: Array, y: Array) -> tuple[Array, float, float, int]:
    """Fit ``y`` (T,) by a constant of either sign and by columns (T, n) with weights of at least 0.

    Returns the weights (0 for a column that does not vary), the constant, the RMS residual, and the
    rank of the columns together with the constant.
    """
    middle, level = columns.mean(axis=0), float(y.mean())
    centred = columns - middle
    size = np.sqrt(np.sum(centred**2, axis=0))
    used = size > 1e-12 * np.max(size, initial=0.0)
    scaled = centred[:, used] / size[used]
    rank = 1 + (int(np.linalg.matrix_rank(scaled)) if scaled.size else 0)
    weights = np.zeros(columns.shape[1])
    if scaled.size:
        weights[used] = _polished(scaled, y - level, nnls(scaled, y - level)[0]) / size[used]
    offset = level - float(middle @ weights)
    residual = y - columns @ weights - offset
    return weights, offset, float(np.sqrt(np.mean(residual**2))), rank


def _polished(columns: Array, y: Array, found: Array) -> Array:
    """Solve once more on the columns in use: the active-set method squares the condition."""
    active = found > 0.0
    if not np.any(active):
        return found
    better = np.linalg.lstsq(columns[:, active], y, rcond=None)[0]
    if np.any(better < 0.0):
        return found
    result = np.zeros_like(found)
    result[active] = better
    return result


def _positions(
    probe: PlayOperator | MaxwellSlip, x: Array, initial_state: ArrayLike | None
) -> Array:
    state = probe.initial_state()
    if initial_state is not None:
        state = np.asarray(initial_state, dtype=float)
        if state.shape != probe.initial_state().shape:
            raise ValueError(
                f"initial_state has shape {state.shape}; it must be one value per threshold,"
                f" {probe.initial_state().shape}"
            )
    positions = np.empty((len(x), state.size))
    for t, value in enumerate(x):
        _, state = probe.step(value, state)
        positions[t] = state
    return positions


def _ladder(x: Array, thresholds: ArrayLike | None, elements: int) -> tuple[float, ...]:
    if thresholds is not None:
        return tuple(float(r) for r in np.atleast_1d(np.asarray(thresholds, dtype=float)))
    if elements < 1:
        raise ValueError(f"elements is {elements}; it must be at least 1: 8 is the default")
    half = 0.5 * float(np.ptp(x))
    if half == 0.0:
        raise ValueError("x does not vary: measure a loop, or give the thresholds")
    return tuple(half * (np.arange(elements) + 1.0) / (elements + 1.0))


def measured(x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
    """Return a record as two float arrays, or say what is wrong with it."""
    inputs, outputs = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    if inputs.ndim != 1 or inputs.shape != outputs.shape or inputs.size < 2:
        raise ValueError(
            f"x has shape {inputs.shape} and y {outputs.shape}; give two series of one length,"
            " at least 2 samples"
        )
    for name, values in (("x", inputs), ("y", outputs)):
        if not np.all(np.isfinite(values)):
            t = int(np.argmin(np.isfinite(values)))
            raise ValueError(f"{name}[{t}] is {values[t]}; it must be finite: cut or fill the gap")
    return inputs, outputs
