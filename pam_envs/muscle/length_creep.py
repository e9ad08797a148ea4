"""Creep of a muscle's length: compliances of Kelvin-Voigt elements (see ``hysteresis.creep``)."""

from __future__ import annotations

from dataclasses import dataclass

from pam_envs.parameters import parameter


@dataclass(frozen=True, kw_only=True)
class LengthCreepEffects:
    """Creep of the length with the time constants of the hysteresis, none unless shown."""

    creep_1: float = parameter(
        0.0, "1", -0.5, 2.0, "assumed", "length that follows at creep_time_1", neutral=0.0
    )
    creep_2: float = parameter(
        0.0, "1", -0.5, 2.0, "assumed", "length that follows at creep_time_2", neutral=0.0
    )
    creep_3: float = parameter(
        0.0, "1", -0.5, 2.0, "assumed", "length that follows at creep_time_3", neutral=0.0
    )
    creep_4: float = parameter(
        0.0, "1", -0.5, 2.0, "assumed", "length that follows at creep_time_4", neutral=0.0
    )
