"""Tracking: what a step is worth, what it costs, and when it is over."""

from __future__ import annotations

from dataclasses import dataclass

from pam_envs.kernels.build import kernel
from pam_envs.parameters import parameter


@dataclass(frozen=True)
class Tracking:
    """Weights and limits of a tracking task (``reward = reward/tracking + reward/effort``)."""

    tracking_weight: float = parameter(
        1.0, "1", 0.0, 1e3, "assumed", "reward per control period at an error of error_scale"
    )
    error_scale: float = parameter(
        1e-3, "m", 1e-6, 1.0, "assumed", "an error of 1 mm costs tracking_weight"
    )
    effort_weight: float = parameter(
        0.2, "1", 0.0, 1e3, "assumed", "cost of moving the set-point over its whole range"
    )
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


@kernel
def tracking_reward(error: float, scale: float, weight: float) -> float:
    """Return the reward for a tracking error: linear, 0 at best."""
    return -weight * abs(error) / scale


@kernel
def effort_reward(change: float, full: float, weight: float) -> float:
    """Return the reward for a change of set-point: 0 at best."""
    return -weight * abs(change) / full


@kernel
def ended_reward(ended: float, time: float, seconds: float, period: float, worst: float) -> float:
    """Return the reward of a period in which a limit may have ended the episode, 0 if none has.

    As if this period and all that are left of ``seconds`` had cost ``worst``, the most that one
    can: to go on is never worse, at no discount up to 1.
    """
    left = max(0.0, seconds - time) / period + 1.0
    return -worst * left if ended > 0.0 else 0.0


@kernel
def excess(value: float, limit: float) -> float:
    """Return by how much ``value`` exceeds ``limit``."""
    return max(0.0, value - limit)
