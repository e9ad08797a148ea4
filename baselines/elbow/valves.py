"""The inner loops: from wanted pressures to what the valves are told.

A regulator lags. Its set-point is put ahead of the wanted pressure, by a share of what the sensed
pressure is still short of, so that the loop is as fast as ``QUICK`` control periods.

On/off valves take one pulse in a cycle. Its width is the one that lets in or out the air that the
bundle is short of at the end of the cycle: the bundle's volume there, with the rate at which the
elbow turns, times the wanted pressure, less the air inside; over the flow through the valve at a
pressure half-way; longer by the opening time and shorter by the closing time. What the shortest
pulse would overshoot by more than it is short now, is left, and so is what sensors hardly tell,
unless it is half of what a whole cycle brings: near empty, air leaves slowly.

Each loop also says within which limits the pressures can be at the end of its next step, for those
who want to choose among what is to be had then.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from baselines.core.controller import Array
from baselines.core.knobs import AS_DESIGNED, Bounds, Knobs, knob
from baselines.elbow.view import ElbowView
from pam_envs.constants import ATMOSPHERE, PRESSURE_PER_DENSITY
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
from pam_envs.pneumatics.on_off_pair import mass_flow

QUICK = 2.0
"""Control periods that the loop around a regulator takes; fewer would act on sensor noise."""
TOLD = 1e3
"""Difference of pressures [Pa] that sensors hardly tell: some three times a gauge's noise."""
KNOBS: Bounds = {"pressure_loop": (0.5, 3.0)}
"""On what a wanted pressure is beyond the sensed one."""
EARLY_KNOBS: Bounds = {**KNOBS, "step": (0.5, 4.0)}
"""Also on how far the pressures are taken to come in the next step."""


class PressureLoop(Protocol):
    """From wanted pressures to commands."""

    def commands(self, view: ElbowView, wanted: Array) -> Array:
        """Return the commands for wanted pressures [Pa], shapes (2, n_env)."""
        ...

    def reach(self, view: ElbowView) -> tuple[Array, Array]:
        """Return the lowest and the highest pressures [Pa] of the next step, shapes (2, n_env)."""
        ...


@dataclass(frozen=True)
class RegulatorLoop:
    """For proportional regulators; see this module's page.

    Attributes
    ----------
    plant : ElbowOrthosis
    """

    plant: ElbowOrthosis

    @cached_property
    def lead(self) -> float:
        """Set-point beyond the sensed pressure, over what the wanted one is beyond it."""
        return max(1.0, self.plant.regulator.time_constant / (QUICK * self.plant.control_period))

    def commands(self, view: ElbowView, wanted: Array) -> Array:
        """Return set-points [Pa]; see :class:`PressureLoop`."""
        return view.pressure + self.lead * (wanted - view.pressure)

    def reach(self, view: ElbowView) -> tuple[Array, Array]:
        """Return what a regulator comes to in ``QUICK`` periods; see :class:`PressureLoop`."""
        law, time = self.plant.regulator, QUICK * self.plant.control_period
        share, most = 1.0 - math.exp(-time / law.time_constant), time * law.slew_rate
        there = view.pressure
        low = np.maximum((1.0 - share) * there, there - most)
        return low, np.minimum(there + share * (self.plant.full_pressure - there), there + most)


