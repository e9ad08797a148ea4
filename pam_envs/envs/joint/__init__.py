"""Antagonistic joint: one joint between two pneumatic muscles."""

ENVIRONMENTS = {"PAM/AntagonisticJoint-v0": "env:AntagonisticJoint"}
"""Module in this folder and class name without ``Env`` or ``VectorEnv``, by id."""
