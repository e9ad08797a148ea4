"""The pressure regulators of an antagonistic joint."""

from __future__ import annotations

from dataclasses import dataclass

from pam_envs.parameters import assumed, derived
from pam_envs.pneumatics.regulator import DelayedEffects


@dataclass(frozen=True)
class JointRegulator(DelayedEffects):
    """A proportional regulator for each muscle: a first-order lag with a limited rate."""

    max_pressure: float = assumed(6.5e5, "Pa", 1e4, 1.2e6, "highest of the measured force map")
    time_constant: float = derived(
        1.0 / 23.0,
        "s",
        0.002,
        2.0,
        "one of two poles, fluidic_muscles, Fig. 12",
        spread=(0.03, 0.06),
    )
    slew_rate: float = assumed(1e9, "Pa/s", 1e4, 1e9, "not published; no limit", neutral=1e9)
