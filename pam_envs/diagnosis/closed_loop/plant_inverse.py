"""Controller from a plant: feedforward by inverse simulation and a PI feedback loop.

Feedforward: a copy of the plant runs in open loop, without measurements. In every control period a
fan of setpoint ramps from the last setpoint is simulated on further copies; the ramp that meets the
reference at the horizon is selected, and its first setpoint is applied, so that all effects of the
plant are compensated, with history and dead time. If the reference would later be out of reach of
the steepest ramp (a slow valve), that ramp starts at once.

Feedback: a PI controller acts on the difference between the reading and the simulated reading, so
that known delays and lags cause no feedback. Its gains are the best of a grid on the same plant,
with a fixed disturbance, scaling and delay of the setpoint as model error.

Horizons, grid, disturbances and seeds are the same for every plant.
"""

from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.plants.core.stepper import PlantStepper
from pam_envs.plants.single_muscle.plant import SingleMuscle

PREVIEW = 60  # preview of the reference [samples], with the present one
LEVELS = 15
SMALLEST, LARGEST = 5e-5, 1.0
"""Slopes of the fan [full pressures a period], geometric on both sides of the last slope."""
HORIZONS = (2, 3, 5, 8)
"""Candidate horizons: periods after the dead time at which a ramp meets the reference."""
REACHES = (10, 28)
"""Periods after it in which the reference is kept within reach, with the second horizon."""
SLIGHT = 2e-5  # distance out of reach that needs no early start [m]
PROPORTIONAL = (0.0, 0.25, 0.6, 1.0)
INTEGRAL = (0.0, 0.5, 1.0, 2.0, 3.5, 6.0, 10.0, 16.0)
"""Grid of the gains over full pressure per stroke: [1] and [1/s]."""
MISTAKES = ((1.2, 2), (0.85, 0), (1.0, 5))
"""Model errors while the loop is tuned: factor on the setpoint, delay [periods]."""
DISTURBANCE = 0.02
"""Amplitude of the pressure disturbance while the loop is tuned, over the full pressure."""
AUTHORITY = 0.4  # largest contribution of the integral over the full pressure
TUNING_TIME = 9.0
TUNING_SEED = 20_220_613
SHORTEST = 1e-6  # least stroke for the scale of the gains [m]


class Batch(Protocol):
    """Copies of a plant, each with its own setpoint."""

    position: Array

    def step(self, set_points: ArrayLike) -> tuple[Array, Array]:
        """Hold setpoints [Pa] for a period; return contractions [m] and pressures [Pa] read."""


class Rig(Protocol):
    """A rig, or a simulation of one, on which controllers run."""

    @property
    def position(self) -> float:
        """True contraction [m]."""

    def reset(self, seed: int | None = None) -> None:
        """Reset to rest without pressure and restart the noise; none without a seed."""

    def step(self, set_point: float) -> tuple[float, float]:
        """Hold a setpoint [Pa] for a period; return contraction [m] and pressure [Pa] read."""


class Simulated(Rig, Protocol):
    """A plant that a controller can simulate; see :class:`PlantStepper`."""

    period: float  # control period [s]
    max_pressure: float  # largest setpoint [Pa]
    noise: float  # RMS noise of the contraction reading [m]

    def try_ahead(self, set_points: ArrayLike, periods: int) -> Array:
        """Return future positions [m], shape (periods, m), under setpoints (m,), (periods, m)."""

    def batch(self, n: int) -> Batch:
        """Return ``n`` copies at rest, free of noise."""


class Controller(Protocol):
    """Stateful controller that :func:`~pam_envs.diagnosis.closed_loop.gain.closed_loop` runs."""

    def reset(self) -> None:
        """Reset, with the plant at rest without pressure."""

    def act(self, reference: Array, reading: float, pressure: float, load: float) -> float:
        """Return the setpoint [Pa] of the present period.

        ``reference`` (k,) is the desired contraction [m] now and in the following periods; the
        readings are of contraction [m] and pressure [Pa], the load is in kg.
        """


_SIDE = np.geomspace(SMALLEST, LARGEST, LEVELS)
FAN = np.concatenate([-_SIDE[::-1], [0.0], _SIDE])


def crossing(slopes: Array, errors: Array, middle: int) -> float:
    """Return the slope of least error: the zero crossing nearest to the middle, if any."""
    below = errors < 0.0
    turns = np.flatnonzero(below[1:] != below[:-1])
    if len(turns) == 0:
        size = np.abs(errors)
        equal = np.flatnonzero(size <= size.min() + 1e-9)
        return float(slopes[equal[np.argmin(np.abs(slopes[equal]))]])
    i = int(turns[np.argmin(np.abs(turns + 0.5 - middle))])
    a, b = errors[i], errors[i + 1]
    return float(slopes[i] + (slopes[i + 1] - slopes[i]) * a / (a - b))


