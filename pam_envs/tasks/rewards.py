"""Reward terms and soft-limit costs that tasks share."""

from pam_envs.kernels.build import kernel
from pam_envs.parameters import assumed


def weight(default: float, meaning: str) -> float:
    """Declare the weight of a reward term as a field of a task."""
    return assumed(default, "1", 0.0, 1e3, meaning)


@kernel
def error_reward(error: float, scale: float, weight: float) -> float:
    """Return the reward for an error, or for a change over its range: linear, at most 0."""
    return -weight * abs(error) / scale


@kernel
def excess(value: float, limit: float) -> float:
    """Return the excess of ``value`` over ``limit``, at least 0."""
    return max(0.0, value - limit)
