"""Viscous friction of a muscle that falls with speed (shear thinning)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pam_envs.kernels.build import kernel
from pam_envs.parameters import assumed, effect


@dataclass(frozen=True, kw_only=True)
class ViscosityEffects:
    """Damping at small speeds."""

    viscosity: float = effect("N s/m", 0.0, 1e5, "damping at small speed beside the mass's")
    viscosity_speed: float = assumed(0.02, "m/s", 1e-4, 10.0, "speed that lowers it by 1 / sqrt(2)")


@kernel
def viscous_damping(viscosity: float, speed: float, pace: float) -> float:
    """Return the damping [N s/m] at a speed [m/s]."""
    return viscosity / math.sqrt(1.0 + abs(speed) / pace)
