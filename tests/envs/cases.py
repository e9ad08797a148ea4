"""Every registered environment, and keyword arguments that reach its branches."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np

import pam_envs  # noqa: F401 (registers)
from pam_envs.kernels.build import COMPILED
from pam_envs.mechanics.serial_chain import SerialChain
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.plants.single_muscle.plant import SingleMuscle

IDS = sorted(name for name in gym.registry if name.startswith("PAM/"))

EVERY_EFFECT = {
    "regulator.gain": 0.97,
    "regulator.slew_bend": 0.5,
    "regulator.dead_band": 2e3,
    "regulator.dead_close": 0.4,
    "regulator.overlap": 1e3,
    "regulator.overlap_leak": 0.02,
    "regulator.exhaust_ratio": 1.3,
    "regulator.exhaust_taper": 0.5,
    "regulator.exhaust_rate": 8.0,
    "regulator.leak": 0.02,
    "regulator.supply_pressure": 6.3e5,
    "regulator.supply_droop": 0.2,
    "regulator.supply_time": 0.08,
    "regulator.ring_share": 0.1,
    "regulator.ring_flow": 0.05,
    "hysteresis.shape": 1.3,
    "hysteresis.pressure_slope": 0.2,
    "hysteresis.pressure_bend": -0.1,
    "hysteresis.creep_1": 0.02,
    "hysteresis.first_width": 0.2,
    "hysteresis.first_loss": 0.01,
    "hysteresis.threshold": 5e3,
    "muscle.area_curve": 0.5,
    "muscle.temperature": 300.0,
    "muscle.temperature_gain": 0.002,
    "muscle.load_curve": 2.0,
    "muscle.load_stiffening": 1e-3,
    "muscle.load_stiffening_root": 2e-3,
    "muscle.creep_2": 0.02,
    "muscle.strand_2": 3.0,
    "muscle.strand_4": 2.0,
    "muscle.viscosity": 200.0,
    "mass.load_error": 0.1,
    "mass.slack": 1e-3,
    "mass.stick": 3.0,
    "mass.ring_share": 0.05,
    "position.drift": 1e-6,
    "position.ramp": 1e-4,
    "position.delay": 0.013,
    "position.bow": 0.01,
    "position.slip": 1e-4,
    "position.slip_at": 0.3,
    "pressure.drift": 10.0,
    "pressure.bow": 0.01,
}
"""What a recording may show, all at once."""

COMMON: dict[str, dict[str, Any]] = {
    "default": {},
    "random": {"randomize": True, "preview": 2, "preview_stride": 7},
}
"""Arguments that every environment takes, with which every one has to pass."""

PREISACH = {"hysteresis": "preisach", "randomize": True, "preview": 0}
NONE = {"hysteresis": "none", "normalize": False}

BENT = RedundantManipulator.paper().chain
LINE = np.linspace(0.1, 0.25, 9)[:, None] * np.array([1.0, -1.0, 1.0, 1.0, -1.0, 1.0])
"""Poses of a path along which all joints turn."""

OWN: dict[str, dict[str, dict[str, Any]]] = {
    "PAM/MusclePositioning-v0": {
        "preisach": {"hysteresis": "preisach"},
        "preisach_random": PREISACH,
        "loads": {
            "randomize": True,
            "load": None,
            "reference": "mixed",
            "load_disturbance": 1.0,
        },
        "effects": {"plant": SingleMuscle.mas10().replace(EVERY_EFFECT)},
        "staircase": {"hysteresis": "preisach", "randomize": True, "reference": "staircase"},
        "samples": {
            "reference": [0.001 * (k // 20 % 13) for k in range(300)],
            "preview": 3,
            "preview_stride": 2,
        },
    },
    "PAM/KneeTension-v0": {
        "preisach_random": PREISACH,
        "measured": {"plant": KneeOrthosis.no_load(dynamics="measured"), "reference": "mixed"},
        "paper": {"start": "paper", "frequency": 0.5},
    },
    "PAM/KneeStiffness-v0": {"samples": {"reference": [20.0 * (k % 300) for k in range(600)]}},
    "PAM/KneeWalk-v0": {
        "quick": {"pace": "normal", "assistance": "clipped", "mismatch": 10.0, "ratio": 0.3},
        "demand": {"reference": "demand", "start": "heel_contact", "preview": 0},
        "samples": {"reference": [0.1 * (k % 100) for k in range(300)], "preview": 20},
    },
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
"""Arguments of its own that reach further branches of an environment."""

SHORT = SerialChain.uniform("xyxyz", length=0.2, mass=0.1)
SHORT_PATH = SHORT.pose(0.15 + LINE[:, :5]).tolist()
"""An arm of five joints, the last of which turns the tool about itself, and a path for it."""

PLAIN: dict[str, dict[str, dict[str, Any]]] = {
    "PAM/MusclePositioning-v0": {"none": NONE},
    "PAM/KneeTension-v0": {"none": NONE},
    "PAM/KneeStiffness-v0": {"preisach_random": PREISACH, "none": NONE},
    "PAM/KneeWalk-v0": {"preisach_random": PREISACH, "none": NONE},
    "PAM/KneeStairsUp-v0": {"preisach_random": PREISACH},
    "PAM/KneeStairsDown-v0": {"none": NONE},
    "PAM/ElbowOrthosis-v0": {
        "preisach_random": PREISACH,
        "pulses_plays": {"valves": "on_off", "motion": "mixed", "randomize": True},
        "pulses_none": {"valves": "on_off", "hysteresis": "none", "reference": "wall"},
        "none": NONE,
    },
    "PAM/AntagonisticJoint-v0": {
        "reduced_preisach": {"plant": AntagonisticJoint.reduced("preisach"), "randomize": True},
        "none": {"hysteresis": "none", "start": "straight"},
    },
    "PAM/RedundantManipulator-v0": {
        "preisach": {"hysteresis": "preisach", "weighted": False, "reference": "path_1"},
        "short": {"plant": RedundantManipulator.paper("none", SHORT), "reference": SHORT_PATH},
    },
}
"""What runs uncompiled only: each hysteresis, mounting and regulator is machine code of its own, half a
minute to make, and a mounting is compiled with another hysteresis already."""

LIVELY: dict[str, dict[str, Any]] = {
    "PAM/MusclePositioning-v0": {"load": None},
    "PAM/AntagonisticJoint-v0": {"payload": None},
    "PAM/RedundantManipulator-v0": {"payload": None},
}
"""Arguments under which no entry of the observation stays the same over episodes."""

ALWAYS = {name: {**COMMON, **OWN.get(name, {})} for name in IDS}
VARIANTS = {name: {**ALWAYS[name], **({} if COMPILED else PLAIN.get(name, {}))} for name in IDS}
CASES = [(name, variant) for name in IDS for variant in VARIANTS[name]]
"""Every registered environment in every variant."""
SHARED = [(name, variant) for name in IDS for variant in ALWAYS[name]]
"""Those that run compiled and uncompiled."""


def actions_for(space: gym.spaces.Box, steps: int, seed: int = 0) -> np.ndarray:
    """Return held random actions, shape (steps, n)."""
    random = np.random.default_rng(seed)
    held = random.uniform(space.low, space.high, (-(-steps // 5), *space.shape))
    return np.repeat(held, 5, axis=0)[:steps].astype(np.float32)


def trajectory(env: gym.Env, seed: int, steps: int = 60) -> list[str]:
    """Return everything that a fixed drive of an environment gives, to the last bit."""
    observation, info = env.reset(seed=seed)
    lines = [observation.tobytes().hex(), str([v.hex() for v in info.values()])]
    for action in actions_for(env.action_space, steps, seed):
        observation, reward, terminated, truncated, info = env.step(action)
        values = [float(v).hex() for v in (reward, *info.values())]
        lines.append(f"{observation.tobytes().hex()} {values} {terminated} {truncated}")
        if terminated or truncated:
            observation, info = env.reset()
            lines.append(observation.tobytes().hex())
    return lines
