"""Muscle positioning: a hanging load moved by one pneumatic muscle."""

ENVIRONMENTS = {"PAM/MusclePositioning-v0": "env:MusclePositioning"}
"""Module in this folder and class name without ``Env`` or ``VectorEnv``, by id."""
