"""Assistance of a gait: what a step is worth, what it costs the wearer, and when it is over."""

from __future__ import annotations

from dataclasses import dataclass

from pam_envs.kernels.build import kernel
from pam_envs.parameters import parameter


@dataclass(frozen=True)
class GaitAssistance:
    """Weights and limits: tension is tracked in stance, the angle in swing.

    Where the sensed phase is not the true one the reference is that of the wrong phase, and neither
    is rewarded.

    ``reward = reward/tension + reward/angle + reward/over_assistance + reward/effort``.
    """

    tension_weight: float = parameter(
        1.0, "1", 0.0, 1e3, "assumed", "reward per period of stance at an error of tension_scale"
    )
    tension_scale: float = parameter(
        10.0, "N", 1e-3, 1e4, "assumed", "an error of 10 N in stance costs tension_weight"
    )
    angle_weight: float = parameter(
        1.0, "1", 0.0, 1e3, "assumed", "reward per period of swing at an error of angle_scale"
    )
    angle_scale: float = parameter(
        0.0349, "rad", 1e-5, 3.0, "assumed", "an error of 2 degrees in swing costs angle_weight"
    )
    over_weight: float = parameter(
        0.2, "1", 0.0, 1e3, "assumed", "cost of over_scale more torque than the knee asks for"
    )
    over_scale: float = parameter(
        5.0, "N m", 1e-3, 1e3, "assumed", "over-assistance that costs over_weight"
    )
    effort_weight: float = parameter(
        0.2, "1", 0.0, 1e3, "assumed", "cost of moving the set-point over its whole range"
    )
    soft_pressure: float = parameter(
        4.45e5, "Pa", 0.0, 1e7, "derived", "just below the muscle's capacity of 4.5 bar, yeh2010"
    )
    soft_deviation: float = parameter(
        0.1745, "rad", 0.0, 3.0, "assumed", "10 degrees off the wearer's path is uncomfortable"
    )
    highest_tension: float = parameter(
        800.0,
        "N",
        1.0,
        1e5,
        "assumed",
        "more than 4.5 bar give on a bent knee; the strap would slip",
    )
    largest_deviation: float = parameter(
        0.6981, "rad", 0.01, 3.0, "assumed", "40 degrees off the path: the wearer stumbles"
    )


@dataclass(frozen=True)
class BraceTracking:
    """Weights and limits of tracking with the brace alone."""

    tracking_weight: float = parameter(
        1.0, "1", 0.0, 1e3, "assumed", "reward per control period at an error of error_scale"
    )
    error_scale: float = parameter(
        0.02, "1", 1e-6, 10.0, "assumed", "an error of 2 % of the half-range costs tracking_weight"
    )
    effort_weight: float = parameter(
        0.2, "1", 0.0, 1e3, "assumed", "cost of moving the set-point over its whole range"
    )
    soft_pressure: float = parameter(
        4.45e5, "Pa", 0.0, 1e7, "derived", "just below the muscle's capacity of 4.5 bar, yeh2010"
    )
    highest_tension: float = parameter(
        600.0, "N", 1.0, 1e5, "assumed", "well above 355 N at the capacity, rigid rig"
    )


@kernel
def gated_reward(error: float, gate: float, scale: float, weight: float) -> float:
    """Return the reward for a tracking error while ``gate`` is 1: linear, 0 at best."""
    return -weight * gate * abs(error) / scale


@kernel
def over_assistance(torque: float, demand: float) -> float:
    """Return the torque [N m] that the wearer's antagonists have to take up.

    Assistance beyond what the knee asks for, and assistance in flexion while it asks for extension.
    """
    low, high = min(0.0, demand), max(0.0, demand)
    return max(0.0, torque - high) + max(0.0, low - torque)


@kernel
def assistance_wanted(estimate: float, ratio: float, lowest: float) -> float:
    """Return the share of an estimated knee torque [N m] to deliver, not below ``lowest``."""
    return max(lowest, ratio * estimate)
