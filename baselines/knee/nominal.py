"""Nominal knee orthosis vectorised over rows, and the observation of its controllers.

Everything is computed from the nominal :class:`~pam_envs.plants.knee_orthosis.plant.KneeOrthosis`.

The environments of the brace alone track a tension or a stiffness, those of the gait a tension in
stance and an angle in swing. The names and units of the signals determine which. A reference
stiffness ``s`` becomes the reference tension ``s (L - L_min)`` at the sensed angle.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from baselines.core.controller import Reader, reader
from baselines.core.entry import Spec
from pam_envs.arrays import Array
from pam_envs.hysteresis.protocol import Rows, RowsState, operator_of
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis

SHORTEST_STRETCH = 1e-3
"""Lower bound [m] of the stretch, the divisor of tensions."""
CURVE_POINTS = 451


@dataclass(frozen=True)
class KneeNominal:
    """The nominal orthosis."""

    plant: KneeOrthosis

    @property
    def full_pressure(self) -> float:
        """Capacity [Pa]."""
        return float(self.plant.regulator.max_pressure)

    @cached_property
    def hysteresis(self) -> Rows:
        """From pressure [Pa] to stiffness [N/m] of a muscle with gain 1."""
        return operator_of(self.plant.hysteresis.scaled).rows()

    @cached_property
    def per_output(self) -> float:
        """Stiffness [N/m] over the hysteresis output."""
        muscle = self.plant.muscle
        return muscle.gain * (1.0 if self.plant.hysteresis.scaled else muscle.stiffness_ratio)

    def stretch(self, angle: Array) -> Array:
        """Return the muscle's length above its shortest [m] at an angle [rad], at least 1 mm."""
        length = self.plant.lever.length(angle)
        if self.plant.mounting == "rig":
            length = np.full_like(length, self.plant.fixture.length)
        return np.maximum(SHORTEST_STRETCH, length - self.plant.muscle.shortest_length)

    def free_tension(self, angle: Array) -> Array:
        """Return the tension [N] of zero wire torque on the knee, at least 0."""
        return np.maximum(0.0, self.plant.tension_for(angle))

    def line(self, stiffness: Array) -> Array:
        """Return the pressure [Pa] of a stiffness [N/m] on the line between the loop's tips."""
        return np.asarray(stiffness * self.per_stiffness)

    @cached_property
    def per_stiffness(self) -> float:
        """Pressure over stiffness [Pa m/N] on the line between the loop's tips."""
        return self.full_pressure / self._full_stiffness

    @cached_property
    def _full_stiffness(self) -> float:
        full, empty = np.array([self.full_pressure]), self.hysteresis.initial(1)
        return self.per_output * float(self.hysteresis.forward(full, empty)[0][0])

    def inflated(self, pressure: Array) -> RowsState:
        """Return the hysteresis state after inflation from 0 to a pressure [Pa]."""
        empty = self.hysteresis.initial(len(pressure))
        return self.advance(pressure, self.advance(np.zeros_like(pressure), empty))

    def forward(self, pressure: Array, state: RowsState) -> tuple[Array, RowsState]:
        """Return the stiffness [N/m] at a pressure [Pa] after a history, and the state then."""
        output, after = self.hysteresis.forward(pressure, state)
        return self.per_output * output, after

    def advance(self, pressure: Array, state: RowsState) -> RowsState:
        """Return the hysteresis state after a pressure [Pa]."""
        return self.forward(pressure, state)[1]

    def along(self, pressures: Array, state: RowsState) -> RowsState:
        """Return the state after pressures [Pa] one after the other, shape (n_steps, n_env)."""
        return self.hysteresis.along(pressures, state)

    def stiffness_after(self, pressure: Array, state: RowsState) -> Array:
        """Return the stiffness [N/m] at a pressure [Pa] that the history ends with."""
        return self.forward(pressure, state)[0]

    def pressure_for(self, stiffness: Array, state: RowsState) -> Array:
        """Return the pressure [Pa], within the capacity, for a stiffness [N/m] after a history."""
        found = self.hysteresis.inverse(stiffness / self.per_output, state)
        return np.minimum(np.maximum(found, 0.0), self.full_pressure)

    def tension_at_rest(self, pressure: Array) -> Array:
        """Return the tension [N] at rest without hysteresis: held in a rig, or free to move.

        On a leg it equals that of the rig: a leg that bears weight holds the muscle's length.
        """
        stiffness = pressure * (self._full_stiffness / self.full_pressure)
        if self.plant.mounting == "no_load":
            angle = self.plant.angle_at(stiffness)
        else:
            angle = self.angle_of(stiffness)
        return stiffness * self.stretch(angle)

    @cached_property
    def _balance(self) -> tuple[Array, Array]:
        """Tensions [N] at rest in increasing order, and the angles [rad] of the brace alone."""
        stiffness = np.linspace(0.0, 1.2 * self._full_stiffness, CURVE_POINTS)
        angle = self.plant.angle_at(stiffness)
        return stiffness * self.stretch(angle), angle

    def angle_of(self, tension: Array) -> Array:
        """Return the angle [rad] in equilibrium with a tension [N]: brace alone, or rig."""
        if self.plant.mounting != "no_load":
            angle = self.plant.lever.angle(np.asarray(self.plant.fixture.length))
            return np.full_like(tension, float(angle))
        return np.interp(tension, *self._balance)

    @cached_property
    def steepest_gain(self) -> float:
        """Largest static gain [N/Pa] from pressure to tension, above a tenth of the capacity."""
        pressure = np.linspace(0.1 * self.full_pressure, self.full_pressure, CURVE_POINTS)
        return float(np.max(np.diff(self.tension_at_rest(pressure)) / np.diff(pressure)))


