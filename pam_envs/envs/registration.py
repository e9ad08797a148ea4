"""Registration of the environments on ``import pam_envs``."""

from __future__ import annotations

import gymnasium as gym


def register_all() -> None:
    """Register every environment with Gymnasium, once."""
    if "PAM/MusclePositioning-v0" in gym.registry:
        return
    gym.register(
        "PAM/MusclePositioning-v0",
        entry_point="pam_envs.envs.muscle_positioning:MusclePositioningEnv",
        vector_entry_point="pam_envs.envs.muscle_positioning:MusclePositioningVectorEnv",
        order_enforce=False,  # the environment itself asks for reset() before step()
        disable_env_checker=True,  # the checks run in the tests, not in every step of every user
    )