class PlantInverse:
    """Feedforward by inverse simulation; :meth:`act` steps the internal plant.

    A setpoint ramp meets the reference after ``horizon`` periods; over ``look`` periods the
    reference is kept within reach. ``expected`` is the simulated contraction reading [m].
    """

    def __init__(self, model: Simulated, horizon: int, look: int = 0) -> None:
        self.model = model
        self.horizon = horizon
        self.look = max(horizon, look)
        self._steps = np.arange(1.0, self.look + 1.0)[:, None]
        self.reset()

    def reset(self) -> None:
        """Reset the internal plant to rest."""
        self.model.reset(None)
        self.set_point = self.slope = self.expected = 0.0

    def _in_time(self, reference: Array, paths: Array, slopes: Array, slope: float) -> float:
        """Return the steepest slope if a gentler one would miss the later reference."""
        later = reference[self.horizon + 1 : self.look + 1]
        if len(later) == 0:
            return slope
        reached = paths[self.horizon : self.horizon + len(later)]
        above = float(np.max(later - reached[:, -1]))
        below = float(np.max(reached[:, 0] - later))
        if max(above, below) <= SLIGHT:
            return slope
        return float(slopes[-1] if above > below else slopes[0])

    def act(self, reference: Array) -> float:
        """Return the setpoint [Pa] of this period and step the internal plant."""
        full = self.model.max_pressure
        slopes = self.slope + full * FAN
        plans = np.clip(self.set_point + self._steps * slopes, 0.0, full)
        aim = float(reference[min(self.horizon, len(reference) - 1)])
        paths = self.model.try_ahead(plans, self.look)
        slope = crossing(slopes, paths[self.horizon - 1] - aim, LEVELS)
        if self.look > self.horizon:
            slope = self._in_time(reference, paths, slopes, slope)
        desired = self.set_point + slope
        was, self.set_point = self.set_point, float(min(max(desired, 0.0), full))
        self.slope = self.set_point - was
        self.expected, _ = self.model.step(self.set_point)
        return self.set_point


class InversePi:
    """Feedforward by inverse simulation with PI feedback, gains in Pa/m and Pa/(m s)."""

    def __init__(self, inverse: PlantInverse, proportional: float, integral: float) -> None:
        self.inverse = inverse
        self.proportional, self.integral = proportional, integral
        self.reset()

    def reset(self) -> None:
        """Reset, with the plant at rest without pressure."""
        self.inverse.reset()
        self._sum = 0.0

    def act(self, reference: Array, reading: float, pressure: float, load: float) -> float:
        """Return the setpoint [Pa]; see :class:`Controller`."""
        model = self.inverse.model
        error = self.inverse.expected - reading
        forward = self.inverse.act(reference)
        output, self._sum = correction(
            error,
            self._sum,
            forward,
            self.proportional,
            self.integral * model.period,
            model.max_pressure,
        )
        return float(output)


def correction(
    error: Any, total: Any, forward: Any, proportional: Any, integral: Any, full: float
) -> tuple[Any, Any]:
    """Return the setpoint [Pa] and the integral [Pa], numbers or arrays.

    Anti-windup: the integral stops while the setpoint is at a limit and would exceed it.
    """
    summed = np.minimum(np.maximum(total + integral * error, -AUTHORITY * full), AUTHORITY * full)
    desired = forward + proportional * error + summed
    output = np.minimum(np.maximum(desired, 0.0), full)
    beyond = (desired - output) * error > 0.0
    return output, np.where(beyond, total, summed)


def stroke(model: Simulated) -> float:
    """Return the contraction [m] after two seconds of full pressure."""
    one = model.batch(1)
    for _ in range(round(2.0 / model.period)):
        one.step([model.max_pressure])
    return float(one.position[0])


def dead_periods(model: Simulated) -> int:
    """Return the dead time [periods] until a setpoint has a twentieth of its effect."""
    full, periods = model.max_pressure, round(0.5 / model.period)
    two, apart = model.batch(2), np.empty(periods)
    for _ in range(round(2.0 / model.period)):
        two.step([0.5 * full, 0.5 * full])
    for t in range(periods):
        two.step([0.5 * full, 0.7 * full])
        apart[t] = two.position[1] - two.position[0]
    return int(np.argmax(apart >= 0.05 * apart[-1])) if apart[-1] > 0.0 else 0