NAMES = ("tension", "angle", "set_point", "reference")
GAIT_NAMES = ("stance", "angle_reference")


class KneeView(NamedTuple):
    """One observation of every row in SI, arrays of shape (n_env,).

    Sensed tension and angle, the setpoint of the last period, the reference tension (in swing that
    of the tension controller off-line), the muscle's length above its shortest, rows in stance, and
    the reference angle of the swing. Without a gait all rows are in stance, with the sensed angle.
    """

    tension: Array
    angle: Array
    set_point: Array
    reference: Array
    stretch: Array
    stance: NDArray[np.bool_]
    angle_reference: Array


@dataclass(frozen=True)
class KneeObserver:
    """Reader of observations as a :class:`KneeView`.

    ``gait``: whether there is stance and swing; ``stiffness``: whether the reference is a
    stiffness.
    """

    nominal: KneeNominal
    reader: Reader
    gait: bool
    stiffness: bool

    def read(self, observation: ArrayLike) -> KneeView:
        """Return the view of an observation of shape (n_obs,) or (n_env, n_obs)."""
        tension, angle, set_point, reference, *phase = self.reader.rows(observation)
        stretch = self.nominal.stretch(angle)
        if self.stiffness:
            reference = reference * stretch
        stance, path = (phase[0] > 0.5, phase[1]) if phase else (np.ones(len(angle), bool), angle)
        return KneeView(tension, angle, set_point, reference, stretch, stance, path)


def make_knee_observer(spec: Spec[KneeOrthosis]) -> KneeObserver:
    """Return the reader of the signals of any environment of the knee."""
    signals = spec.signals
    gait = set(GAIT_NAMES) <= set(signals.names())
    unit = signals["reference"].unit
    if unit not in ("N", "N/m"):
        raise ValueError(f"reference is in {unit}; the knee's controllers track N or N/m")
    names = [*NAMES, *(GAIT_NAMES if gait else ())]
    return KneeObserver(KneeNominal(spec.plant), reader(signals, names), gait, unit == "N/m")


Limits = Callable[[KneeView], tuple[Array, Array]]
"""From a view to the lowest and highest setpoint [Pa] of the next period, shapes (n_env,)."""


@dataclass(frozen=True)
class SetPointLimits:
    """Limits of a setpoint that changes by at most ``step`` [Pa] in a period."""

    low: float
    high: float
    step: float

    def __call__(self, view: KneeView) -> tuple[Array, Array]:
        """Return the lowest and highest setpoint [Pa] of the next period."""
        low = np.maximum(self.low, view.set_point - self.step)
        return low, np.minimum(self.high, view.set_point + self.step)


def set_point_limits(spec: Spec[KneeOrthosis]) -> SetPointLimits:
    """Return the limits of a setpoint that changes no faster than the pressure of the plant can."""
    signal, plant = spec.actions["pressure_set_point"], spec.plant
    return SetPointLimits(signal.low, signal.high, plant.regulator.slew_rate * plant.control_period)
