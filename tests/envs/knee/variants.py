"""Keyword arguments that reach the branches of the knee orthosis."""

from typing import Any

from pam_envs.plants.knee_orthosis.plant import KneeOrthosis

OWN: dict[str, dict[str, dict[str, Any]]] = {
    "PAM/KneeTension-v0": {
        "preisach_random": {"hysteresis": "preisach", "randomize": True, "preview": 0},
        "measured": {"plant": KneeOrthosis.no_load(dynamics="measured"), "reference": "mixed"},
        "paper": {"start": "paper", "frequency": 0.5},
    },
    "PAM/KneeStiffness-v0": {"samples": {"reference": [20.0 * (k % 300) for k in range(600)]}},
    "PAM/KneeWalk-v0": {
        "quick": {"pace": "normal", "assistance": "clipped", "mismatch": 10.0, "ratio": 0.3},
        "demand": {"reference": "demand", "start": "heel_contact", "preview": 0},
        "samples": {"reference": [0.1 * (k % 100) for k in range(300)], "preview": 20},
    },
}
PLAIN: dict[str, dict[str, dict[str, Any]]] = {
    "PAM/KneeTension-v0": {"none": {"hysteresis": "none", "normalize": False}},
    "PAM/KneeStiffness-v0": {
        "preisach_random": {"hysteresis": "preisach", "randomize": True, "preview": 0},
        "none": {"hysteresis": "none", "normalize": False},
    },
    "PAM/KneeWalk-v0": {
        "preisach_random": {"hysteresis": "preisach", "randomize": True, "preview": 0},
        "none": {"hysteresis": "none", "normalize": False},
    },
    "PAM/KneeStairsUp-v0": {
        "preisach_random": {"hysteresis": "preisach", "randomize": True, "preview": 0}
    },
    "PAM/KneeStairsDown-v0": {"none": {"hysteresis": "none", "normalize": False}},
}
