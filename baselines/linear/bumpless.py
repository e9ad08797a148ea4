"""Bumpless transfer and anti-windup by a parallel plant model for each controller.

An off-line controller would integrate an error that it cannot affect. Its compensator runs a model
of the plant, driven by the difference between the applied command ``u`` and the controller's own
output ``u_c``:

    dxi/dt = A xi + B (u - u_c),   v_1 = K xi + L (u - u_c),   v_2 = C xi

``v_2`` is subtracted from the measurement: the controller sees the output that its own command
would have given, a fictitious loop that stays settled on the reference. ``v_1`` is added to its
output, so that the active controller gives ``u = sat(u_c + v_1)``. The same applies while the
command is limited. With one input the algebraic loop through ``L`` has the solution
``u = sat(u_c + F xi)`` with ``F = K / (1 - L)``: apart from this factor ``L`` has no effect.

The gains follow from a linear matrix inequality, the circle criterion for the saturation. With
``Q, U > 0``, ``X1 = F Q``, ``X2 = E U``, ``L = E / (1 + E)``, ``K = F (1 - L)``,

    [A Q + Q A' + B X1 + X1' B' + 2 alpha Q,  -B (U + X2) + X1'; *,  -2 (U + X2)] < 0

guarantees that ``xi`` decays at least at the rate ``alpha``. No ``alpha`` above the decay rate of
the slowest pole of the plant is feasible. Only ``U + X2`` enters: ``L`` may be any number below 1.
The chosen ``F`` has the largest distance from the bound, less a small penalty on its size: for a
stable, well-damped plant it is close to 0, which satisfies the inequality as well.

References
----------
zaccarian2002 for the structure; yeh2010, section 4.2.
"""

import warnings
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import cdf2rdf

from baselines.linear.systems import DiscreteSystem, StateSpace, delayed, discrete, time_constant
from pam_envs.arrays import Array

SMALLEST = 1e-7
"""Distance from the inequality's bound that counts as feasible."""
PENALTY = 1e-2
"""Penalty of the distance from the bound per unit of state feedback."""
ROUNDING = 1e-12
"""Difference of own and applied command that counts as rounding, relative to the range."""


@dataclass(frozen=True)
class BumplessGains:
    """Gains ``K``, shape ``(*lanes, n)``, in the coordinates of the plant, and ``L``, below 1."""

    state_gain: Array
    direct_gain: float = 0.0

    def __post_init__(self) -> None:
        if not self.direct_gain < 1.0:
            raise ValueError(
                f"direct_gain is {self.direct_gain}; it must be below 1 for the command to have"
                " one value: use 0, which has the same effect"
            )

    @property
    def feedback(self) -> Array:
        """``F = K / (1 - L)``, the gain on the command."""
        return self.state_gain / (1.0 - self.direct_gain)


class BumplessState(NamedTuple):
    """States of a controller and of its plant model, ``xi``, shapes ``(..., *lanes, n)``."""

    controller: Array
    model: Array


