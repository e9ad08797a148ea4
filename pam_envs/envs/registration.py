"""Registration of the environments on ``import pam_envs``."""

from __future__ import annotations

import gymnasium as gym

NAMESPACE = "PAM/"
ENVIRONMENTS = {
    "PAM/MusclePositioning-v0": "positioning.env:MusclePositioning",
    "PAM/KneeTension-v0": "knee.brace:KneeTension",
    "PAM/KneeStiffness-v0": "knee.brace:KneeStiffness",
    "PAM/KneeWalk-v0": "knee.gait:KneeWalk",
    "PAM/KneeStairsUp-v0": "knee.gait:KneeStairsUp",
    "PAM/KneeStairsDown-v0": "knee.gait:KneeStairsDown",
    "PAM/ElbowOrthosis-v0": "elbow.env:ElbowOrthosis",
    "PAM/AntagonisticJoint-v0": "joint.env:AntagonisticJoint",
    "PAM/RedundantManipulator-v0": "manipulator.env:RedundantManipulator",
}
"""Module in this folder, and what stands before ``Env`` and ``VectorEnv`` in its classes' names."""


def register_all() -> None:
    """Register every environment with Gymnasium, once."""
    for name, place in ENVIRONMENTS.items():
        if name in gym.registry:
            continue
        gym.register(
            name,
            entry_point=f"pam_envs.envs.{place}Env",
            vector_entry_point=f"pam_envs.envs.{place}VectorEnv",
            order_enforce=False,  # the environment itself asks for reset() before step()
            disable_env_checker=True,  # the checks run in the tests, not in every user's steps
        )


def full_id(name: str) -> str:
    """Return an id with its namespace, which may be left out: PAM/KneeWalk-v0 of KneeWalk-v0."""
    return name if "/" in name else f"{NAMESPACE}{name}"
