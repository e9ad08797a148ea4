"""Tracking with antagonistic joints: weights of the reward and soft limits."""

from dataclasses import dataclass

from pam_envs.parameters import assumed
from pam_envs.tasks.rewards import weight


@dataclass(frozen=True)
class JointTracking:
    """Weights and limits of one joint.

    ``reward = reward/tracking + reward/effort + reward/ended``.
    """

    tracking_weight: float = weight(1.0, "reward per control period at an error of error_scale")
    error_scale: float = assumed(0.01745, "rad", 1e-5, 3.0, "error that costs tracking_weight")
    effort_weight: float = weight(0.2, "cost of moving both pressures over their whole range")
    soft_share: float = assumed(0.95, "1", 0.1, 1.0, "share of the joint limit without cost")
    soft_pressure: float = assumed(6.4e5, "Pa", 0.0, 1e7, "below the largest pressure of 6.5 bar")

    def worst(self, largest_error: float) -> float:
        """Return the largest cost of a control period with errors up to this one [rad]."""
        return self.tracking_weight * largest_error / self.error_scale + self.effort_weight


@dataclass(frozen=True)
class PathTracking:
    """Weights and limits of path tracking with the tool of a chain of joints.

    ``reward = reward/position + reward/pointing + reward/effort + reward/ended``.
    """

    position_weight: float = weight(1.0, "reward per control period at position_scale")
    position_scale: float = assumed(0.02, "m", 1e-5, 10.0, "error that costs position_weight")
    pointing_weight: float = weight(0.5, "reward per control period at pointing_scale")
    pointing_scale: float = assumed(0.03491, "1", 1e-5, 3.0, "2 degrees that cost pointing_weight")
    effort_weight: float = weight(0.2, "cost of moving all pressures over their whole range")
    soft_share: float = assumed(0.95, "1", 0.1, 1.0, "share of the joint limit without cost")
    soft_pressure: float = assumed(6.4e5, "Pa", 0.0, 1e7, "below the largest pressure of 6.5 bar")

    def worst(self, reach: float) -> float:
        """Return the largest cost of a control period for an arm of this length [m]."""
        off = self.position_weight * 2.0 * reach / self.position_scale
        return off + self.pointing_weight * 2.0 / self.pointing_scale + self.effort_weight