@dataclass(frozen=True)
class Bumpless:
    """A linear controller with bumpless transfer and anti-windup.

    At every control instant apply :meth:`output` of the active controller, and :meth:`advance`
    *every* controller with the applied command.

    Attributes
    ----------
    controller, model : DiscreteSystem
        From reference less measurement to command; the plant at the same period, strictly proper.
    compensated : bool
        Whether the compensator is active. Without it the controller sees the measurement itself,
        and when active it clamps against windup: an error that would drive a limited command
        further is replaced by 0. Both forms then differ only in the transfer.
    """

    controller: DiscreteSystem
    model: DiscreteSystem
    gains: BumplessGains
    low: float
    high: float
    compensated: bool = True

    def __post_init__(self) -> None:
        if self.controller.period != self.model.period:
            raise ValueError(
                f"the controller's period is {self.controller.period} and the model's"
                f" {self.model.period}; they must be equal: make both discrete at one period"
            )
        if not self.low < self.high:
            raise ValueError(f"low is {self.low} and high {self.high}; low must be below: swap")

    def without(self) -> "Bumpless":
        """Return this controller with clamping instead of its compensator."""
        return replace(self, compensated=False)

    def initial_state(self, rows: int | tuple[int, ...] = ()) -> BumplessState:
        """Return the state at rest, arrays of shape ``(*rows, *lanes, n)``."""
        return BumplessState(self.controller.initial_state(rows), self.model.initial_state(rows))

    def holding_state(self, command: Array) -> BumplessState:
        """Return the state that holds a command, ``(..., *lanes)``, while the error is 0."""
        model = np.zeros((*command.shape, self.model.b.shape[-1]))
        return BumplessState(self.controller.holding_state(command), model)

    def output(
        self,
        reference: ArrayLike,
        measured: ArrayLike,
        state: BumplessState,
        low: ArrayLike | None = None,
        high: ArrayLike | None = None,
    ) -> Array:
        """Return the command of the active controller, shape ``(..., *lanes)``, within the limits.

        ``low`` and ``high`` are limits at this instant, if a feedforward uses part of the range.
        """
        command = self.controller.output(self._error(reference, measured, state), state.controller)
        if self.compensated:
            command = command + np.add.reduce(state.model * self.gains.feedback, axis=-1)
        low, high = self.low if low is None else low, self.high if high is None else high
        return np.asarray(np.minimum(np.maximum(command, low), high))

    def advance(
        self,
        reference: ArrayLike,
        measured: ArrayLike,
        applied: ArrayLike,
        state: BumplessState,
        in_charge: ArrayLike = False,
    ) -> BumplessState:
        """Return the state after a period with the command ``applied``, shape ``(..., *lanes)``.

        With a feedforward behind this controller, ``applied`` is the applied command less this
        controller's own feedforward. ``in_charge``, shape (...), marks rows in which this
        controller was active; it is used only for clamping, without the compensator.
        """
        error = self._error(reference, measured, state)
        own, after = self.controller.step(error, state.controller)
        difference = np.asarray(applied, float) - own
        if self.compensated:
            return BumplessState(after, self.model.advance(difference, state.model))
        further = np.asarray(in_charge, bool) & (self.sign * difference * error < 0.0)
        limited = further & (np.abs(difference) > ROUNDING * (self.high - self.low))
        _, after = self.controller.step(np.where(limited, 0.0, error), state.controller)
        return BumplessState(after, state.model)

    @cached_property
    def sign(self) -> float:
        """Sign of the model's static gain."""
        return float(np.sign(np.sum(self.model.rest_state(1.0) * self.model.c)))

    def _error(self, reference: ArrayLike, measured: ArrayLike, state: BumplessState) -> Array:
        error = np.asarray(reference, float) - np.asarray(measured, float)
        return error + self.model.output(0.0, state.model) if self.compensated else error


def make_bumpless(
    plant: StateSpace,
    controller: StateSpace,
    period: float,
    low: float,
    high: float,
    gains: BumplessGains | None = None,
    dead_time: float = 0.0,
) -> Bumpless:
    """Return a controller with its compensator at a control period [s].

    The controller is made discrete by the bilinear rule, the plant with its hold and behind a dead
    time [s]. The default gains are those of :func:`design_bumpless`.
    """
    chosen = design_bumpless(plant) if gains is None else gains
    model = delayed(plant, dead_time, period)
    waiting = np.zeros(model.b.shape[-1] - plant.nstates)
    chosen = replace(chosen, state_gain=np.append(chosen.state_gain, waiting))
    return Bumpless(discrete(controller, period), model, chosen, low, high)


