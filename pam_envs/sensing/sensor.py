"""A sensor: bias, white noise, quantisation."""

from __future__ import annotations

from dataclasses import dataclass

from pam_envs.kernels import kernel, quantise
from pam_envs.parameters import parameter


@dataclass(frozen=True)
class PositionSensor:
    """Displacement sensor on the free end."""

    noise: float = parameter(
        3e-5, "m", 0.0, 1e-2, "assumed", "0.03 mm RMS; 0.02-0.05 mm seen", neutral=0.0
    )
    resolution: float = parameter(
        1e-5, "m", 0.0, 1e-3, "assumed", "0.01 mm; 0.049 mm on one public rig", neutral=0.0
    )
    bias: float = parameter(0.0, "m", -0.05, 0.05, "assumed", "zeroed at rest", neutral=0.0)


@dataclass(frozen=True)
class PressureSensor:
    """Gauge pressure sensor at the muscle."""

    noise: float = parameter(
        800.0, "Pa", 0.0, 1e5, "assumed", "0.008 bar RMS; 0.4-8 kPa on public rigs", neutral=0.0
    )
    resolution: float = parameter(
        450.0, "Pa", 0.0, 1e5, "assumed", "0.45 kPa on one public rig", neutral=0.0
    )
    bias: float = parameter(0.0, "Pa", -1e5, 1e5, "assumed", "zeroed at rest", neutral=0.0)


@kernel
def read_sensor(value: float, noise: float, resolution: float, bias: float, normal: float) -> float:
    """Return the reading of a true ``value``, given one standard normal number."""
    return quantise(value + bias + noise * normal, resolution)
