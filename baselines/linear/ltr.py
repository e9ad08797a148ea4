"""Loop transfer recovery: design of a feedback controller for a linear plant (athans1986).

The plant is augmented with an integrator at its input. Its filter loop is shaped to ``b / s``, an
integrator of bandwidth ``b``, and a linear-quadratic regulator with a small weight on the control
recovers that loop. With the state ``[u, x]``, ``du/dt = v``,

    filter gain    H = b [-1/g, A^-1 B/g],   g = C A^-1 B   (then C_a Phi H = b / s exactly)
    regulator      min integral of y^2 + rho v^2
    controller     K(s) = (1/s) F (s I - A_a + B_a F + H C_a)^-1 H

Its zeros are the poles of the plant. Recovery needs a plant without zeros in the right half-plane.
The bandwidth ``b`` is ``1/sqrt(mu)`` of the literature, in **rad/s**.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from baselines.linear.systems import (
    Complex,
    DiscreteSystem,
    StateSpace,
    discrete,
    response,
    state_space,
    time_constant,
)
from pam_envs.arrays import Array
from pam_envs.identification.frequency import RationalFit

Response = Callable[[NDArray[np.float64]], Complex]
POINTS = 2001
"""Frequencies at which a loop is evaluated."""
INFINITE = 1e9
"""Least ratio of a zero to the fastest pole at which it is a zero at infinity, displaced by
rounding."""


@dataclass(frozen=True)
class LoopFigures:
    """Performance and robustness of a loop.

    Attributes
    ----------
    crossover : float
        Highest gain crossover frequency [rad/s].
    phase_margin : float
        Smallest of all crossovers [rad].
    delay_margin : float
        Delay [s] that makes the loop unstable.
    gain_margin : float
        Factor on the loop gain that makes it unstable; infinite if the phase never reaches -180.
    bandwidth : float
        Angular frequency [rad/s] at which the closed loop is 3 dB below its static gain.
    peak_sensitivity, peak_tracking : float
        Largest ``|1 / (1 + L)|`` and ``|L / (1 + L)|``.
    """

    crossover: float
    phase_margin: float
    delay_margin: float
    gain_margin: float
    bandwidth: float
    peak_sensitivity: float
    peak_tracking: float


@dataclass(frozen=True)
class LtrDesign:
    """A controller by loop transfer recovery, from reference less output, and its plant.

    The bandwidth is that of the target loop [rad/s], the control weight ``rho``, in units of the
    output squared per (control unit per second) squared.
    """

    plant: StateSpace
    controller: StateSpace
    bandwidth: float
    control_weight: float

    @cached_property
    def figures(self) -> LoopFigures:
        """Figures of the loop of plant and controller in continuous time."""
        return loop_figures(lambda w: response(self.plant, w) * response(self.controller, w))

    def discrete(self, period: float) -> DiscreteSystem:
        """Return the controller at a control period [s]."""
        return discrete(self.controller, period)

    def sampled_figures(self, period: float, delay: float = 0.0) -> LoopFigures:
        """Return the figures of the loop at a control period, with its hold and a delay [s]."""
        return sampled_figures(self.plant, self.discrete(period), delay)


def design_ltr(
    plant: "StateSpace | RationalFit", bandwidth: float, control_weight: float
) -> LtrDesign:
    """Return the controller of loop transfer recovery; see this module's page.

    Parameters
    ----------
    plant : control.StateSpace or RationalFit
        Strictly proper, stable, and without zeros in the right half-plane.
    bandwidth : float
        Bandwidth [rad/s] of the target loop.
    control_weight : float
        ``rho``: a smaller weight recovers the target further, with larger control action.

    Raises
    ------
    ValueError
        If the plant is not of this kind, or a number not above 0.
    """
    system = state_space(*plant.state_space()) if isinstance(plant, RationalFit) else plant
    _check(system, bandwidth, control_weight)
    time = time_constant(system)
    scaled = state_space(time * system.A, time * system.B, system.C)
    augmented = scaled * integrator()
    at_rest = np.linalg.solve(scaled.A, scaled.B[:, 0])
    h = np.append(-1.0, at_rest) / (scaled.C[0] @ at_rest) * (bandwidth * time)
    f = _regulator(augmented, control_weight / time**2, bandwidth * time)
    core = augmented.A - augmented.B @ f - np.outer(h, augmented.C[0])
    controller = integrator() * state_space(core / time, h / time, f / time)
    return LtrDesign(system, controller, bandwidth, control_weight)


def integrator(gain: float = 1.0) -> StateSpace:
    """Return ``gain / s``."""
    return state_space([[0.0]], [1.0], [gain])


def loop_figures(loop_response: Response, low: float = 1e-2, high: float = 1e4) -> LoopFigures:
    """Return the figures of a loop from its response to angular frequencies [rad/s].

    ``low`` and ``high`` [rad/s] limit the frequencies; ``low`` counts as static. The margins are
    those of python-control on the tabulated response. Its own frequency grid misses the crossover
    of a product of sampled systems (8.4 instead of 9.02 rad/s for the printed controller at 10 ms),
    and a delay has no state-space form.
    """
    import control

    grid = np.geomspace(low, high, POINTS)
    loop = loop_response(grid)
    closed = loop / (1.0 + loop)
    tabulated = control.frd(loop, grid, smooth=True)
    gains, phases, distances, _, crossings, _ = control.stability_margins(tabulated, returnall=True)
    if not len(crossings):
        raise ValueError(f"the loop gain does not fall through 1 up to {high} rad/s: widen high")
    margins = np.radians((phases + 180.0) % 360.0 - 180.0)
    sizes = np.abs(closed)
    target = float(sizes[0]) / math.sqrt(2.0)
    falls, bandwidth = np.flatnonzero((sizes[:-1] >= target) & (sizes[1:] < target)), math.inf
    for k in falls[:1]:
        share = (sizes[k] - target) / (sizes[k] - sizes[k + 1])
        bandwidth = float(grid[k] * (grid[k + 1] / grid[k]) ** share)
    return LoopFigures(
        crossover=float(np.max(crossings)),
        phase_margin=float(np.min(margins)),
        delay_margin=float(np.min(margins / crossings)),
        gain_margin=float(np.min(gains[gains > 1.0], initial=math.inf)),
        bandwidth=bandwidth,
        peak_sensitivity=1.0 / float(np.min(np.append(distances, np.abs(1.0 + loop)))),
        peak_tracking=float(np.max(sizes)),
    )


def sampled_figures(
    plant: StateSpace, controller: DiscreteSystem, delay: float = 0.0
) -> LoopFigures:
    """Return the figures of a sampled loop: plant behind a hold, and a delay [s]."""
    held = discrete(plant, controller.period, "zoh")

    def looped(w: NDArray[np.float64]) -> Complex:
        return np.asarray(held.response(w) * controller.response(w) * np.exp(-1j * w * delay))

    return loop_figures(looped, high=0.999 * math.pi / controller.period)


def closed_loop_poles(plant: StateSpace, controller: StateSpace) -> Complex:
    """Return the poles [rad/s] of unit negative feedback, in order of decreasing real part."""
    poles = (plant * controller).feedback().poles()
    return np.asarray(poles[np.argsort(-poles.real)], complex)


def _regulator(augmented: StateSpace, weight: float, frequency: float) -> Array:
    """Return the regulator's gain (1, n), checked by Kalman's return difference at a frequency."""
    import control

    a, b, c = augmented.A, augmented.B, augmented.C
    gain = np.asarray(control.lqr(a, b, c.T @ c, [[weight]], method="scipy")[0])
    state = np.linalg.solve(1j * frequency * np.eye(len(b)) - a, b)[:, 0]
    expected = 1.0 + abs(c[0] @ state) ** 2 / weight
    if not abs(abs(1.0 + gain[0] @ state) ** 2 / expected - 1.0) < 1e-2:
        raise ValueError(
            f"control_weight is {weight:.3g} in scaled time, too small for the arithmetic of the"
            " Riccati equation: raise it until the design succeeds"
        )
    return gain


def _check(plant: StateSpace, bandwidth: float, control_weight: float) -> None:
    for name, value in (("bandwidth", bandwidth), ("control_weight", control_weight)):
        if not value > 0.0:
            raise ValueError(f"{name} is {value}; it must be above 0: see the module's page")
    if plant.D[0, 0] != 0.0:
        raise ValueError(f"d is {plant.D[0, 0]}; the plant must be strictly proper: add a fast lag")
    slowest = float(np.max(plant.poles().real))
    if slowest >= 0.0:
        raise ValueError(
            f"a pole has real part {slowest}; it must be below 0 for a static gain: identify"
            " the plant about a stable operating point"
        )
    zeros = plant.zeros()
    finite = np.abs(zeros) < INFINITE * np.abs(plant.poles()).max()
    unstable = zeros[finite & (zeros.real > 0.0)]
    if unstable.size:
        raise ValueError(
            f"a zero is at {unstable[0]:.4g}; the loop can be recovered only with zeros in the left"
            " half-plane: fit with fewer poles, or with a higher relative_degree"
        )
