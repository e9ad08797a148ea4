"""Maxwell-slip elements and play operators: two duals of one rate-independent hysteresis.

A *play* follows its input at a distance of at most its threshold. A *stop* (an elasto-slip
element: a spring in series with dry friction) is the rest, ``stop = x - play``. Springs and stops
in parallel make the Maxwell-slip model, length in and force out; plays in parallel make the
Prandtl-Ishlinskii operator, force or pressure in and length out. Each is the exact inverse of the
other, in the middle of a history too: see :meth:`PlayOperator.inverse`.

References
----------
F. Al-Bender, V. Lampaert, J. Swevers, "The generalized Maxwell-slip model", IEEE Trans. Automatic
Control 50 (2005). P. Krejci, K. Kuhnen, "Inverse control of systems with hysteresis and creep",
IEE Proc. Control Theory Appl. 148 (2001), for the inverse and its state.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.hysteresis.checks import check_not_negative, check_thresholds, floats, width_of
from pam_envs.hysteresis.elements import ParallelElements, plays_lag, plays_peek, plays_step
from pam_envs.hysteresis.everett import play_table
from pam_envs.hysteresis.protocol import (
    ELEMENTS,
    HysteresisModel,
    Kernels,
    Rows,
    RowsState,
    Start,
    Usage,
    register,
)


@register
@dataclass(frozen=True)
class PlayOperator(ParallelElements, HysteresisModel):
    """A line and plays in parallel: ``y = linear * x + sum(weights * plays)``.

    Parameters
    ----------
    thresholds : tuple of float
        Half dead widths of the plays, rising, at least 0, in the unit of the input.
    weights : tuple of float
        Slope that each play adds when it moves, output unit per input unit. Not negative for a
        passive, invertible operator.
    linear : float
        Slope of the hysteresis-free part [unit of the output per unit of the input].
    """

    kind: ClassVar[str] = "maxwell_slip"
    kernels: ClassVar[Kernels] = Kernels(plays_step, lag=plays_lag, peek=plays_peek)
    state_rows: ClassVar[int] = ELEMENTS

    thresholds: tuple[float, ...]
    weights: tuple[float, ...]
    linear: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "thresholds", floats("thresholds", self.thresholds))
        object.__setattr__(self, "weights", floats("weights", self.weights))
        object.__setattr__(self, "linear", floats("linear", (self.linear,))[0])
        check_thresholds("thresholds", self.thresholds, len(self.weights), "weights")

    @cached_property
    def parts(self) -> tuple[Array, Array, float]:
        """Thresholds, weights and linear part."""
        return np.array(self.thresholds), np.array(self.weights), self.linear

    @property
    def total_slope(self) -> float:
        """The slope where every play moves: that of large amplitudes."""
        return self.linear + math.fsum(self.weights)

    @property
    def largest_lag(self) -> float:
        """Distance of the output from the line after a long way in one direction."""
        return self.friction

    # --- the protocol ---------------------------------------------------------------------------

    @property
    def elements(self) -> int:
        """Number of plays."""
        return len(self.thresholds)

    def numbers(self, full: float | None = None) -> list[float]:
        """Return the total slope, the linear part, thresholds and weights, filled up."""
        idle = [0.0] * (ELEMENTS - self.elements)
        return [self.total_slope, self.linear, *self.thresholds, *idle, *self.weights, *idle]

    def check(self, usage: Usage) -> None:
        """Refuse too many plays, and a total slope other than 1 where the plant needs 1."""
        if self.elements > ELEMENTS:
            raise ValueError(
                f"hysteresis: {self.elements} elements, at most {ELEMENTS} are simulated; merge "
                "neighbouring thresholds"
            )
        total = self.linear + sum(self.weights)
        if usage.unit_slope and (abs(total - 1.0) > 1e-9 or self.linear <= 0.0):
            raise ValueError(
                f"hysteresis: the play operator's total slope is {total:g} with a linear part of "
                f"{self.linear:g}; the hysteresis of {usage.plant} needs total slope 1 and a "
                "linear part above 0: scale the weights"
            )

    def rows(self) -> "PlayRows":
        """Return the operator and its inverse over rows of environments."""
        return PlayRows(self)

    def everett_map(
        self, low: float, high: float, levels: int, start: Start
    ) -> tuple[Array, float]:
        """Return the Everett map, shape (levels, levels), and the output at the start."""
        output = self.total_slope * low + self.friction if start == "low" else 0.0
        return play_table(self, np.linspace(low, high, levels)), output

    # --- inverse --------------------------------------------------------------------------------

    def inverse_step(self, y: ArrayLike, state: ArrayLike) -> tuple[Array, Array]:
        """Return the input that gives the output ``y``, and the state after it.

        The shapes are those of :meth:`step`, whose exact inverse this is.
        """
        x = self.inverse().step(y, self.inverse_state(state))[0]
        return x, self.step(x, state)[1]

    def scaled(self, width: float, slope: float | None = None) -> "PlayOperator":
        """Return this operator with its hysteresis made ``width`` times as wide.

        The output is ``s x - width (s x - y)`` with ``s`` the total slope (whatever ``slope``): 0
        is free of hysteresis, 1 is this operator, and the slope of large amplitudes is the same.
        """
        width = width_of(width)
        linear = width * self.linear + (1.0 - width) * self.total_slope
        return replace(self, weights=tuple(width * a for a in self.weights), linear=linear)

    def _slopes(self) -> list[float]:
        """Return the slope of the initial loading curve before every play moves, and after all."""
        check_not_negative("weights", self.weights, "for the operator to have an inverse")
        slopes = [self.linear]
        for threshold, weight in zip(self.thresholds, self.weights, strict=True):
            if threshold == 0.0:  # a play without width is part of the line
                slopes[0] += weight
            slopes.append(slopes[-1] + (weight if threshold > 0.0 else 0.0))
        if slopes[0] <= 0.0:
            raise ValueError(
                f"the initial slope is {slopes[0]}; it must be above 0 for the operator to have"
                " an inverse: add to linear, which is the output's motion right after a turn"
            )
        return slopes

    def inverse(self) -> "MaxwellSlip":
        """Return the Maxwell-slip model that undoes this operator exactly.

        The inverse's initial loading curve is the mirror image of this operator's: its break
        displacements are the outputs at which this operator's plays begin to move, its slopes are
        the reciprocals. Feed it from :meth:`inverse_state` in the middle of a history.

        Raises
        ------
        ValueError
            If a weight is negative or the initial slope is not above 0.
        """
        slopes = self._slopes()
        stiffnesses, breaks = _dual(self.thresholds, self.weights, slopes)
        return MaxwellSlip(1.0 / slopes[-1], stiffnesses, breaks)

    def inverse_state(self, state: ArrayLike) -> Array:
        """Return the inverse's state, shape (..., n), for a state that this operator reached.

        ``psi_i = A_i w_i + sum over j > i of weights_j w_j`` with ``A_i`` the slope of the
        loading curve once play ``i`` moves.
        """
        return _mirrored(state, self._slopes(), self.weights)


@dataclass(frozen=True)
class PlayRows(Rows):
    """Plays and the Maxwell-slip model that inverts them, over rows of environments.

    The numbers of :meth:`PlayOperator.step` and :meth:`PlayOperator.inverse_step`, without
    rebuilding the inverse at each sample.
    """

    operator: PlayOperator

    @cached_property
    def _inverse(self) -> "tuple[MaxwellSlip, Array]":
        mirror = self.operator.inverse_state(np.eye(self.operator.elements)).T  # it is linear
        return self.operator.inverse(), mirror

    def forward(self, x: Array, state: RowsState) -> tuple[Array, RowsState]:
        """Return the outputs for inputs, shape (rows,), and the states they leave."""
        thresholds, weights, linear = self.operator.parts
        column = x[:, None]
        plays = np.maximum(column - thresholds, np.minimum(column + thresholds, state[0]))
        return linear * x + np.add.reduce(weights * plays, axis=1), (plays,)

    def inverse(self, y: Array, state: RowsState) -> Array:
        """Return the inputs that give outputs, shape (rows,), without changing the states."""
        undo, mirror = self._inverse
        breaks, stiffnesses, spring = undo.parts
        slips = np.add.reduce(mirror * state[0][:, None, :], axis=2)
        column = y[:, None]
        slips = np.maximum(column - breaks, np.minimum(column + breaks, slips))
        return np.asarray(spring * y + np.add.reduce(stiffnesses * (column - slips), axis=1))


@dataclass(frozen=True)
class MaxwellSlip(ParallelElements):
    """A spring and elasto-slip elements in parallel: ``spring * x + sum(k * stop)``.

    Parameters
    ----------
    spring : float
        Stiffness of the spring that never slips [force per length], at least 0.
    stiffnesses : tuple of float
        Stiffnesses ``k`` of the elements, at least 0.
    break_displacements : tuple of float
        Deflections at which the elements slip, rising, at least 0. The break force of an element
        is its stiffness times this.

    Notes
    -----
    The state holds the slip positions (where each element would be free of force), shape (..., n).
    """

    slips: ClassVar[bool] = True

    spring: float
    stiffnesses: tuple[float, ...]
    break_displacements: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "spring", floats("spring", (self.spring,))[0])
        object.__setattr__(self, "stiffnesses", floats("stiffnesses", self.stiffnesses))
        breaks = floats("break_displacements", self.break_displacements)
        object.__setattr__(self, "break_displacements", breaks)
        check_thresholds("break_displacements", breaks, len(self.stiffnesses), "stiffnesses")
        check_not_negative("stiffnesses", self.stiffnesses, "to dissipate and not create energy")
        check_not_negative("spring", (self.spring,), "to be a spring")

    @cached_property
    def parts(self) -> tuple[Array, Array, float]:
        """Break displacements, stiffnesses and spring."""
        return np.array(self.break_displacements), np.array(self.stiffnesses), self.spring

    @property
    def total_slope(self) -> float:
        """The stiffness where every element slips: that of large amplitudes."""
        return self.spring

    def scaled(self, width: float) -> "MaxwellSlip":
        """Return this model with its hysteresis ``width`` times as wide, 0 for the spring alone."""
        width = width_of(width)
        return replace(self, stiffnesses=tuple(width * k for k in self.stiffnesses))

    def _slopes(self) -> list[float]:
        """Return the slope of the initial loading curve before each slips, and after all."""
        if self.spring <= 0.0:
            raise ValueError(
                f"spring is {self.spring}; it must be above 0 for the model to have an inverse:"
                " a force beyond the sum of the break forces has no displacement otherwise"
            )
        slopes = [self.spring]  # summed from the softest up: no difference of large numbers
        pairs = zip(self.break_displacements, self.stiffnesses, strict=True)
        for displacement, stiffness in reversed(list(pairs)):
            slopes.append(slopes[-1] + (stiffness if displacement > 0.0 else 0.0))
        return slopes[::-1]

    def inverse(self) -> PlayOperator:
        """Return the play operator that undoes this model exactly (``spring`` must be above 0)."""
        slopes = self._slopes()
        weights, thresholds = _dual(self.break_displacements, self.stiffnesses, slopes)
        return PlayOperator(thresholds, weights, 1.0 / slopes[0])

    def inverse_state(self, state: ArrayLike) -> Array:
        """Return the inverse's state, shape (..., n), for a state that this model reached."""
        return _mirrored(state, self._slopes(), tuple(-k for k in self.stiffnesses))


def _dual(
    thresholds: tuple[float, ...], gains: tuple[float, ...], slopes: list[float]
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return gains and thresholds of the inverse: the initial loading curve, mirrored."""
    made, levels, x, y = [], [], 0.0, 0.0
    for i, (threshold, gain) in enumerate(zip(thresholds, gains, strict=True)):
        made.append((gain if threshold > 0.0 else 0.0) / (slopes[i] * slopes[i + 1]))
        y, x = y + slopes[i] * (threshold - x), threshold
        levels.append(y)
    return tuple(made), tuple(levels)


def _mirrored(state: ArrayLike, slopes: list[float], changes: tuple[float, ...]) -> Array:
    w = np.asarray(state, dtype=float)
    result = np.empty_like(w)
    rest = np.zeros(w.shape[:-1])
    for i in reversed(range(len(changes))):
        result[..., i] = slopes[i + 1] * w[..., i] + rest
        rest = rest + changes[i] * w[..., i]
    return result
