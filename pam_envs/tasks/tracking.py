"""Tracking of a contraction: weights of the reward, soft and hard limits."""

from __future__ import annotations

from dataclasses import dataclass

from pam_envs.parameters import parameter
from pam_envs.tasks.rewards import weight


@dataclass(frozen=True)
class Tracking:
    """Weights and limits of a tracking task (``reward = reward/tracking + reward/effort``)."""

    tracking_weight: float = weight(1.0, "reward per control period at an error of error_scale")
    error_scale: float = parameter(
        1e-3, "m", 1e-6, 1.0, "assumed", "an error of 1 mm costs tracking_weight"
    )
    effort_weight: float = weight(0.2, "cost of moving the set-point over its whole range")
    soft_contraction: float = parameter(
        0.016, "m", 0.0, 1.0, "derived", "over the largest measured contraction, 15.1 mm"
    )
    soft_pressure: float = parameter(
        5.9e5, "Pa", 0.0, 1e7, "assumed", "just below the regulator's limit of 6 bar"
    )
    lowest_contraction: float = parameter(
        -0.01, "m", -1.0, 0.0, "assumed", "a stretch by a tenth of the length"
    )
    highest_contraction: float = parameter(
        0.02, "m", 0.0, 1.0, "published", "positioning2021, Table 1: axial contraction max. 20 mm"
    )
