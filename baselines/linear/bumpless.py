"""Switching between controllers without a bump, by a model of the plant beside each of them.

A controller that is not in charge would integrate an error that it cannot change. Its compensator
runs the plant's model on the difference between the command ``u`` that was applied and the
controller's own output ``u_c``:

    dxi/dt = A xi + B (u - u_c),   v_1 = K xi + L (u - u_c),   v_2 = C xi

``v_2`` is taken off the measurement, so that the controller sees the output that its own command
would have given: a fictitious loop of its own, which stays settled on the reference. ``v_1`` is
added to its output, so that in charge ``u = sat(u_c + v_1)``. The same holds while the command is
limited. With one input the algebraic loop through ``L`` has the solution ``u = sat(u_c + F xi)``
with ``F = K / (1 - L)``: apart from this factor ``L`` has no effect.

The gains come from a linear matrix inequality: the circle criterion for the saturation, with
``Q, U > 0``, ``X1 = F Q``, ``X2 = E U``, ``L = E / (1 + E)``, ``K = F (1 - L)``,

    [A Q + Q A' + B X1 + X1' B' + 2 alpha Q,  -B (U + X2) + X1'; *,  -2 (U + X2)] < 0

guarantees that ``xi`` dies out at the rate ``alpha`` at least. No ``alpha`` above the decay rate
of the plant's slowest pole is feasible. Only ``U + X2`` enters: ``L`` may be any number below 1.
Of all ``F`` that with the largest distance from the bound is taken, less a small price on its own
size: for a stable plant that is well damped it comes out next to 0, and the fictitious loop does
the work.

References
----------
L. Zaccarian, A. R. Teel, "A common framework for anti-windup, bumpless transfer and reliable
designs", Automatica 38 (2002), for the structure; yeh2010, section 4.2.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import cdf2rdf

from baselines.core.controller import Array
from baselines.linear.systems import DiscreteSystem, LinearSystem

SMALLEST = 1e-7
"""Distance from the inequality's bound that counts as being inside."""

PRICE = 1e-2
"""Distance from the bound that a unit of state feedback has to earn."""


LIMITED = 1e-9
"""Difference between a command and what was applied that is more than rounding."""


@dataclass(frozen=True)
class BumplessGains:
    """Gains of a compensator.

    Attributes
    ----------
    state_gain : ndarray, shape (n,)
        ``K`` in the coordinates of the plant that they were designed for.
    direct_gain : float
        ``L``, below 1.
    """

    state_gain: Array
    direct_gain: float = 0.0

    def __post_init__(self) -> None:
        if not self.direct_gain < 1.0:
            raise ValueError(
                f"direct_gain is {self.direct_gain}; it must be below 1 for the command to have"
                " one value: 0 is as good as any"
            )

    @property
    def feedback(self) -> Array:
        """``F = K / (1 - L)``, what acts on the command."""
        return self.state_gain / (1.0 - self.direct_gain)


class BumplessState(NamedTuple):
    """Hysteresis of a controller with its compensator.

    Attributes
    ----------
    controller : ndarray, shape (..., n_controller)
    model : ndarray, shape (..., n_plant)
        ``xi``.
    """

    controller: Array
    model: Array


