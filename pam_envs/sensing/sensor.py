"""A sensor: bias, white noise, quantisation."""

from __future__ import annotations

from dataclasses import dataclass

from pam_envs.kernels.arithmetic import quantise
from pam_envs.kernels.build import kernel
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
    # effects, neutral unless a recording shows them
    drift: float = parameter(0.0, "m/s", -0.02, 0.02, "assumed", "at the start", neutral=0.0)
    drift_time: float = parameter(1e4, "s", 1.0, 1e4, "assumed", "time in which the drift settles")
    ramp: float = parameter(0.0, "m", -0.02, 0.02, "assumed", "drift that ends", neutral=0.0)
    ramp_at: float = parameter(0.0, "s", 0.0, 1e6, "assumed", "its middle")
    ramp_over: float = parameter(60.0, "s", 1.0, 1e6, "assumed", "how long it takes")
    delay: float = parameter(0.0, "s", 0.0, 0.14, "assumed", "of the reading", neutral=0.0)
    bow: float = parameter(
        0.0, "1", -0.5, 0.5, "assumed", "parabola over full scale, 15 % contraction", neutral=0.0
    )
    slip: float = parameter(0.0, "m", -0.02, 0.02, "assumed", "step of a clamp", neutral=0.0)
    slip_at: float = parameter(0.0, "s", 0.0, 1e6, "assumed", "when it slipped")


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
    # effects, neutral unless a recording shows them
    drift: float = parameter(0.0, "Pa/s", -1e5, 1e5, "assumed", "at the start", neutral=0.0)
    drift_time: float = parameter(1e4, "s", 1.0, 1e4, "assumed", "time in which the drift settles")
    ramp: float = parameter(0.0, "Pa", -1e5, 1e5, "assumed", "drift that ends", neutral=0.0)
    ramp_at: float = parameter(0.0, "s", 0.0, 1e6, "assumed", "its middle")
    ramp_over: float = parameter(60.0, "s", 1.0, 1e6, "assumed", "how long it takes")
    bow: float = parameter(0.0, "1", -0.5, 0.5, "assumed", "parabola over full scale", neutral=0.0)


@kernel
def read_sensor(value: float, noise: float, resolution: float, bias: float, normal: float) -> float:
    """Return the reading of a true ``value``, given one standard normal number."""
    return quantise(value + bias + noise * normal, resolution)