def design_bumpless(plant: StateSpace, decay: float = 0.0) -> BumplessGains:
    """Return the compensator's gains from the matrix inequality (needs ``cvxpy``).

    Parameters
    ----------
    plant : control.StateSpace
        Stable and strictly proper.
    decay : float
        ``alpha`` [1/s].

    Raises
    ------
    ValueError
        If there is no such compensator; the message names the bound on ``decay``.
    """
    import cvxpy as cp

    modes, n = _modes(plant), plant.nstates
    q, v, x = cp.Variable((n, n), symmetric=True), cp.Variable(), cp.Variable((1, n))
    margin = _best_margin(modes, decay, q, v, x, x.T - v * modes.b, PENALTY * cp.norm(x))
    if not margin > SMALLEST:
        raise ValueError(
            f"decay is {decay}; it must be below {_slowest(plant):.4g}, the decay rate of the"
            " plant's slowest pole, as no compensator is faster from every state: lower it"
        )
    gain = np.linalg.solve(q.value, x.value[0])
    return BumplessGains(np.asarray(np.linalg.solve(modes.basis.T, gain), float))


def certificate(plant: StateSpace, gains: BumplessGains, decay: float = 0.0) -> float:
    """Return the distance of gains from the inequality's bound: above 0 if they satisfy it.

    It is the largest distance of the eigenvalues from 0 over all ``Q`` and ``U`` up to 1, at the
    rate ``decay``, ``alpha`` [1/s].
    """
    import cvxpy as cp

    modes, n = _modes(plant), plant.nstates
    f = (gains.feedback @ modes.basis)[None, :]
    q, u = cp.Variable((n, n), symmetric=True), cp.Variable()
    return _best_margin(modes, decay, q, u, f @ q, q @ f.T - modes.b * u)


class _Modes(NamedTuple):
    """Real modal coordinates ``z``, ``x = basis z``, in time over ``time`` [s]."""

    a: Array
    b: Array
    basis: Array
    time: float


def _modes(plant: StateSpace) -> _Modes:
    if _slowest(plant) <= 0.0:
        raise ValueError(
            f"a pole has real part {-_slowest(plant):.4g}; the plant must be stable for its model"
            " to run beside the controller: close an inner loop first"
        )
    time = time_constant(plant)
    a, basis = cdf2rdf(*np.linalg.eig(plant.A * time))
    b = np.linalg.solve(basis, plant.B[:, 0] * time)
    sizes = np.abs(b)
    for k in np.flatnonzero(np.diag(a, 1)):  # both of a conjugate pair share one scale
        sizes[k : k + 2] = np.hypot(b[k], b[k + 1])
    return _Modes(a, (b / sizes)[:, None], basis * sizes, time)


def _slowest(plant: StateSpace) -> float:
    return float(-np.max(plant.poles().real))


def _best_margin(
    modes: _Modes, decay: float, q: Any, u: Any, x: Any, side: Any, penalty: Any = 0.0
) -> float:
    """Return the largest distance of the inequality from its bound, 0 or below if infeasible.

    ``x`` is ``X1``, and ``u`` is ``U + X2``.
    """
    import cvxpy as cp

    n, margin, last = q.shape[0], cp.Variable(), -2.0 * u
    drift = modes.a @ q + modes.b @ x
    corner = drift + drift.T + 2.0 * decay * modes.time * q
    whole = cp.bmat([[corner, side], [side.T, cp.reshape(last, (1, 1), order="C")]])
    bounds = [whole << -margin * np.eye(n + 1), q >> margin * np.eye(n), u >= margin]
    problem = cp.Problem(cp.Maximize(margin - penalty), [*bounds, q << np.eye(n), u <= 1.0])
    with warnings.catch_warnings():  # the eigenvalues of the solution are checked below
        warnings.filterwarnings("ignore", "Solution may be inaccurate", UserWarning)
        problem.solve(solver=cp.CLARABEL)
    if whole.value is None:
        return -np.inf
    found = np.linalg.eigvalsh(whole.value)[-1], np.linalg.eigvalsh(q.value)[0]
    return float(min(-found[0], found[1], u.value))
