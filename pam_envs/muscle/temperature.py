"""Effect of the temperature on a muscle's effective pressure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pam_envs.constants import ROOM_TEMPERATURE
from pam_envs.kernels.build import kernel
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
