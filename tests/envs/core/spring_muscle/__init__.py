"""Example of an own family: a muscle that pulls against a spring."""

ENVIRONMENTS = {"Own/SpringMuscle-v0": "env:SpringMuscle"}
"""Module in this folder and class name without ``Env`` or ``VectorEnv``, by id."""
