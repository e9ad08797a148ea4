"""The orthosis' sensors: load cell, potentiometers, pressure gauge, cells of the shoe.

None of their noise is published; the defaults are of the order seen on public rigs.
"""

from __future__ import annotations

from dataclasses import dataclass

from pam_envs.parameters import parameter

_SEEN = "not published; of the order seen on public rigs"
_NONE = "zeroed at rest"


@dataclass(frozen=True)
class TensionSensor:
    """Load cell in series with the muscle (Omega LC201-300)."""

    noise: float = parameter(0.9, "N", 0.0, 100.0, "assumed", _SEEN, neutral=0.0)
    resolution: float = parameter(0.68, "N", 0.0, 50.0, "assumed", _SEEN, neutral=0.0)
    bias: float = parameter(0.0, "N", -200.0, 200.0, "assumed", _NONE, neutral=0.0)


@dataclass(frozen=True)
class AngleSensor:
    """Potentiometer at a joint."""

    noise: float = parameter(0.0017, "rad", 0.0, 0.2, "assumed", _SEEN, neutral=0.0)
    resolution: float = parameter(0.0008, "rad", 0.0, 0.1, "assumed", _SEEN, neutral=0.0)
    bias: float = parameter(0.0, "rad", -0.5, 0.5, "assumed", _NONE, neutral=0.0)


@dataclass(frozen=True)
class GaugeSensor:
    """Pressure at the muscle."""

    noise: float = parameter(380.0, "Pa", 0.0, 1e5, "assumed", _SEEN, neutral=0.0)
    resolution: float = parameter(770.0, "Pa", 0.0, 1e5, "assumed", _SEEN, neutral=0.0)
    bias: float = parameter(0.0, "Pa", -1e5, 1e5, "assumed", _NONE, neutral=0.0)


@dataclass(frozen=True)
class HeelSensor:
    """Mean of the load cells at the heel."""

    noise: float = parameter(0.2, "kg", 0.0, 20.0, "assumed", _SEEN, neutral=0.0)
    resolution: float = parameter(0.0, "kg", 0.0, 5.0, "assumed", _SEEN, neutral=0.0)
    bias: float = parameter(0.0, "kg", -10.0, 10.0, "assumed", _NONE, neutral=0.0)


@dataclass(frozen=True)
class GroundSensor:
    """Vertical ground force, the sum of the shoe's load cells."""

    noise: float = parameter(5.0, "N", 0.0, 200.0, "assumed", _SEEN, neutral=0.0)
    resolution: float = parameter(0.0, "N", 0.0, 50.0, "assumed", _SEEN, neutral=0.0)
    bias: float = parameter(0.0, "N", -200.0, 200.0, "assumed", _NONE, neutral=0.0)


@dataclass(frozen=True)
class CopSensor:
    """Centre of pressure ahead of the ankle, from the shoe's load cells."""

    noise: float = parameter(0.002, "m", 0.0, 0.1, "assumed", _SEEN, neutral=0.0)
    resolution: float = parameter(0.0, "m", 0.0, 0.05, "assumed", _SEEN, neutral=0.0)
    bias: float = parameter(0.0, "m", -0.1, 0.1, "assumed", _NONE, neutral=0.0)