@dataclass(frozen=True)
class PulseLoop:
    """For pairs of on/off valves; see this module's page.

    Attributes
    ----------
    plant : ElbowOrthosis
    """

    plant: ElbowOrthosis

    def commands(self, view: ElbowView, wanted: Array) -> Array:
        """Return pulse widths [s]; 0 where none is taken. See :class:`PressureLoop`."""
        inside, still, per_volume = self._closed(view)
        short = (wanted + ATMOSPHERE) / per_volume - inside
        widths = [
            [self._width(*row) for row in zip(*(x.tolist() for x in side), strict=True)]
            for side in zip(short, still, wanted, strict=True)
        ]
        return np.where(view.taken, np.array(widths), 0.0)

    def reach(self, view: ElbowView) -> tuple[Array, Array]:
        """Return what the longest pulses come to; see :class:`PressureLoop`."""
        plant, (_, still, per_volume) = self.plant, self._closed(view)
        time = plant.cycle - plant.valve.opening_time + plant.valve.closing_time
        filled, emptied = (
            np.array([[self._flow(fills, p) for p in side] for side in still.tolist()])
            for fills in (True, False)
        )
        low, high = (still + time * per_volume * f for f in (-emptied, filled))
        return np.maximum(low, 0.0), np.clip(high, 0.0, plant.full_pressure)

    def _closed(self, view: ElbowView) -> tuple[Array, Array, Array]:
        """Return air inside [kg], pressures without a pulse, and pressure per air, after a cycle.

        All of shape (2, n_env); pressures in [Pa] and [Pa/kg].
        """
        plant, bundles = self.plant, (self.plant.bundle_a, self.plant.bundle_b)
        then = np.clip(view.angle + plant.cycle * view.rate, *plant.angle_range)
        now, after = (
            np.array(
                [b.volume(c) for b, c in zip(bundles, plant.pulley.contractions(q), strict=True)]
            )
            for q in (view.angle, then)
        )
        inside = (view.pressure + ATMOSPHERE) * now / PRESSURE_PER_DENSITY
        return (
            inside,
            inside * PRESSURE_PER_DENSITY / after - ATMOSPHERE,
            PRESSURE_PER_DENSITY / after,
        )

    def _flow(self, fills: bool, pressure: float) -> float:
        """Return the flow [kg/s] into, or out of, a bundle at a pressure [Pa]."""
        valve, inside = self.plant.valve, pressure + ATMOSPHERE
        ends = (valve.supply_pressure + ATMOSPHERE, inside) if fills else (inside, ATMOSPHERE)
        return mass_flow(*ends, valve.conductance, valve.critical_ratio)

    def _width(self, short: float, pressure: float, wanted: float) -> float:
        """Return the signed width [s] of the pulse that brings the air [kg] that is short.

        Parameters
        ----------
        short : float
            [kg]; negative where there is too much.
        pressure, wanted : float
            That the bundle would have at the end of the cycle, and should have [Pa].
        """
        valve = self.plant.valve
        flow = self._flow(short > 0.0, 0.5 * (pressure + wanted))
        least = 0.5 * flow * valve.closing_time
        hardly = abs(wanted - pressure) < TOLD and abs(short) < 0.5 * flow * self.plant.cycle
        empty = short < 0.0 and pressure < TOLD
        if flow <= 0.0 or abs(short) < least or hardly or empty:
            return 0.0
        needed = abs(short) / flow + valve.opening_time - valve.closing_time
        width = min(self.plant.cycle, max(valve.opening_time, needed))
        return width if short > 0.0 else -width


@dataclass(frozen=True)
class PacedLoop:
    """An inner loop that is told to go further, or less far, than the wanted pressures.

    Attributes
    ----------
    loop : PressureLoop
    pace : float
        What it is told beyond the sensed pressure, over what the wanted one is beyond it.
    step : float
        How far the pressures are taken to come in the next step, over what ``loop`` says.
    full : float
        Largest pressure [Pa].
    """

    loop: PressureLoop
    pace: float
    step: float
    full: float

    def commands(self, view: ElbowView, wanted: Array) -> Array:
        """Return the commands; see :class:`PressureLoop`."""
        return self.loop.commands(view, self._beyond(view, wanted, self.pace))

    def reach(self, view: ElbowView) -> tuple[Array, Array]:
        """Return the limits of the next step; see :class:`PressureLoop`."""
        low, high = self.loop.reach(view)
        return self._beyond(view, low, self.step), self._beyond(view, high, self.step)

    def _beyond(self, view: ElbowView, pressure: Array, factor: float) -> Array:
        sensed = view.pressure
        return np.clip(sensed + factor * (pressure - sensed), 0.0, self.full)


def make_pressure_loop(plant: ElbowOrthosis, knobs: Knobs = AS_DESIGNED) -> PressureLoop:
    """Return the inner loop for the valves of a nominal plant.

    Its ``knobs`` are those of ``EARLY_KNOBS``.
    """
    loop = PulseLoop(plant) if plant.valves == "on_off" else RegulatorLoop(plant)
    pace, step = knob(knobs, "pressure_loop"), knob(knobs, "step")
    return loop if pace == step == 1.0 else PacedLoop(loop, pace, step, plant.full_pressure)
