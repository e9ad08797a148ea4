"""Effect of the temperature on a muscle's effective pressure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pam_envs.constants import ROOM_TEMPERATURE
from pam_envs.kernels.build import kernel
from pam_envs.parameters import parameter


@dataclass(frozen=True, kw_only=True)
class TemperatureEffects:
    """Temperature of a muscle; without effect unless a recording shows one."""

    effects: ClassVar[tuple[tuple[str, ...], ...]] = (("temperature", "temperature_gain"),)

    temperature: float = parameter(
        ROOM_TEMPERATURE, "K", 230.0, 400.0, "assumed", "of the muscle; the law is that of 293.15 K"
    )
    temperature_gain: float = parameter(
        0.0, "1/K", -0.05, 0.05, "assumed", "effective pressure gained per kelvin", neutral=0.0
    )


@kernel
def temperature_factor(kelvin: float, gain: float) -> float:
    """Return the effective pressure at a temperature [K] over that at room temperature."""
    return 1.0 + gain * (kelvin - ROOM_TEMPERATURE)