def tuning_reference(model: Simulated, top: float) -> Array:
    """Return the reference for tuning [m]: sines, then ramps and holds."""
    t = np.arange(round(TUNING_TIME / model.period) + PREVIEW) * model.period
    sines = 0.5 + 0.2 * np.sin(1.9 * t) + 0.1 * np.sin(4.4 * t + 1.0) + 0.05 * np.sin(8.2 * t + 2.0)
    nodes = np.array([0.0, 4.5, 4.9, 5.7, 6.1, 6.9, 7.5, 8.1, 8.3, 9.0])
    levels = np.array([0.5, 0.5, 0.8, 0.8, 0.3, 0.3, 0.65, 0.65, 0.45, 0.45])
    shares = np.where(t < 4.5, sines, np.interp(t, nodes, levels))
    rise = np.minimum(1.0, t / 1.5)
    return np.asarray(top * shares * rise * rise * (3.0 - 2.0 * rise))


def feed_forward(inverse: PlantInverse, reference: Array) -> tuple[Array, Array, Array]:
    """Return setpoints [Pa], readings before them [m] and positions after them [m]."""
    inverse.reset()
    rows = []
    for k in range(len(reference) - PREVIEW):
        expected = inverse.expected
        rows.append((inverse.act(reference[k : k + PREVIEW]), expected, inverse.model.position))
    made = np.array(rows)
    return made[:, 0], made[:, 1], made[:, 2]


def disturbance(periods: int, period: float, full: float) -> Array:
    """Return the pressure disturbance of the tuning [Pa]: slow sines and a step every 1.5 s."""
    t = np.arange(periods) * period
    rng = np.random.default_rng(TUNING_SEED)
    steps = rng.uniform(-1.0, 1.0, int(t[-1] / 1.5) + 1)[(t / 1.5).astype(int)]
    return np.asarray(DISTURBANCE * full * (steps + np.sin(0.7 * t + 0.5) + 0.5 * np.sin(2.3 * t)))


def errors_of(
    model: Simulated, forward: Array, expected: Array, reference: Array, gains: Array
) -> Array:
    """Return the RMS error [m] of every pair of gains over the model errors, shape (n,)."""
    full, n = model.max_pressure, len(gains)
    kp, ki = np.tile(gains.T, len(MISTAKES))
    factor, late = np.repeat(np.array(MISTAKES), n, axis=0).T
    plants, push = model.batch(len(kp)), disturbance(len(forward), model.period, full)
    rough = model.noise * np.random.default_rng(TUNING_SEED).standard_normal(len(forward))
    total, read = np.zeros(len(kp)), np.zeros(len(kp))
    sent = np.zeros((int(late.max()) + 1, len(kp)))
    squares, first, lane = np.zeros(len(kp)), round(1.5 / model.period), np.arange(len(kp))
    for k, (u, seen) in enumerate(zip(forward, expected, strict=True)):
        error = seen - read - rough[k]
        sent[1:] = sent[:-1]
        sent[0], total = correction(error, total, u, kp, ki * model.period, full)
        acting = factor * sent[late.astype(int), lane] + push[k]
        read, _ = plants.step(np.clip(acting, 0.0, full))
        if k >= first:
            squares += (plants.position - reference[k + 1]) ** 2
    mean = squares.reshape(len(MISTAKES), n).mean(axis=0) / (len(forward) - first)
    return np.asarray(np.sqrt(mean))


def best_inverse(model: Simulated, reference: Array) -> tuple[PlantInverse, Array, Array]:
    """Return the inverse with the smallest error, its setpoints [Pa] and readings [m]."""
    dead, first = dead_periods(model), round(1.5 / model.period)

    def tried(horizon: int, look: int) -> tuple[float, PlantInverse, Array, Array]:
        inverse = PlantInverse(model, horizon, look)
        forward, expected, position = feed_forward(inverse, reference)
        missed = position - reference[1 : len(position) + 1]
        return float(np.mean(missed[first:] ** 2)), inverse, forward, expected

    found = [tried(dead + beyond, 0) for beyond in HORIZONS]
    found += [tried(dead + HORIZONS[1], dead + look) for look in REACHES]
    _, inverse, forward, expected = min(found, key=lambda made: made[0])
    return inverse, forward, expected


def design(plant: SingleMuscle | Simulated) -> InversePi:
    """Return the controller of a plant: feedforward by inverse simulation with PI feedback."""
    model: Simulated = (
        PlantStepper(plant, plant.mass.load) if isinstance(plant, SingleMuscle) else plant
    )
    top = stroke(model)
    reference = tuning_reference(model, top)
    inverse, forward, expected = best_inverse(model, reference)
    per_length = model.max_pressure / max(top, SHORTEST)
    grid = per_length * np.array([(p, i) for p in PROPORTIONAL for i in INTEGRAL])
    errors = errors_of(model, forward, expected, reference, grid)
    proportional, integral = grid[int(np.argmin(errors))]
    return InversePi(inverse, float(proportional), float(integral))
