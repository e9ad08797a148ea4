"""Redundant manipulator: an arm of six antagonistic joints."""

ENVIRONMENTS = {"PAM/RedundantManipulator-v0": "env:RedundantManipulator"}
"""Module in this folder and class name without ``Env`` or ``VectorEnv``, by id."""
