"""Elbow orthosis: torque and stiffness of virtual objects at the wearer's elbow."""

ENVIRONMENTS = {"PAM/ElbowOrthosis-v0": "env:ElbowOrthosis"}
"""Module in this folder and class name without ``Env`` or ``VectorEnv``, by id."""
