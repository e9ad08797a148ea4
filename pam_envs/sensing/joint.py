"""The sensors of an antagonistic joint; their noise is not published."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pam_envs.parameters import assumed, effect
from pam_envs.sensing.sensor import SensorEffects


@dataclass(frozen=True)
class JointEncoder(SensorEffects):
    """Angle at a joint."""

    quantity: ClassVar[tuple[str, float]] = ("rad", 0.2)

    noise: float = assumed(5e-4, "rad", 0.0, 0.2, "0.03 degrees RMS, order seen", neutral=0.0)
    resolution: float = assumed(1.534e-3, "rad", 0.0, 0.1, "encoder of 4096 steps", neutral=0.0)
    bias: float = effect("rad", -0.5, 0.5, "zeroed when straight")
