"""Keyword arguments that reach the branches of the redundant manipulator."""

from typing import Any

import numpy as np

from pam_envs.mechanics.serial_chain.chain import SerialChain
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator

BENT = RedundantManipulator.paper().chain
LINE = np.linspace(0.1, 0.25, 9)[:, None] * np.array([1.0, -1.0, 1.0, 1.0, -1.0, 1.0])
"""Poses of a path along which all joints turn."""
SHORT = SerialChain.uniform("xyxyz", length=0.2, mass=0.1)
SHORT_PATH = SHORT.pose(0.15 + LINE[:, :5]).tolist()
"""An arm of five joints, the last of which turns the tool about itself, and a path for it."""

OWN: dict[str, dict[str, dict[str, Any]]] = {
    "PAM/RedundantManipulator-v0": {
        "pressures": {
            "action": "pressures",
            "reference": "path_3",
            "payload": [0.0, 0.01, 0.02],
            "payload_change": 0.01,
            "plan": False,
            "preview": 0,
        },
        "poses": {"reference": BENT.pose(LINE).tolist(), "normalize": False, "preview": 1},
    },
}
PLAIN: dict[str, dict[str, dict[str, Any]]] = {
    "PAM/RedundantManipulator-v0": {
        "preisach": {"hysteresis": "preisach", "weighted": False, "reference": "path_1"},
        "short": {"plant": RedundantManipulator.paper("none", SHORT), "reference": SHORT_PATH},
    },
}
LIVELY: dict[str, dict[str, Any]] = {"PAM/RedundantManipulator-v0": {"payload": None}}
