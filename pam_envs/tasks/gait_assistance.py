"""Gait assistance: weights of the reward, soft and hard limits, desired assistance."""

from dataclasses import dataclass

from pam_envs.kernels.build import kernel
from pam_envs.parameters import assumed, derived
from pam_envs.tasks.rewards import weight


@dataclass(frozen=True)
class GaitAssistance:
    """Weights and limits: tension is tracked in stance, the angle in swing.

    While the sensed phase differs from the true one, the reference is that of the wrong phase, and
    neither term applies.

    ``reward = reward/tension + reward/angle + reward/over_assistance + reward/effort``.
    """

    tension_weight: float = weight(1.0, "reward per period of stance at an error of tension_scale")
    tension_scale: float = assumed(10.0, "N", 1e-3, 1e4, "stance error that costs tension_weight")
    angle_weight: float = weight(1.0, "reward per period of swing at an error of angle_scale")
    angle_scale: float = assumed(0.0349, "rad", 1e-5, 3.0, "swing error that costs angle_weight")
    over_weight: float = weight(0.2, "cost of over_scale more torque than the knee demands")
    over_scale: float = assumed(5.0, "N m", 1e-3, 1e3, "over-assistance that costs over_weight")
    effort_weight: float = weight(0.2, "cost of moving the setpoint over its whole range")
    soft_pressure: float = derived(4.45e5, "Pa", 0.0, 1e7, "below the capacity of 4.5 bar, yeh2010")
    soft_deviation: float = assumed(0.1745, "rad", 0.0, 3.0, "10 degrees off the path: discomfort")
    highest_tension: float = assumed(800.0, "N", 1.0, 1e5, "the strap slips; beyond 4.5 bar")
    largest_deviation: float = assumed(0.6981, "rad", 0.01, 3.0, "40 degrees off path: stumbling")


@dataclass(frozen=True)
class BraceTracking:
    """Weights and limits of tracking with the brace alone."""

    tracking_weight: float = weight(1.0, "reward per control period at an error of error_scale")
    error_scale: float = assumed(0.02, "1", 1e-6, 10.0, "error that costs tracking_weight")
    effort_weight: float = weight(0.2, "cost of moving the setpoint over its whole range")
    soft_pressure: float = derived(4.45e5, "Pa", 0.0, 1e7, "below the capacity of 4.5 bar, yeh2010")
    highest_tension: float = assumed(600.0, "N", 1.0, 1e5, "above 355 N at the capacity, rigid rig")


@kernel
def over_assistance(torque: float, demand: float) -> float:
    """Return the assistance [N m] beyond the demand, or in the wrong direction."""
    low, high = min(0.0, demand), max(0.0, demand)
    return max(0.0, torque - high) + max(0.0, low - torque)


@kernel
def desired_assistance(estimate: float, ratio: float, lowest: float) -> float:
    """Return the share of an estimated knee torque [N m] to deliver, not below ``lowest``."""
    return max(lowest, ratio * estimate)