@dataclass(frozen=True)
class Bumpless:
    """A linear controller that may be switched on and off, and limited, without a bump.

    At every control instant ask the controller in charge for :meth:`output`, apply it, and let
    *every* controller :meth:`advance` with what was applied.

    Attributes
    ----------
    controller : DiscreteSystem
        From reference less measurement to command.
    model : DiscreteSystem
        The plant at the same period, strictly proper.
    gains : BumplessGains
        In the coordinates of ``model``.
    low, high : float
        Limits of the command.
    compensated : bool
        Whether the compensator acts; without it the controller sees the measurement as it is, and
        in charge it has plain clamping against windup: no error that would drive a limited command
        further reaches it. So with and without differ in the hand-over alone.
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

    def without(self) -> Bumpless:
        """Return this controller without its compensator, with clamping in its place."""
        return replace(self, compensated=False)

    def initial_state(self, rows: int | tuple[int, ...] = ()) -> BumplessState:
        """Return the state at rest, arrays of shape (*rows, ...)."""
        return BumplessState(self.controller.initial_state(rows), self.model.initial_state(rows))

    def output(
        self,
        reference: ArrayLike,
        measured: ArrayLike,
        state: BumplessState,
        low: ArrayLike | None = None,
        high: ArrayLike | None = None,
    ) -> Array:
        """Return the command for a controller in charge, shape (...), within the limits.

        Parameters
        ----------
        reference, measured : array_like, shape (...)
        state : BumplessState
        low, high : array_like, optional
            Limits at this instant, where a feed-forward takes a part of the range.
        """
        wanted = self._wanted(reference, measured, state)
        if self.compensated:
            wanted = wanted + np.einsum("...i,i->...", state.model, self.gains.feedback)
        low, high = self.low if low is None else low, self.high if high is None else high
        return np.asarray(np.minimum(np.maximum(wanted, low), high))

    def advance(
        self,
        reference: ArrayLike,
        measured: ArrayLike,
        applied: ArrayLike,
        state: BumplessState,
        in_charge: ArrayLike = False,
    ) -> BumplessState:
        """Return the state after a period in which the command ``applied``, (...), acted.

        Where a feed-forward is added behind this controller, ``applied`` is what was applied less
        this controller's own feed-forward. ``in_charge``, (...), says whether it was its own
        command; that matters without the compensator alone, which has to know what was limited.
        """
        error = self._error(reference, measured, state)
        wanted, after = self.controller.step(error, state.controller)
        difference = np.asarray(applied, float) - wanted
        if self.compensated:
            return BumplessState(after, self.model.advance(difference, state.model))
        further = np.asarray(in_charge, bool) & (self._sign * difference * error < 0.0)
        limited = further & (np.abs(difference) > LIMITED)
        _, after = self.controller.step(np.where(limited, 0.0, error), state.controller)
        return BumplessState(after, state.model)

    @cached_property
    def _sign(self) -> float:
        """Sign of what a command does to the output, in the end."""
        a, b = self.model.a, self.model.b
        return float(np.sign(self.model.c @ np.linalg.solve(np.eye(len(b)) - a, b)))

    def _error(self, reference: ArrayLike, measured: ArrayLike, state: BumplessState) -> Array:
        error = np.asarray(reference, float) - np.asarray(measured, float)
        return (
            error + np.einsum("...i,i->...", state.model, self.model.c)
            if self.compensated
            else error
        )

    def _wanted(self, reference: ArrayLike, measured: ArrayLike, state: BumplessState) -> Array:
        return self.controller.output(self._error(reference, measured, state), state.controller)


def make_bumpless(
    plant: LinearSystem,
    controller: LinearSystem,
    period: float,
    low: float,
    high: float,
    gains: BumplessGains | None = None,
) -> Bumpless:
    """Return a controller with its compensator at a control period [s].

    The controller is made discrete by the bilinear rule, the plant behind a hold. The gains are
    those of :func:`design_bumpless` unless others are given.
    """
    chosen = design_bumpless(plant) if gains is None else gains
    at_period = plant.discrete(period, "zoh")
    return Bumpless(controller.discrete(period), at_period, chosen, low, high)


def design_bumpless(plant: LinearSystem, decay: float = 0.0) -> BumplessGains:
    """Return the compensator's gains from the matrix inequality (needs ``cvxpy``).

    Parameters
    ----------
    plant : LinearSystem
        Stable and strictly proper.
    decay : float
        ``alpha`` [1/s].

    Raises
    ------
    ValueError
        If there is no such compensator; the message names the bound on ``decay``.
    """
    import cvxpy as cp

    modes = _modes(plant)
    n, b, rate = plant.order, modes.b[:, None], decay / modes.scale
    q, v, x = cp.Variable((n, n), symmetric=True), cp.Variable(), cp.Variable((1, n))
    drift = modes.a @ q + b @ x
    corner = drift + drift.T + 2.0 * rate * q
    margin = _best_margin(corner, x.T - v * b, -2.0 * v, q, v, PRICE * cp.norm(x))
    if not margin > SMALLEST:
        raise ValueError(
            f"decay is {decay}; it must be below {_slowest(plant):.4g}, the decay rate of the"
            " plant's slowest pole, as no compensator can be faster for every history: lower it"
        )
    gain = np.linalg.solve(q.value, x.value[0])
    return BumplessGains(np.linalg.solve(modes.basis.T, gain))


def certificate(plant: LinearSystem, gains: BumplessGains, decay: float = 0.0) -> float:
    """Return by how much given gains satisfy the inequality: above 0 if they do.

    Parameters
    ----------
    plant : LinearSystem
    gains : BumplessGains
        In the coordinates of ``plant``.
    decay : float
        ``alpha`` [1/s].

    Returns
    -------
    float
        Largest distance of the eigenvalues from 0 over all ``Q`` and ``U`` that are not above 1,
        in the coordinates of :func:`design_bumpless`.
    """
    import cvxpy as cp

    modes = _modes(plant)
    n, b, rate = plant.order, modes.b[:, None], decay / modes.scale
    f = (gains.feedback @ modes.basis)[None, :]
    q, u = cp.Variable((n, n), symmetric=True), cp.Variable()
    drift = (modes.a + b @ f) @ q
    corner = drift + drift.T + 2.0 * rate * q
    return _best_margin(corner, q @ f.T - b * u, -2.0 * u, q, u)


class _Modes(NamedTuple):
    a: Array
    b: Array
    basis: Array
    scale: float


def _modes(plant: LinearSystem) -> _Modes:
    """Return real modal coordinates ``z``, ``x = basis z``, of a stable plant."""
    if _slowest(plant) <= 0.0:
        raise ValueError(
            f"a pole has real part {-_slowest(plant):.4g}; the plant must be stable for its model"
            " to run beside it: close an inner loop first"
        )
    scale = float(np.exp(np.mean(np.log(np.abs(plant.poles)))))
    a, basis = cdf2rdf(*np.linalg.eig(plant.a / scale))
    b = np.linalg.solve(basis, plant.b / scale)
    sizes = np.abs(b)
    for k in np.flatnonzero(np.diag(a, 1)):  # the two of a pair share one size
        sizes[k : k + 2] = np.hypot(b[k], b[k + 1])
    return _Modes(a, b / sizes, basis * sizes, scale)


def _slowest(plant: LinearSystem) -> float:
    return float(-np.max(plant.poles.real))


def _joined(corner: Any, side: Any, last: Any) -> Any:
    import cvxpy as cp

    return cp.bmat([[corner, side], [side.T, cp.reshape(last, (1, 1), order="C")]])


def _best_margin(corner: Any, side: Any, last: Any, q: Any, u: Any, price: Any = 0.0) -> float:
    """Return the largest distance of the inequality from its bound, 0 or below if it has none."""
    import cvxpy as cp

    n, margin = q.shape[0], cp.Variable()
    whole = _joined(corner, side, last)
    bounds = [whole << -margin * np.eye(n + 1), q >> margin * np.eye(n), u >= margin]
    problem = cp.Problem(cp.Maximize(margin - price), [*bounds, q << np.eye(n), u <= 1.0])
    with warnings.catch_warnings():  # the solution is judged below by its own eigenvalues
        warnings.filterwarnings("ignore", "Solution may be inaccurate", UserWarning)
        problem.solve(solver=cp.CLARABEL)
    if whole.value is None:
        return -np.inf
    found = np.linalg.eigvalsh(whole.value)[-1], np.linalg.eigvalsh(q.value)[0]
    return float(min(-found[0], found[1], u.value))
