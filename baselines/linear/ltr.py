"""Loop transfer recovery: a feedback controller from an identified linear plant.

The plant is augmented with an integrator at its input. Its filter loop is shaped to ``b / s``, an
integrator of bandwidth ``b``, and a linear-quadratic regulator with a small weight on the control
recovers that loop (M. Athans, "A tutorial on the LQG/LTR method", American Control Conference
1986). With the state ``[u, x]``, ``du/dt = v``,

    filter gain    H = b [-1/g, A^-1 B/g],   g = C A^-1 B   (then C_a Phi H = b / s exactly)
    regulator      min integral of y^2 + rho v^2
    controller     K(s) = (1/s) F (s I - A_a + B_a F + H C_a)^-1 H

Its zeros are the poles of the plant. Recovery needs a plant without zeros in the right half-plane;
``1/sqrt(mu)`` in the literature is the bandwidth ``b``, in **rad/s**.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_are
from scipy.optimize import brentq, minimize_scalar

from baselines.core.controller import Array
from baselines.linear.systems import Complex, DiscreteSystem, LinearSystem, Method
from pam_envs.identification.frequency import RationalFit

Response = Callable[[NDArray[np.float64]], Complex]


@dataclass(frozen=True)
class LoopFigures:
    """What a loop can do and what it can stand.

    Attributes
    ----------
    crossover : float
        Angular frequency [rad/s] at which the loop gain falls through 1 last.
    phase_margin : float
        [rad], the smallest of all crossings.
    delay_margin : float
        Delay [s] that makes the loop unstable.
    gain_margin : float
        Factor on the loop gain that makes it unstable; infinite if the phase never reaches -180.
    bandwidth : float
        Angular frequency [rad/s] at which the closed loop is 3 dB below its gain at rest.
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
    """A controller and the loop that it closes.

    Attributes
    ----------
    plant, controller : LinearSystem
        The controller acts on reference less output.
    bandwidth : float
        Of the target loop [rad/s].
    control_weight : float
        ``rho``, in units of the output squared per (control unit per second) squared.
    """

    plant: LinearSystem
    controller: LinearSystem
    bandwidth: float
    control_weight: float

    @cached_property
    def figures(self) -> LoopFigures:
        """Figures of the loop of plant and controller in continuous time."""
        return loop_figures(_product(self.plant, self.controller))

    def discrete(self, period: float, method: Method = "bilinear") -> DiscreteSystem:
        """Return the controller at a control period [s]; bilinear unless asked otherwise."""
        return self.controller.discrete(period, method)

    def sampled_figures(
        self, period: float, delay: float = 0.0, method: Method = "bilinear"
    ) -> LoopFigures:
        """Return the figures of the loop at a control period, its hold and a delay [s] included."""
        return sampled_figures(self.plant, self.discrete(period, method), delay)


def design_ltr(
    plant: LinearSystem | RationalFit, bandwidth: float, control_weight: float
) -> LtrDesign:
    """Return the controller of loop transfer recovery; see this module's page.

    Parameters
    ----------
    plant : LinearSystem or RationalFit
        Strictly proper, with a gain at rest, and without zeros in the right half-plane.
    bandwidth : float
        ``1/sqrt(mu)``, bandwidth [rad/s] of the target loop.
    control_weight : float
        ``rho``: smaller recovers the target further, with larger control action.

    Raises
    ------
    ValueError
        If the plant is not of this kind, or a number not above 0.
    """
    system = plant_system(plant)
    _check(system, bandwidth, control_weight)
    n = system.order
    scale = float(np.exp(np.mean(np.log(np.abs(system.poles)))))
    a, b = system.a / scale, system.b / scale
    a_aug = np.block([[np.zeros((1, 1)), np.zeros((1, n))], [b[:, None], a]])
    b_aug, c_aug = np.eye(n + 1)[0], np.concatenate([[0.0], system.c])
    at_rest = np.linalg.solve(a, b)
    gain = system.c @ at_rest
    h = np.concatenate([[-1.0], at_rest]) / gain * (bandwidth / scale)
    f = _regulator(a_aug, b_aug, c_aug, control_weight * scale**2, bandwidth / scale)
    core = a_aug - np.outer(b_aug, f) - np.outer(h, c_aug)
    controller = _with_integrator(scale * core, scale * h, scale * f)
    return LtrDesign(system, controller, bandwidth, control_weight)


def plant_system(plant: LinearSystem | RationalFit) -> LinearSystem:
    """Return an identified plant as a linear system."""
    if isinstance(plant, RationalFit):
        return LinearSystem(*plant.state_space())
    return plant


def loop_figures(response: Response, low: float = 1e-2, high: float = 1e4) -> LoopFigures:
    """Return the figures of a loop from its response to angular frequencies [rad/s].

    Parameters
    ----------
    response : callable
        From frequencies, shape (n,), to the loop's complex response.
    low, high : float
        Frequencies [rad/s] between which to look; ``low`` counts as rest.
    """
    grid = np.geomspace(low, high, 6001)
    loop = response(grid)
    closed = loop / (1.0 + loop)
    crossings = _falls(grid, lambda w: abs(_at(response, w)) - 1.0, np.abs(loop) - 1.0)
    if not crossings:
        raise ValueError(f"the loop gain does not fall through 1 up to {high} rad/s: widen high")
    margins = [math.pi + _phase(grid, loop, w) for w in crossings]
    target = abs(closed[0]) / math.sqrt(2.0)

    def excess(w: float) -> float:
        value = _at(response, w)
        return abs(value / (1.0 + value)) - target

    bands = _falls(grid, excess, np.abs(closed) - target)
    return LoopFigures(
        crossover=crossings[-1],
        phase_margin=min(margins),
        delay_margin=min(m / w for m, w in zip(margins, crossings, strict=True)),
        gain_margin=_gain_margin(grid, loop, response),
        bandwidth=bands[0] if bands else math.inf,
        peak_sensitivity=_peak(grid, lambda z: 1.0 / (1.0 + z), response),
        peak_tracking=_peak(grid, lambda z: z / (1.0 + z), response),
    )


