"""Knee orthosis: the brace alone, and the orthosis on the leg of a walking wearer."""

ENVIRONMENTS = {
    "PAM/KneeTension-v0": "brace:KneeTension",
    "PAM/KneeStiffness-v0": "brace:KneeStiffness",
    "PAM/KneeWalk-v0": "gait:KneeWalk",
    "PAM/KneeStairsUp-v0": "gait:KneeStairsUp",
    "PAM/KneeStairsDown-v0": "gait:KneeStairsDown",
}
"""Module in this folder and class name without ``Env`` or ``VectorEnv``, by id."""
