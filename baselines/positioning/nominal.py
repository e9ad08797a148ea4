"""Nominal muscle vectorised over rows, as used by the model-based controllers.

Everything is computed from the nominal :class:`~pam_envs.plants.single_muscle.plant.SingleMuscle`.
Rows may have different loads: they are processed by load, and the model at a load (hysteresis, its
inverse, static curve) is prepared when that load first occurs.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property, partial
from typing import Any

import numpy as np

from baselines.core.controller import by_load
from baselines.positioning.contraction_tables import LOADS
from pam_envs.arrays import Array
from pam_envs.constants import GRAVITY
from pam_envs.hysteresis.protocol import Rows, RowsState, operator_of
from pam_envs.plants.single_muscle.plant import SingleMuscle

CURVE_POINTS = 1001
"""Points of the tabulated static curve; linear interpolation is exact to 0.05 um."""


@dataclass(frozen=True)
class LoadedMuscle:
    """The nominal muscle with one load [kg]."""

    plant: SingleMuscle
    load: float

    @cached_property
    def hysteresis(self) -> Rows:
        """The hysteresis at this load."""
        return operator_of(self.plant.operator_at(self.load)).rows()

    @cached_property
    def _rest_strain(self) -> float:
        """Strain at rest without pressure, from which the contraction is counted."""
        muscle, force, low, high = self.plant.muscle, self.load * GRAVITY, -0.3, 0.6
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if muscle.tension(0.0, middle) > force else (low, middle)
        return 0.5 * (low + high)

    @cached_property
    def _curve(self) -> tuple[Array, Array]:
        drive = np.linspace(0.0, self.plant.regulator.max_pressure, CURVE_POINTS)
        return drive, self.plant.contraction_at(drive, self.load)

    def drive_for(self, contraction: Array) -> Array:
        """Return the effective pressure [Pa] that holds a contraction [m]."""
        strain = contraction / self.plant.muscle.rest_length + self._rest_strain
        return self.plant.muscle.drive(self.load * GRAVITY, strain)

    def contraction_at(self, drive: Array) -> Array:
        """Return the contraction [m] at rest under an effective pressure [Pa]."""
        return np.interp(drive, *self._curve)

    def advance(self, drive: Array, state: RowsState) -> tuple[Array, RowsState]:
        """Return the effective pressure [Pa] at a pressure [Pa], and the next state."""
        law, full = self.plant.hysteresis, self.plant.regulator.max_pressure
        output, after = self.hysteresis.forward(law.stretched(drive, full), state)
        return law.unstretched(output, full), after

    def along(self, drives: Array, state: RowsState) -> RowsState:
        """Return the state after pressures [Pa] one after the other, shape (n_env, n_steps)."""
        law, full = self.plant.hysteresis, self.plant.regulator.max_pressure
        return self.hysteresis.along(law.stretched(drives, full).T, state)  # type: ignore[no-any-return]

    def pressure_for(self, drive: Array, state: RowsState) -> Array:
        """Return the pressure [Pa] for an effective pressure [Pa] at this hysteresis state."""
        law, full = self.plant.hysteresis, self.plant.regulator.max_pressure
        found = self.hysteresis.inverse(law.stretched(drive, full), state)
        return law.unstretched(np.minimum(np.maximum(found, 0.0), full), full)

    def explain(self, contraction: Array, pressure: Array) -> RowsState:
        """Return the hysteresis state of the simplest history of a first measurement.

        The history rises from zero pressure to a peak and falls to the present pressure. A higher
        peak leaves more contraction; the peak is found by bisection between present and full
        pressure.
        """
        target = self.drive_for(contraction)
        low = np.array(pressure, float)
        high = np.full_like(low, self.plant.regulator.max_pressure)
        for _ in range(14):
            middle = 0.5 * (low + high)
            more = self._after(middle, pressure)[0] < target
            low, high = np.where(more, middle, low), np.where(more, high, middle)
        return self._after(low, pressure)[1]

    def _after(self, peak: Array, pressure: Array) -> tuple[Array, RowsState]:
        _, state = self.advance(peak, self.hysteresis.initial(len(peak)))
        return self.advance(pressure, state)


@dataclass(frozen=True)
class Nominal:
    """Nominal plant over rows, each with its own load."""

    plant: SingleMuscle

    @cached_property
    def at(self) -> Callable[[float], LoadedMuscle]:
        """Return the plant with a load [kg], cached."""
        return cache(partial(LoadedMuscle, self.plant))

    def each(self, load: Array, respond: Callable[..., Any], *arguments: Any) -> Any:
        """Return ``respond(muscle, *arguments)`` for rows with loads [kg], shape (n_env,)."""
        return by_load(load, lambda key, *rest: respond(self.at(key), *rest), *arguments)

    @cached_property
    def mechanical_lag(self) -> float:
        """Lag [s] of the mass behind the static curve: damping over stiffness at mid-stroke."""
        plant, load = self.plant, self.plant.mass.load
        full = plant.regulator.max_pressure
        low, high = plant.contraction_at(np.array([0.45, 0.55]) * full, load)
        slope = (high - low) / (0.1 * full)
        return float(plant.mass.damping * slope / plant.muscle.area)

    @cached_property
    def steepest_gain(self) -> float:
        """Largest contraction per effective pressure [m/Pa], over the loads measured."""
        full, gains = self.plant.regulator.max_pressure, []
        for load in LOADS:
            drive = np.linspace(0.0, full, 61)
            gains.append(np.max(np.diff(self.plant.contraction_at(drive, load))) * 60.0 / full)
        return float(max(gains))

    @cached_property
    def slowest_swing(self) -> float:
        """Lowest natural frequency [rad/s]: heaviest load, lowest stiffness of the muscle."""
        stiffness = self.plant.muscle.area / self.steepest_gain
        return math.sqrt(stiffness / (max(LOADS) + self.plant.mass.moving_mass))

    def next_pressure(self, pressure: Array, set_point: Array) -> Array:
        """Return the regulator's pressure [Pa] after one control period, without its dead time."""
        law, period = self.plant.regulator, self.plant.control_period
        gap = set_point - pressure
        size = np.abs(gap)
        ramp = (size - law.slew_rate * law.time_constant) / law.slew_rate
        ramp = np.minimum(np.maximum(ramp, 0.0), period)
        left = (size - law.slew_rate * ramp) * np.exp((ramp - period) / law.time_constant)
        return np.asarray(set_point - np.copysign(left, gap))
