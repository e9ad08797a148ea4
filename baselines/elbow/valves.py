"""Inner pressure loops of the elbow: from reference pressures to valve commands.

Regulators lag: the setpoint leads the reference by a multiple of the remaining pressure error, so
that the loop takes ``LOOP_PERIODS`` control periods.

On/off valves accept one pulse per cycle. Its width is the missing mass of air over the flow through
the valve at the mean pressure, longer by the opening time and shorter by the closing time. The
missing mass is that for the reference pressure in the volume at the end of the cycle (at the
present rate of the elbow), less the air inside. No pulse is given if the shortest one would
overshoot by more than the present error, or if the sensors do not resolve the error, unless the
error is at least half of the effect of a whole cycle: near empty, air leaves slowly.

Each loop also gives the limits of the pressures at the end of its next step.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, RowController
from baselines.core.entry import Bounds, Spec
from baselines.elbow.nominal import ELBOW_ENTRY, ElbowSignalMap, ElbowView, make_elbow_signal_map
from pam_envs.arrays import Array
from pam_envs.constants import ATMOSPHERE, PRESSURE_PER_DENSITY
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
from pam_envs.pneumatics.flow import mass_flow

LOOP_PERIODS = 2.0
"""Control periods of the loop around a regulator; fewer would amplify sensor noise."""
RESOLVED = 1e3
"""Pressure difference [Pa] resolved by the sensors: about three times a gauge's noise."""
KNOBS: Bounds = {"pressure_loop": (0.5, 3.0)}
"""Factor on the difference between reference and sensed pressure."""
EARLY_KNOBS: Bounds = {**KNOBS, "step": (0.5, 4.0)}
"""Also a factor on the reachable change of pressure in the next step."""


@dataclass(frozen=True)
class PressureLoop(ABC):
    """From reference pressures [Pa] to commands, and to the limits of the next step.

    ``factor`` acts on the pressure error, ``step`` on the reachable change of pressure.
    """

    plant: ElbowOrthosis
    factor: float = 1.0
    step: float = 1.0

    @final
    def commands(self, view: ElbowView, reference: Array) -> Array:
        """Return setpoints [Pa], or pulse widths [s]: 0 where no pulse is accepted."""
        return self._commands(view, self._beyond(view, reference, self.factor))

    @final
    def reach(self, view: ElbowView) -> tuple[Array, Array]:
        """Return the lowest and highest pressures [Pa] of the next step, shapes (2, n_env)."""
        low, high = self._reach(view)
        return self._beyond(view, low, self.step), self._beyond(view, high, self.step)

    def _beyond(self, view: ElbowView, pressure: Array, factor: float) -> Array:
        if factor == 1.0:
            return pressure
        sensed = view.pressure
        return np.clip(sensed + factor * (pressure - sensed), 0.0, self.plant.full_pressure)

    @abstractmethod
    def _commands(self, view: ElbowView, reference: Array) -> Array: ...

    @abstractmethod
    def _reach(self, view: ElbowView) -> tuple[Array, Array]: ...


class RegulatorLoop(PressureLoop):
    """For proportional regulators; see the module."""

    @property
    def _time(self) -> float:
        return LOOP_PERIODS * self.plant.control_period

    def _commands(self, view: ElbowView, reference: Array) -> Array:
        lead = max(1.0, self.plant.regulator.time_constant / self._time)
        return view.pressure + lead * (reference - view.pressure)

    def _reach(self, view: ElbowView) -> tuple[Array, Array]:
        law, time = self.plant.regulator, self._time
        share, most = 1.0 - math.exp(-time / law.time_constant), time * law.slew_rate
        there = view.pressure
        low = np.maximum((1.0 - share) * there, there - most)
        return low, np.minimum(there + share * (self.plant.full_pressure - there), there + most)


