"""Tracking of a contraction: weights of the reward, soft and hard limits."""

from dataclasses import dataclass

from pam_envs.parameters import assumed, derived, published
from pam_envs.tasks.rewards import weight


@dataclass(frozen=True)
class Tracking:
    """Weights and limits of a tracking task (``reward = reward/tracking + reward/effort``)."""

    tracking_weight: float = weight(1.0, "reward per control period at an error of error_scale")
    error_scale: float = assumed(1e-3, "m", 1e-6, 1.0, "an error of 1 mm costs tracking_weight")
    effort_weight: float = weight(0.2, "cost of moving the setpoint over its whole range")
    soft_contraction: float = derived(0.016, "m", 0.0, 1.0, "above the largest measured, 15.1 mm")
    soft_pressure: float = assumed(5.9e5, "Pa", 0.0, 1e7, "below the regulator's limit of 6 bar")
    lowest_contraction: float = assumed(-0.01, "m", -1.0, 0.0, "a stretch by a tenth of the length")
    highest_contraction: float = published(0.02, "m", 0.0, 1.0, "positioning2021, Table 1")
