"""The proportional regulator of a bundle: a first-order lag with a limited rate."""

from __future__ import annotations

from dataclasses import dataclass

from pam_envs.parameters import assumed, published
from pam_envs.pneumatics.regulator import DelayedEffects


@dataclass(frozen=True)
class BundleRegulator(DelayedEffects):
    """A closed-loop pressure regulator in the place of the paper's valves."""

    max_pressure: float = published(6e5, "Pa", 1e4, 1.2e6, "largest: chakarov2018, section 2")
    time_constant: float = assumed(
        0.05, "s", 0.002, 2.0, "of its class; see regulator.py", spread=(0.035, 0.12)
    )
    slew_rate: float = assumed(
        1.5e6, "Pa/s", 1e4, 1e9, "200 l/min into seven muscles", neutral=1e9, spread=(0.8e6, 3e6)
    )
