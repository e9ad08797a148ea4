"""Creep of a muscle's length: compliances of Kelvin-Voigt elements (see ``hysteresis.creep``)."""

from __future__ import annotations

from dataclasses import dataclass

from pam_envs.parameters import effect


@dataclass(frozen=True, kw_only=True)
class LengthCreepEffects:
    """Creep of the length with the time constants of the hysteresis."""

    creep_1: float = effect("1", -0.5, 2.0, "length that follows at creep_time_1")
    creep_2: float = effect("1", -0.5, 2.0, "length that follows at creep_time_2")
    creep_3: float = effect("1", -0.5, 2.0, "length that follows at creep_time_3")
    creep_4: float = effect("1", -0.5, 2.0, "length that follows at creep_time_4")
