"""Reward terms and soft-limit costs that tasks share."""

from __future__ import annotations

from pam_envs.kernels.build import kernel
from pam_envs.parameters import assumed


def weight(default: float, meaning: str) -> float:
    """Declare the weight of a reward term as a field of a task."""
    return assumed(default, "1", 0.0, 1e3, meaning)


@kernel
def error_reward(error: float, scale: float, weight: float) -> float:
    """Return the reward for an error: linear, at most 0."""
    return -weight * abs(error) / scale


@kernel
def effort_reward(change: float, full: float, weight: float) -> float:
    """Return the reward for a change of setpoint relative to its range: at most 0."""
    return -weight * abs(change) / full


@kernel
def ended_reward(ended: float, time: float, seconds: float, period: float, worst: float) -> float:
    """Return the reward for the end of an episode at a limit; 0 if ``ended`` is 0.

    This period and all that remain of ``seconds`` count ``-worst``, the lowest possible reward, so
    that a policy never gains by ending an episode, at any discount factor up to 1.
    """
    left = max(0.0, seconds - time) / period + 1.0
    return -worst * left if ended > 0.0 else 0.0


@kernel
def excess(value: float, limit: float) -> float:
    """Return the excess of ``value`` over ``limit``, at least 0."""
    return max(0.0, value - limit)
