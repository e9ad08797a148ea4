"""The sensors of an antagonistic joint; their noise is not published."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pam_envs.parameters import parameter
from pam_envs.sensing.sensor import SensorEffects


@dataclass(frozen=True)
class JointEncoder(SensorEffects):
    """Angle at a joint."""

    quantity: ClassVar[tuple[str, float]] = ("rad", 0.2)

    noise: float = parameter(
        5e-4, "rad", 0.0, 0.2, "assumed", "0.03 degrees RMS, of the order seen", neutral=0.0
    )
    resolution: float = parameter(
        1.534e-3, "rad", 0.0, 0.1, "assumed", "an encoder of 4096 steps a turn", neutral=0.0
    )
    bias: float = parameter(0.0, "rad", -0.5, 0.5, "assumed", "zeroed when straight", neutral=0.0)
