"""Single-input single-output linear systems: python-control, and sampled systems over rows.

Continuous systems are ``control.StateSpace`` objects: ``after * before`` is a series connection,
``system.feedback()`` closes a loop. Controllers run :class:`DiscreteSystem`, which advances many
rows at once. python-control is imported when a system is built: its import takes a second.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import matrix_balance

from pam_envs.arrays import Array

if TYPE_CHECKING:
    import control

StateSpace: TypeAlias = "control.StateSpace"
Complex = NDArray[np.complex128]
Method = Literal["bilinear", "zoh"]


def state_space(a: ArrayLike, b: ArrayLike, c: ArrayLike, d: float = 0.0) -> StateSpace:
    """Return ``dx/dt = a x + b u``, ``y = c x + d u`` for vectors ``b`` and ``c`` of shape (n,)."""
    import control

    return control.ss(a, np.reshape(b, (-1, 1)), np.reshape(c, (1, -1)), d)


def from_polynomials(numerator: ArrayLike, denominator: ArrayLike) -> StateSpace:
    """Return a proper system from its transfer function, highest power of ``s`` first.

    The companion form is built in time scaled by the geometric mean of the poles, and balanced.
    The plain companion form of python-control spans eleven decades for the printed controller of
    yeh2010 (order 9): its zeros are off by 12 % (here by 4e-13), and its discretisation meets a
    matrix with a reciprocal condition number of 5e-19.
    """
    import control

    top, low = (np.atleast_1d(np.asarray(p, float)) for p in (numerator, denominator))
    scale = _time_scale(low)
    scaled = (p * scale ** np.arange(len(p) - 1.0, -1.0, -1.0) for p in (top, low))
    form = control.ss(control.tf(*scaled), method="scipy")
    balanced, (sizes, _) = matrix_balance(form.A, permute=False, separate=True)
    return state_space(
        scale * balanced, scale * form.B[:, 0] / sizes, form.C[0] * sizes, form.D[0, 0]
    )


def from_roots(zeros: ArrayLike, poles: ArrayLike, static_gain: float) -> StateSpace:
    """Return a system from zeros and poles [rad/s] and the static gain (no pole at 0)."""
    top, low = (np.atleast_1d(np.poly(np.atleast_1d(roots))).real for roots in (zeros, poles))
    if low[-1] == 0.0:
        raise ValueError("a pole is at 0, so that the static gain has no bound: leave it out")
    return from_polynomials(top * (static_gain * low[-1] / top[-1]), low)


def double_lag(pole: float) -> StateSpace:
    """Return ``pole^2 / (s + pole)^2`` for a pole [rad/s]."""
    return state_space([[-pole, pole], [0.0, -pole]], [0.0, pole], [1.0, 0.0])


def time_constant(system: StateSpace) -> float:
    """Return the inverse geometric mean of the magnitudes of the poles [s]; no pole at 0."""
    return float(np.exp(-np.mean(np.log(np.abs(system.poles())))))


def response(system: StateSpace, frequency: ArrayLike) -> Complex:
    """Return the frequency response at angular frequencies [rad/s], of their shape.

    It uses a linear solve at each frequency: for the synthesised controller of order 12 it is exact
    to 6e-8, the Hessenberg form of python-control with SLICOT to 1.3e-5.
    """
    s = 1j * np.asarray(frequency, float)
    return _evaluated(system.A, system.B[:, 0], system.C[0], system.D[0, 0], s)


def discrete(system: StateSpace, period: float, method: Method = "bilinear") -> DiscreteSystem:
    """Return a system at a control period [s].

    ``"bilinear"`` (Tustin) keeps stability, and the phase to a tenth of the sampling frequency: the
    choice for controllers. ``"zoh"`` is exact for an input that is held over the period: the choice
    for plants.
    """
    if not period > 0.0:
        raise ValueError(f"period is {period}; it must be above 0: give it in seconds")
    sampled = system.sample(period, method)
    return DiscreteSystem(
        sampled.A, sampled.B[:, 0], sampled.C[0], np.asarray(sampled.D[0, 0]), period
    )


def delayed(system: StateSpace, dead_time: float, period: float) -> DiscreteSystem:
    """Return a strictly proper system behind a dead time [s] at a control period [s].

    Exact for an input that is held over the period, which the last states hold.
    """
    n = math.ceil(dead_time / period - 1e-9)
    if n <= 0:
        return discrete(system, period, "zoh")
    late = period - max(0.0, n * period - dead_time)  # for which the older input acts
    older, newer = (
        system.sample(span, "zoh") if span > 0.0 else None for span in (late, period - late)
    )
    after = np.eye(system.nstates) if newer is None else newer.A
    size = system.nstates + n
    a, b = np.zeros((size, size)), np.zeros(size)
    a[:-n, :-n] = after @ older.A  # type: ignore[union-attr]
    a[:-n, -n] = (after @ older.B)[:, 0]  # type: ignore[union-attr]
    a[-n:-1, size - n + 1 :] = np.eye(n - 1)
    b[-1] = 1.0
    if newer is not None and n > 1:
        a[:-n, -n + 1] = newer.B[:, 0]
    elif newer is not None:
        b[:-n] = newer.B[:, 0]
    return DiscreteSystem(a, b, np.append(system.C[0], np.zeros(n)), np.array(0.0), period)


@dataclass(frozen=True)
class DiscreteSystem:
    """Systems ``x' = a x + b u``, ``y = c x + d u`` at a fixed period, one for each lane.

    A single system has no lane axis (``lanes`` is empty); the systems of all joints of an arm have
    one: ``a`` is of shape ``(*lanes, n, n)``, ``b`` and ``c`` of ``(*lanes, n)``, ``d`` of lanes.
    Inputs and outputs are of shape ``(..., *lanes)``, states of ``(..., *lanes, n)``. The period is
    in s.
    """

    a: Array
    b: Array
    c: Array
    d: Array
    period: float

    @classmethod
    def stacked(cls, systems: Sequence[DiscreteSystem]) -> DiscreteSystem:
        """Return systems of one order and period as lanes of one."""
        a, b, c, d = (np.array([getattr(s, name) for s in systems]) for name in "abcd")
        return cls(a, b, c, d, systems[0].period)

    @classmethod
    def identity(cls, lanes: int, period: float) -> DiscreteSystem:
        """Return lanes without states whose output is their input."""
        none = np.zeros((lanes, 0))
        return cls(none[..., None], none, none, np.ones(lanes), period)

    def scaled(self, inputs: float = 1.0, outputs: float = 1.0) -> DiscreteSystem:
        """Return the system with factors on its input and output, the states unchanged."""
        return replace(self, b=inputs * self.b, c=outputs * self.c, d=inputs * outputs * self.d)

    def initial_state(self, rows: int | Sequence[int] = ()) -> Array:
        """Return zeros of shape ``(*rows, *lanes, n)``."""
        shape = (rows,) if isinstance(rows, int) else tuple(rows)
        return np.zeros((*shape, *self.b.shape))

    def rest_state(self, u: ArrayLike) -> Array:
        """Return the equilibrium, shape ``(..., *lanes, n)``, under a constant input."""
        gain = np.linalg.solve(np.eye(self.b.shape[-1]) - self.a, self.b[..., None])[..., 0]
        return np.asarray(np.asarray(u, float)[..., None] * gain)

    def holding_state(self, y: ArrayLike) -> Array:
        """Return the state, shape ``(..., *lanes, n)``, that holds an output without input.

        For systems with one integrator, whose mode provides the whole output.
        """
        mode = np.linalg.svd(self.a - np.eye(self.b.shape[-1]))[2][..., -1, :]
        gain = mode / np.sum(mode * self.c, axis=-1)[..., None]
        return np.asarray(np.asarray(y, float)[..., None] * gain)

    def step(self, u: ArrayLike, state: Array) -> tuple[Array, Array]:
        """Return the output and the next state for an input."""
        return self.output(u, state), self.advance(u, state)

    def output(self, u: ArrayLike, state: Array) -> Array:
        """Return the output, shape ``(..., *lanes)``."""
        return np.asarray(np.add.reduce(state * self.c, axis=-1) + self.d * np.asarray(u, float))

    def advance(self, u: ArrayLike, state: Array) -> Array:
        """Return the next state, shape ``(..., *lanes, n)``."""
        free = np.add.reduce(self.a * state[..., None, :], axis=-1)
        return np.asarray(free + np.asarray(u, float)[..., None] * self.b)

    def response(self, frequency: ArrayLike) -> Complex:
        """Return the frequency response [rad/s] of a single system."""
        z = np.exp(1j * np.asarray(frequency, float) * self.period)
        return _evaluated(self.a, self.b, self.c, self.d, z)


def _evaluated(a: Array, b: Array, c: Array, d: Array | float, points: Complex) -> Complex:
    """Return ``c (p - a)^-1 b + d`` at points ``p``, in the shape of ``p``."""
    gap = points[..., None, None] * np.eye(len(b)) - a
    states = np.linalg.solve(gap, np.broadcast_to(b[:, None], (*points.shape, len(b), 1)))
    return np.asarray(states[..., 0] @ c + d)


def _time_scale(denominator: Array) -> float:
    """Return the geometric mean of the magnitudes of the poles that are not at 0 [rad/s], or 1."""
    poles = np.abs(np.roots(denominator))
    poles = poles[poles > 1e-12 * max(1.0, float(np.max(poles, initial=0.0)))]
    return float(np.exp(np.mean(np.log(poles)))) if poles.size else 1.0
