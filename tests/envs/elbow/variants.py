"""Keyword arguments that reach the branches of the elbow orthosis."""

from typing import Any

OWN: dict[str, dict[str, dict[str, Any]]] = {
    "PAM/ElbowOrthosis-v0": {
        "pulses": {
            "valves": "on_off",
            "hysteresis": "preisach",
            "randomize": True,
            "motion": "sines",
            "reference": "wall",
            "preview": 3,
        },
        "by_torque": {
            "normalize": False,
            "action": "torque_stiffness",
            "reference": "weight",
            "motion": "mixed",
            "start": "random",
        },
        "samples": {
            "reference": [[0.05 * (k % 200) - 5.0, 0.01 * (k % 900)] for k in range(300)],
            "bear": False,
            "span": (0.4, 1.2),
            "preview": 1,
        },
    },
}
PLAIN: dict[str, dict[str, dict[str, Any]]] = {
    "PAM/ElbowOrthosis-v0": {
        "preisach_random": {"hysteresis": "preisach", "randomize": True, "preview": 0},
        "pulses_plays": {"valves": "on_off", "motion": "mixed", "randomize": True},
        "pulses_none": {"valves": "on_off", "hysteresis": "none", "reference": "wall"},
        "none": {"hysteresis": "none", "normalize": False},
    },
}
