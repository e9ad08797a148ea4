"""Environment ids by family, for the entries of the catalogue."""

from __future__ import annotations

from collections.abc import Mapping

POSITIONING = ("PAM/MusclePositioning-v0",)
BRACE = ("PAM/KneeTension-v0", "PAM/KneeStiffness-v0")
GAIT = ("PAM/KneeWalk-v0", "PAM/KneeStairsUp-v0", "PAM/KneeStairsDown-v0")
KNEE = (*BRACE, *GAIT)
ELBOW = ("PAM/ElbowOrthosis-v0",)
ARM = ("PAM/RedundantManipulator-v0",)
JOINT = ("PAM/AntagonisticJoint-v0", *ARM)

SUFFIXES: Mapping[str, str] = {
    "PAM/KneeTension-v0": "tension",
    "PAM/KneeStiffness-v0": "stiffness",
    "PAM/KneeWalk-v0": "walk",
    "PAM/KneeStairsUp-v0": "stairs_up",
    "PAM/KneeStairsDown-v0": "stairs_down",
    "PAM/AntagonisticJoint-v0": "joint",
    "PAM/RedundantManipulator-v0": "arm",
}
"""Suffix of a tuned controller's name, for controllers that run in several environments."""
