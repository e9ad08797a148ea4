"""Effects of temperature, load, viscosity, creep of the length and friction of strands."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from pam_envs.constants import ROOM_TEMPERATURE
from pam_envs.kernels.arithmetic import count_on
from pam_envs.kernels.build import LANES, kernel
from pam_envs.parameters import assumed, effect


@dataclass(frozen=True, kw_only=True)
class TemperatureEffects:
    """Temperature of a muscle; the law is that of 293.15 K."""

    effects: ClassVar[tuple[tuple[str, ...], ...]] = (("temperature", "temperature_gain"),)

    temperature: float = assumed(ROOM_TEMPERATURE, "K", 230.0, 400.0, "of the muscle")
    temperature_gain: float = effect("1/K", -0.05, 0.05, "effective pressure gained per kelvin")


@kernel
def temperature_factor(kelvin: float, gain: float) -> float:
    """Return the effective pressure at a temperature [K] over that at room temperature."""
    return 1.0 + gain * (kelvin - ROOM_TEMPERATURE)


@dataclass(frozen=True, kw_only=True)
class LoadEffects:
    """Dependence of the static law on the load."""

    load_curve: float = effect("Pa/N2", -200.0, 200.0, "pressure shift over load squared")
    load_stiffening: float = effect("1/N", -0.015, 0.05, "stiffness gained per newton of load")
    load_stiffening_2: float = effect("1/N2", -2e-4, 1e-3, "the same by load squared")
    load_stiffening_root: float = effect("1/N^0.5", -0.1, 0.5, "the same by the root of the load")


@kernel
def stiffening(weight: float, linear: float, square: float, root: float) -> float:
    """Return the factor on the passive force under a weight [N]."""
    return 1.0 + (linear + square * weight) * weight + root * math.sqrt(max(0.0, weight))


@dataclass(frozen=True, kw_only=True)
class ViscosityEffects:
    """Damping at small speeds."""

    viscosity: float = effect("N s/m", 0.0, 1e5, "damping at small speed beside the mass's")
    viscosity_speed: float = assumed(0.02, "m/s", 1e-4, 10.0, "speed that lowers it by 1 / sqrt(2)")


@kernel
def viscous_damping(viscosity: float, speed: float, pace: float) -> float:
    """Return the damping [N s/m] at a speed [m/s]."""
    return viscosity / math.sqrt(1.0 + abs(speed) / pace)


@dataclass(frozen=True, kw_only=True)
class LengthCreepEffects:
    """Creep of the length with the time constants of the hysteresis."""

    creep_1: float = effect("1", -0.5, 2.0, "length that follows at creep_time_1")
    creep_2: float = effect("1", -0.5, 2.0, "length that follows at creep_time_2")
    creep_3: float = effect("1", -0.5, 2.0, "length that follows at creep_time_3")
    creep_4: float = effect("1", -0.5, 2.0, "length that follows at creep_time_4")


BREAKS = (0.1, 0.3, 0.6, 1.0)
"""Strains at which strands break away, over that of the last one."""
STRANDS = len(BREAKS)


@dataclass(frozen=True, kw_only=True)
class StrandEffects:
    """Friction of the braid's strands: four Maxwell-slip elements in parallel with the muscle."""

    strand_1: float = effect("N", 0.0, 500.0, "friction of the first strands to break away")
    strand_2: float = effect("N", 0.0, 500.0, "friction of the second strands to break away")
    strand_3: float = effect("N", 0.0, 500.0, "friction of the third strands to break away")
    strand_4: float = effect("N", 0.0, 500.0, "friction of the last strands to break away")
    strand_break: float = assumed(0.02, "1", 0.001, 0.3, "strain at which the last strand slips")


@kernel
def strand_forces(
    rows: Any, fixed: Any, state: int, force: int, break_away: int, strain: Any, friction: Any,
    sticking: Any,
) -> None:  # fmt: skip
    """Add the strands' force [N] and its slope by strain [N] at strains of a tile.

    ``state``, ``force`` and ``break_away`` are the first rows of the slip positions and forces, and
    the row of the strain at which the last strand breaks away.
    """
    for i in range(STRANDS):
        slip, part = rows[state + i], BREAKS[i]
        for j in range(LANES):
            span = part * fixed[break_away][j]
            stiff = fixed[force + i][j] / span
            gap = max(-span, min(span, strain[j] - slip[j]))
            friction[j] = friction[j] + stiff * gap
            sticking[j] = sticking[j] + (stiff if abs(strain[j] - slip[j]) < span else 0.0)


@kernel
def slip_strands(rows: Any, fixed: Any, state: int, break_away: int, strain: Any) -> None:
    """Move the strands' slip positions with the strains of a tile."""
    for i in range(STRANDS):
        slip, part = rows[state + i], BREAKS[i]
        for j in range(LANES):
            span = part * fixed[break_away][j]
            slip[j] = max(strain[j] - span, min(strain[j] + span, slip[j]))


@kernel
def strands_on(fixed: Any, force: int) -> int:
    """Return the number of lanes and strands of a tile with friction."""
    on = 0
    for i in range(STRANDS):
        on = on + count_on(fixed[force + i], 0.0)
    return on