def sampled_figures(
    plant: LinearSystem, controller: DiscreteSystem, delay: float = 0.0
) -> LoopFigures:
    """Return the figures of a sampled loop: plant behind a hold, and a delay [s]."""
    held = plant.discrete(controller.period, "zoh")

    def response(w: NDArray[np.float64]) -> Complex:
        return np.asarray(held.response(w) * controller.response(w) * np.exp(-1j * w * delay))

    return loop_figures(response, high=0.999 * math.pi / controller.period)


def _product(plant: LinearSystem, controller: LinearSystem) -> Response:
    return lambda w: np.asarray(plant.response(w) * controller.response(w))


def closed_loop_poles(plant: LinearSystem, controller: LinearSystem) -> Complex:
    """Return the poles [rad/s] of unit negative feedback, the slowest to decay first."""
    loop = controller.series(plant)
    values = np.linalg.eigvals(loop.a - np.outer(loop.b, loop.c)).astype(complex)
    return values[np.argsort(-values.real)]


def _regulator(a: Array, b: Array, c: Array, weight: float, frequency: float) -> Array:
    """Return the regulator's gain, checked by Kalman's return difference at a frequency."""
    x = solve_continuous_are(a, b[:, None], np.outer(c, c), np.array([[weight]]))
    gain = np.asarray(b @ x / weight)
    state = np.linalg.solve(1j * frequency * np.eye(len(b)) - a, b)
    wanted = 1.0 + abs(c @ state) ** 2 / weight
    if not abs(abs(1.0 + gain @ state) ** 2 / wanted - 1.0) < 1e-2:
        raise ValueError(
            f"control_weight is {weight:.3g} in scaled time, too small for the arithmetic of the"
            " Riccati equation: raise it until the design succeeds"
        )
    return gain


def _with_integrator(a: Array, b: Array, c: Array) -> LinearSystem:
    """Return ``(1/s) c (s - a)^-1 b``."""
    n = len(b)
    whole = np.block([[a, np.zeros((n, 1))], [c[None, :], np.zeros((1, 1))]])
    return LinearSystem(whole, np.concatenate([b, [0.0]]), np.eye(n + 1)[n])


def _check(plant: LinearSystem, bandwidth: float, control_weight: float) -> None:
    for name, value in (("bandwidth", bandwidth), ("control_weight", control_weight)):
        if not value > 0.0:
            raise ValueError(f"{name} is {value}; it must be above 0: see the module's page")
    if plant.d != 0.0:
        raise ValueError(f"d is {plant.d}; the plant must be strictly proper: add its fast lag")
    slowest = float(np.max(plant.poles.real))
    if slowest >= 0.0:
        raise ValueError(
            f"a pole has real part {slowest}; it must be below 0 for a gain at rest: identify"
            " the plant about a stable operating point"
        )
    wrong = plant.zeros[plant.zeros.real > 0.0]
    if wrong.size:
        raise ValueError(
            f"a zero lies at {wrong[0]:.4g}; the loop can be recovered only with zeros in the left"
            " half-plane: fit with fewer poles, or with a higher relative_degree"
        )


def _at(response: Response, w: float) -> complex:
    return complex(response(np.array([w]))[0])


def _falls(grid: Array, function: Callable[[float], float], values: Array) -> list[float]:
    """Return where a function known on a grid falls through 0."""
    found = np.flatnonzero((values[:-1] >= 0.0) & (values[1:] < 0.0))
    return [float(brentq(function, grid[i], grid[i + 1], xtol=1e-12)) for i in found]


def _phase(grid: Array, loop: Complex, w: float) -> float:
    """Return the unwrapped phase [rad] at a frequency, counted from that at rest."""
    return float(np.interp(w, grid, np.unwrap(np.angle(loop))))


def _gain_margin(grid: Array, loop: Complex, response: Response) -> float:
    turned = np.unwrap(np.angle(loop)) + math.pi
    points = _falls(grid, lambda w: float(np.interp(w, grid, turned)), turned)
    gains = [1.0 / abs(_at(response, w)) for w in points]
    return min((g for g in gains if g > 1.0), default=math.inf)


def _peak(grid: Array, shape: Callable[[Complex], Complex], response: Response) -> float:
    sizes = np.abs(shape(response(grid)))
    k = int(np.clip(np.argmax(sizes), 1, len(grid) - 2))
    bounds = (math.log(grid[k - 1]), math.log(grid[k + 1]))
    best = minimize_scalar(
        lambda x: -abs(shape(response(np.array([math.exp(x)])))[0]), bounds=bounds, method="bounded"
    )
    return max(float(-best.fun), float(sizes[k]))
