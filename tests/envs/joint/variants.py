"""Keyword arguments that reach the branches of the antagonistic joint."""

from typing import Any

from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint

OWN: dict[str, dict[str, dict[str, Any]]] = {
    "PAM/AntagonisticJoint-v0": {
        "pressures": {
            "action": "pressures",
            "reference": "mixed",
            "payload": None,
            "payload_change": 0.5,
            "disturbance": 3.0,
        },
        "stiffness": {
            "action": "angle_stiffness",
            "hysteresis": "preisach",
            "randomize": True,
            "reference": "sine",
            "preview": 0,
        },
        "reduced": {"plant": AntagonisticJoint.reduced(), "reference": "step"},
        "measured": {
            "plant": AntagonisticJoint.measured(),
            "reference": [0.001 * (k // 20 % 300) for k in range(300)],
            "normalize": False,
        },
    },
}
PLAIN: dict[str, dict[str, dict[str, Any]]] = {
    "PAM/AntagonisticJoint-v0": {
        "reduced_preisach": {"plant": AntagonisticJoint.reduced("preisach"), "randomize": True},
        "none": {"hysteresis": "none", "start": "straight"},
    },
}
LIVELY: dict[str, dict[str, Any]] = {"PAM/AntagonisticJoint-v0": {"payload": None}}
