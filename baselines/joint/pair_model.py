"""Nominal pairs of muscles: pressures of a setpoint, torque, friction, and linear motion.

All functions act on rows, one for each joint of each environment. The friction is driven by the
length of the muscles, and hence by the angle, which is sensed, so that the state of the friction is
known without a model of the motion. Geometry and force law are tabulated over the angle.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import expm, solve_discrete_are

from baselines.predictive.regulator import regulated
from pam_envs.arrays import Array
from pam_envs.hysteresis.slip import SlipModel, slip_lag, slip_to
from pam_envs.kernels.arithmetic import decay
from pam_envs.kernels.build import entry, kernel
from pam_envs.mechanics.antagonistic_lever import SIDES
from pam_envs.plants.antagonistic_joint.statics import PairPlant

POINTS = 1201
"""Number of angles, and of setpoints, in the tables."""
BEYOND = 0.1
"""Range [rad] beyond the stop that the table also covers."""
RESOLUTION = 1.0
"""Deviation [Pa] below which two pressure differences count as equal."""
STRAIN, LEVER, AREA, PASSIVE, STIFFNESS = 0, 2, 4, 6, 8
"""Columns of the table. Each of the first four is the first of two adjacent columns, one for each
muscle: contraction relative to that of the straight joint [1], ``dL/dphi`` [m], force over pressure
[m2], passive force [N]. The last is the stiffness [N m/rad] of the joint."""
DRAG, LIMIT, LIMIT_RATE, VISCOSITY, DAMPING, LENGTH, FIRST, PER_ANGLE = range(8)
"""Indices of the numbers of the model: friction over lag [N], slip limit at zero pressure [1] and
its slope over pressure [1/Pa], viscosity over length [m s], damping [N m s/rad], rest length [m],
first angle of the table [rad] and number of table cells per angle [1/rad]."""


@kernel
def cell_at(table: Any, numbers: Any, angle: float) -> tuple[int, float]:
    """Return the table cell of an angle [rad], and the position [0 to 1] of the angle in it."""
    place = min(max((angle - numbers[FIRST]) * numbers[PER_ANGLE], 0.0), len(table) - 1.001)
    cell = int(place)
    return cell, place - cell


@kernel
def looked_up(table: Any, cell: int, share: float, column: int) -> float:
    """Return a column, interpolated at a position [0 to 1] in a cell."""
    low = table[cell][column]
    return low + share * (table[cell + 1][column] - low)  # type: ignore[no-any-return]


@kernel
def friction_of(
    table: Any, numbers: Any, slip: Any, cell: int, share: float, side: int, pressure: float,
    sliders: Any,
) -> tuple[float, float]:  # fmt: skip
    """Return the friction [N] of a muscle, and the slope [N] of the elements that stick.

    The slope is over the contraction [1]. The sliders, shape (elements,), are changed in place to
    those at the angle.
    """
    thresholds, curves, low, per = slip
    limit = numbers[LIMIT] + numbers[LIMIT_RATE] * pressure
    x = looked_up(table, cell, share, STRAIN + side)
    lag, stuck = slip_lag(x, limit, thresholds, curves, low, per, sliders)
    slip_to(x, limit, thresholds, sliders, sliders)
    return numbers[DRAG] * lag, numbers[DRAG] * stuck


@kernel
def force_of(table: Any, cell: int, share: float, side: int, pressure: float) -> float:
    """Return the force [N] of the static law; it may be negative."""
    force = pressure * looked_up(table, cell, share, AREA + side)
    return force - looked_up(table, cell, share, PASSIVE + side)


@entry
def pull_rows(
    table: Array, numbers: Array, thresholds: Array, curves: Array, low: float, per: float,
    angle: Array, pressures: Array, sliders: Array, found: Array,
) -> None:  # fmt: skip
    """Write torque [N m], stiffness [N m/rad] and damping [N m s/rad] of pairs, shape (3, rows).

    Angles [rad] have the shape (rows,), pressures [Pa] (rows, 2). The sliders, shape (rows, 2,
    elements), are changed in place to those at the angles.
    """
    slip = (thresholds, curves, low, per)
    for r in range(len(angle)):
        cell, share = cell_at(table, numbers, angle[r])
        torque, damping = 0.0, numbers[DAMPING]
        stiffness = looked_up(table, cell, share, STIFFNESS)
        for side in range(2):
            p, lever = pressures[r, side], looked_up(table, cell, share, LEVER + side)
            drag, stuck = friction_of(table, numbers, slip, cell, share, side, p, sliders[r, side])
            torque = torque - max(0.0, force_of(table, cell, share, side, p) - drag) * lever
            stiffness = stiffness + stuck * lever * lever / numbers[LENGTH]
            damping = damping + numbers[VISCOSITY] * p * lever * lever
        found[0, r], found[1, r], found[2, r] = torque, stiffness, damping


@entry
def friction_rows(
    table: Array, numbers: Array, thresholds: Array, curves: Array, low: float, per: float,
    angles: Array, pressures: Array, sliders: Array, drags: Array,
) -> None:  # fmt: skip
    """Write the friction forces [N] of both muscles at successive angles [rad], (rows, n, 2).

    The sliders, shape (rows, 2, elements), are changed in place to those at the last angle.
    """
    slip = (thresholds, curves, low, per)
    for r in range(len(angles)):
        for k in range(angles.shape[1]):
            cell, share = cell_at(table, numbers, angles[r, k])
            for side in range(2):
                drags[r, k, side], _ = friction_of(
                    table, numbers, slip, cell, share, side, pressures[r, side], sliders[r, side]
                )


@kernel
def share_of(value: float, least: float, most: float) -> float:
    """Return the position of a value between two others: 0 below the first, 1 above the second."""
    if value <= least:
        return 0.0
    return (value - least) / (most - least) if value < most else 1.0


@kernel
def torque_under(table: Any, cell: int, share: float, both: Any, k: int, drag: Any) -> float:
    """Return the torque [N m] at setpoint ``k`` with friction forces [N] of the muscles, (2,)."""
    torque = 0.0
    for side in range(2):
        force = max(0.0, force_of(table, cell, share, side, both[side, k]) - drag[side])
        torque = torque - force * looked_up(table, cell, share, LEVER + side)
    return torque


@entry
def set_point_rows(
    table: Array, numbers: Array, set_points: Array, both: Array, angle: Array, torque: Array,
    drag: Array, found: Array,
) -> None:  # fmt: skip
    """Write the setpoints [rad] at which the muscles exert torques [N m] at angles [rad].

    ``drag`` [N] has the shape (rows, 2).
    """
    for r in range(len(angle)):
        cell, share = cell_at(table, numbers, angle[r])
        low, high = 0, len(set_points) - 1
        least = torque_under(table, cell, share, both, low, drag[r])
        most = torque_under(table, cell, share, both, high, drag[r])
        while high - low > 1:
            middle = (low + high) // 2
            there = torque_under(table, cell, share, both, middle, drag[r])
            if there < torque[r]:
                low, least = middle, there
            else:
                high, most = middle, there
        part = share_of(torque[r], least, most)
        found[r] = set_points[low] + part * (set_points[high] - set_points[low])


@kernel
def difference_after(both: Any, k: int, later: Any, lag: float, rate: float, time: float) -> float:
    """Return the difference [Pa] between the two pressures a time [s] after setpoint ``k``."""
    left = decay(time / lag)
    a = regulated(later[0], both[0, k], lag, rate, time, left)
    return a - regulated(later[1], both[1, k], lag, rate, time, left)


@entry
def command_rows(
    angles: Array, both: Array, later: Array, wanted: Array, lag: Array, rate: Array, time: float,
    found: Array,
) -> None:  # fmt: skip
    """Write the setpoints [rad] that lead to a pressure difference [Pa] after a time [s].

    ``angles`` [rad] and ``both`` [Pa], shapes (n,) and (2, n), are the tabulated setpoints and
    their pressures; ``later`` [Pa], shape (rows, 2), are those when a setpoint takes effect.
    """
    for r in range(len(wanted)):
        low, high = 0, len(angles) - 1
        least = difference_after(both, low, later[r], lag[r], rate[r], time)
        most = difference_after(both, high, later[r], lag[r], rate[r], time)
        while high - low > 1:
            middle = (low + high) // 2
            there = difference_after(both, middle, later[r], lag[r], rate[r], time)
            if there < wanted[r] - RESOLUTION:
                low, least = middle, there
            else:
                high, most = middle, there
        share = share_of(wanted[r], least, most)
        found[r] = angles[low] + share * (angles[high] - angles[low])


class Pull(NamedTuple):
    """Torque [N m], stiffness [N m/rad] and damping [N m s/rad] of pairs, shape (rows,) each."""

    torque: Array
    stiffness: Array
    damping: Array


@dataclass(frozen=True)
class PairModel:
    """Nominal muscles of a joint, without friction or with friction driven by length."""

    plant: PairPlant

    @staticmethod
    def fits(plant: Any) -> bool:
        """Return whether a plant has muscles, without or with friction driven by length."""
        if not isinstance(plant, PairPlant) or getattr(plant, "dynamics", "") != "muscles":
            return False
        return plant.hysteresis.operator is None or isinstance(plant.hysteresis.model, SlipModel)

    # --- setpoints ------------------------------------------------------------------------------

    @cached_property
    def _set_points(self) -> tuple[Array, Array]:
        angles = np.linspace(*self.plant.angle_range, POINTS)
        a, b, _ = self.plant.pressures_for(angles, self.plant.prestress)
        return angles, np.array([a, b])

    def pressures(self, set_point: Array) -> Array:
        """Return the pressures [Pa] of setpoints [rad], shape (..., 2)."""
        angles, both = self._set_points
        return np.stack([np.interp(set_point, angles, one) for one in both], axis=-1)

    def difference(self, set_point: Array) -> Array:
        """Return the difference [Pa] between the two pressures at setpoints [rad]."""
        angles, (a, b) = self._set_points
        return np.interp(set_point, angles, a - b)

    def command(self, later: Array, wanted: Array, lag: Array, rate: Array, period: float) -> Array:
        """Return the setpoints [rad] that lead to pressure differences [Pa], shape (rows,).

        The differences are those one period [s] after the setpoint takes effect; ``later``, shape
        (rows, 2), are the pressures [Pa] at that instant. Lag [s] and rate [Pa/s] are those of the
        regulators, shape (rows,).
        """
        found = np.empty_like(wanted)
        states = (np.ascontiguousarray(later), np.ascontiguousarray(wanted))
        laws = (np.ascontiguousarray(lag), np.ascontiguousarray(rate))
        command_rows(*self._set_points, *states, *laws, period, found)
        return found

    # --- torque ---------------------------------------------------------------------------------

    @cached_property
    def _tables(self) -> tuple[Array, Array, Array, Array, float, float]:
        plant, muscle, law = self.plant, self.plant.muscle, self.plant.hysteresis
        edge, length = plant.largest_angle + BEYOND, muscle.rest_length
        angles = np.linspace(-edge, edge, POINTS)
        x = plant.lever.contraction(angles, length)
        gains = muscle.gain * (1.0 + np.array(SIDES) * muscle.imbalance)
        strain = x - plant.lever.contraction(0.0, length)
        stiffness = plant.stiffness_at(np.clip(angles, *plant.angle_range))[:, None]
        forces = gains * muscle.area_at(x), gains * muscle.passive(x)
        per_pascal = float(law.slip(1e5) - law.slip(0.0)) / 1e5
        friction = float(law.stiffness(0.0)), float(law.slip(0.0)), per_pascal
        viscous, cells = muscle.viscosity / length, (POINTS - 1) / (2.0 * edge)
        numbers = np.array([*friction, viscous, plant.link.damping, length, -edge, cells])
        table = np.ascontiguousarray(
            np.hstack([strain, plant.lever.rate(angles), *forces, stiffness])
        )
        return np.ascontiguousarray(table), numbers, *self._slip

    @cached_property
    def _slip(self) -> tuple[Array, Array, float, float]:
        """Return thresholds, curves and grid of the friction elements; empty without friction."""
        model = self.plant.hysteresis.model
        if isinstance(model, SlipModel):
            return model.arrays
        return np.zeros(0), np.zeros((0, 2)), 0.0, 1.0

    def initial(self, angle: Array, pressures: Array) -> Array:
        """Return the sliders after motion from the straight joint to angles [rad].

        Their shape is (rows, 2, elements); at the straight joint they are in the virgin state.
        """
        sliders = np.zeros((len(angle), 2, len(self._slip[0])))
        return self.friction(angle[:, None], pressures, sliders)[1]

    def pull(self, angle: Array, pressures: Array, sliders: Array) -> tuple[Pull, Array]:
        """Return the pull of pairs at angles [rad] and pressures [Pa], (rows, 2), and sliders."""
        given, after = np.ascontiguousarray(angle), sliders.copy()
        found = np.empty((3, len(given)))
        pull_rows(*self._tables, given, np.ascontiguousarray(pressures), after, found)
        return Pull(*found), after

    def friction(self, angles: Array, pressures: Array, sliders: Array) -> tuple[Array, Array]:
        """Return the friction forces [N] of both muscles at successive angles, and the sliders.

        Angles [rad] have the shape (rows, n), friction forces (rows, n, 2). The pressures [Pa],
        shape (rows, 2), are the same at all angles.
        """
        given, after = np.ascontiguousarray(angles), sliders.copy()
        drags = np.empty((*given.shape, 2))
        friction_rows(*self._tables, given, np.ascontiguousarray(pressures), after, drags)
        return drags, after

    def set_point(self, angle: Array, torque: Array, drag: Array) -> Array:
        """Return the setpoints [rad] at which the muscles exert torques [N m] at angles [rad].

        Angles and torques may have any shape; friction forces ``drag`` [N] have one axis more, of
        length 2. The force of a muscle is that of the static law less its friction, and zero if
        this is negative (slack). If a torque is out of reach, the setpoint is the end of its range.
        """
        found = np.empty(angle.size)
        given = (np.ascontiguousarray(angle).ravel(), np.ascontiguousarray(torque).ravel())
        pairs = np.ascontiguousarray(drag).reshape(-1, 2)
        set_point_rows(*self._tables[:2], *self._set_points, *given, pairs, found)
        return found.reshape(angle.shape)

    # --- nominal point --------------------------------------------------------------------------

    @cached_property
    def stiffness(self) -> float:
        """Stiffness [N m/rad] of the straight joint."""
        return float(self.plant.stiffness_at(0.0))

    @cached_property
    def damping(self) -> float:
        """Damping [N m s/rad] of the straight joint."""
        muscle, lever = self.plant.muscle, self.plant.lever.rate(0.0)
        viscous = muscle.viscosity / muscle.rest_length
        pressures = self.pressures(np.array(0.0))
        return float(self.plant.link.damping + viscous * np.sum(pressures * lever**2))


@dataclass(frozen=True)
class LinearMotion:
    """Linear motion of n coupled joints about the straight pose over a control period.

        M q'' + D q' + K q = torque

    Attributes
    ----------
    a, b : ndarray, shapes (2 n, 2 n) and (2 n, n)
        Matrices that map angles [rad] and rates [rad/s], and a constant torque [N m], to the angles
        and rates one period later.
    """

    a: Array
    b: Array

    @classmethod
    def make(cls, mass: Array, damping: Array, stiffness: Array, period: float) -> "LinearMotion":
        """Return the motion for ``M`` [kg m2], ``D`` [N m s/rad], (n,), and ``K`` [N m/rad]."""
        n, inverse = len(mass), np.linalg.inv(mass)
        whole = np.zeros((3 * n, 3 * n))
        whole[:n, n : 2 * n] = np.eye(n)
        whole[n : 2 * n] = np.hstack([-inverse @ stiffness, -inverse * damping, inverse])
        moved = expm(whole * period)
        return cls(moved[: 2 * n, : 2 * n], moved[: 2 * n, 2 * n :])

    def observer(self, noise: float, rate_step: float, torque_step: float) -> Array:
        """Return the steady-state Kalman gains of angles, rates and disturbances, (3 n, n).

        They are designed for the noise [rad] of the sensed angles, and for random steps per period
        of rates [rad/s] and disturbance torques [N m]. With this disturbance model, that of
        pannocchia2003, no static error remains.
        """
        n = self.b.shape[1]
        a = np.block([[self.a, self.b], [np.zeros((n, 2 * n)), np.eye(n)]])
        c = np.hstack([np.eye(n), np.zeros((n, 2 * n))])
        steps = np.repeat([ANGLE_STEP * noise, rate_step, torque_step], n)
        sensed = noise**2 * np.eye(n)
        cover = solve_discrete_are(a.T, c.T, np.diag(steps**2), sensed)
        return np.asarray(cover @ c.T @ np.linalg.inv(c @ cover @ c.T + sensed))

    def regulator(self, weight: float) -> Array:
        """Return the gains [N m/rad, N m s/rad] of a linear-quadratic regulator, shape (n, 2 n).

        An angle error costs as much as a torque of ``weight`` [N m/rad] times that error.
        """
        n = self.b.shape[1]
        errors = np.diag(np.repeat([weight**2, 0.0], n))
        cost = solve_discrete_are(self.a, self.b, errors, np.eye(n))
        left = np.eye(n) + self.b.T @ cost @ self.b
        return np.asarray(np.linalg.solve(left, self.b.T @ cost @ self.a))


ANGLE_STEP = 1e-3
"""Random step of an angle per period, divided by the sensor noise; small, because angles change
only by their rates."""