class PulseLoop(PressureLoop):
    """For pairs of on/off valves; see the module."""

    def _commands(self, view: ElbowView, reference: Array) -> Array:
        inside, still, per_volume = self._closed(view)
        short = (reference + ATMOSPHERE) / per_volume - inside
        widths = [
            [self._width(*row) for row in zip(*(x.tolist() for x in side), strict=True)]
            for side in zip(short, still, reference, strict=True)
        ]
        return np.where(view.accepts, np.array(widths), 0.0)

    def _reach(self, view: ElbowView) -> tuple[Array, Array]:
        plant, (_, still, per_volume) = self.plant, self._closed(view)
        time = plant.cycle - plant.valve.opening_time + plant.valve.closing_time
        filled, emptied = (
            np.array([[self._flow(fills, p) for p in side] for side in still.tolist()])
            for fills in (True, False)
        )
        low, high = (still + time * per_volume * f for f in (-emptied, filled))
        return np.maximum(low, 0.0), np.clip(high, 0.0, plant.full_pressure)

    def _closed(self, view: ElbowView) -> tuple[Array, Array, Array]:
        """Return air inside [kg], pressure without a pulse [Pa], and pressure per air mass [Pa/kg].

        The pressures are those at the end of the cycle; all of shape (2, n_env).
        """
        plant = self.plant
        then = np.clip(view.angle + plant.cycle * view.rate, *plant.angle_range)
        now, after = self._volumes(view.angle), self._volumes(then)
        inside = (view.pressure + ATMOSPHERE) * now / PRESSURE_PER_DENSITY
        closed = inside * PRESSURE_PER_DENSITY / after - ATMOSPHERE
        return inside, closed, PRESSURE_PER_DENSITY / after

    def _volumes(self, angle: Array) -> Array:
        """Return the volumes [m^3] of both bundles at an angle [rad]."""
        a, b = self.plant.pulley.contractions(angle)
        return np.array([self.plant.bundle_a.volume(a), self.plant.bundle_b.volume(b)])

    def _flow(self, fills: bool, pressure: float) -> float:
        """Return the flow [kg/s] into, or out of, a bundle at a pressure [Pa]."""
        valve, inside = self.plant.valve, pressure + ATMOSPHERE
        ends = (valve.supply_pressure + ATMOSPHERE, inside) if fills else (inside, ATMOSPHERE)
        return mass_flow(*ends, valve.conductance, valve.critical_ratio)

    def _width(self, short: float, pressure: float, reference: float) -> float:
        """Return the signed width [s] of the pulse that supplies missing air ``short`` [kg].

        ``pressure`` [Pa] is that of the bundle at the end of the cycle without a pulse.
        """
        valve = self.plant.valve
        flow = self._flow(short > 0.0, 0.5 * (pressure + reference))
        least = 0.5 * flow * valve.closing_time
        unresolved = (
            abs(reference - pressure) < RESOLVED and abs(short) < 0.5 * flow * self.plant.cycle
        )
        empty = short < 0.0 and pressure < RESOLVED
        if flow <= 0.0 or abs(short) < least or unresolved or empty:
            return 0.0
        needed = abs(short) / flow + valve.opening_time - valve.closing_time
        width = min(self.plant.cycle, max(valve.opening_time, needed))
        return width if short > 0.0 else -width


def make_pressure_loop(spec: Spec[ElbowOrthosis]) -> PressureLoop:
    """Return the inner loop for the valves of a nominal plant; its knobs are ``EARLY_KNOBS``."""
    kind = PulseLoop if spec.plant.valves == "on_off" else RegulatorLoop
    return kind(spec.plant, spec.knob("pressure_loop"), spec.knob("step"))


@dataclass(frozen=True)
class ConstantPressure(RowController):
    """Constant pressure [Pa] in both bundles."""

    signals: ElbowSignalMap
    loop: PressureLoop
    pressure: float

    def respond(self, observation: ArrayLike, state: Any) -> Prediction:
        """Return the action and no state."""
        view = self.signals.read(observation)
        commands = self.loop.commands(view, np.full_like(view.pressure, self.pressure))
        return self.signals.write(commands, observation), None


def make_constant_pressure(spec: Spec[ElbowOrthosis]) -> ConstantPressure:
    """Return the controller with half of the largest pressure in both bundles."""
    return ConstantPressure(
        make_elbow_signal_map(spec), make_pressure_loop(spec), 0.5 * spec.plant.full_pressure
    )


ENTRIES = {
    "elbow_hold": ELBOW_ENTRY(
        "constant pressure of 3 bar in both bundles", make=make_constant_pressure
    ),
}
