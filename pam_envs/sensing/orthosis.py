"""The orthosis' sensors: load cell, potentiometers, pressure gauge, cells of the shoe.

None of their noise is published; the defaults are of the order seen on public rigs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pam_envs.parameters import assumed, effect
from pam_envs.sensing.sensor import SensorEffects

_SEEN = "not published; of the order seen on public rigs"
_NONE = "zeroed at rest"


@dataclass(frozen=True)
class TensionSensor(SensorEffects):
    """Load cell in series with the muscle (Omega LC201-300)."""

    quantity: ClassVar[tuple[str, float]] = ("N", 50.0)

    noise: float = assumed(0.9, "N", 0.0, 100.0, _SEEN, neutral=0.0)
    resolution: float = assumed(0.68, "N", 0.0, 50.0, _SEEN, neutral=0.0)
    bias: float = effect("N", -200.0, 200.0, _NONE)


@dataclass(frozen=True)
class AngleSensor(SensorEffects):
    """Potentiometer at a joint."""

    quantity: ClassVar[tuple[str, float]] = ("rad", 0.2)

    noise: float = assumed(0.0017, "rad", 0.0, 0.2, _SEEN, neutral=0.0)
    resolution: float = assumed(0.0008, "rad", 0.0, 0.1, _SEEN, neutral=0.0)
    bias: float = effect("rad", -0.5, 0.5, _NONE)


@dataclass(frozen=True)
class GaugeSensor(SensorEffects):
    """Pressure at the muscle."""

    quantity: ClassVar[tuple[str, float]] = ("Pa", 1e5)

    noise: float = assumed(380.0, "Pa", 0.0, 1e5, _SEEN, neutral=0.0)
    resolution: float = assumed(770.0, "Pa", 0.0, 1e5, _SEEN, neutral=0.0)
    bias: float = effect("Pa", -1e5, 1e5, _NONE)


@dataclass(frozen=True)
class HeelSensor(SensorEffects):
    """Mean of the load cells at the heel."""

    quantity: ClassVar[tuple[str, float]] = ("kg", 10.0)

    noise: float = assumed(0.2, "kg", 0.0, 20.0, _SEEN, neutral=0.0)
    resolution: float = effect("kg", 0.0, 5.0, _SEEN)
    bias: float = effect("kg", -10.0, 10.0, _NONE)


@dataclass(frozen=True)
class GroundSensor(SensorEffects):
    """Vertical ground force, the sum of the shoe's load cells."""

    quantity: ClassVar[tuple[str, float]] = ("N", 200.0)

    noise: float = assumed(5.0, "N", 0.0, 200.0, _SEEN, neutral=0.0)
    resolution: float = effect("N", 0.0, 50.0, _SEEN)
    bias: float = effect("N", -200.0, 200.0, _NONE)


@dataclass(frozen=True)
class CopSensor(SensorEffects):
    """Centre of pressure ahead of the ankle, from the shoe's load cells."""

    quantity: ClassVar[tuple[str, float]] = ("m", 0.1)

    noise: float = assumed(0.002, "m", 0.0, 0.1, _SEEN, neutral=0.0)
    resolution: float = effect("m", 0.0, 0.05, _SEEN)
    bias: float = effect("m", -0.1, 0.1, _NONE)
