"""Equivalent double pole and delay of each joint of a nominal plant.

A single stage is the paper's nominal model, two poles at 23 rad/s. In an arm a joint also moves the
distal links: its pole is the frequency at which its angle lags its own setpoint by 90 degrees,
as ``p^2 / (s + p)^2`` does at ``p`` (and an oscillating joint at its natural frequency), at most
that of a single stage. Its delay for slow setpoints is the mean time of its impulse response,
``2 / p`` for a double pole and less for an oscillating joint. Both are found by small steps of one
joint at a time, with the arm straight and without hysteresis.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from baselines.core.controller import Array
from baselines.joint.model import POLE

STEP = 0.02
"""[rad]."""
SECONDS = 8.0
FREQUENCIES = np.geomspace(0.5, 60.0, 400)
"""[rad/s]."""


class JointDynamics(NamedTuple):
    """Equivalent pole [rad/s] and delay [s] of a joint."""

    pole: float
    delay: float


_DYNAMICS: dict[str, tuple[JointDynamics, ...]] = {}


def joint_poles(plant: Any) -> tuple[float, ...]:
    """Return the pole of each joint [rad/s]."""
    return tuple(pace.pole for pace in joint_dynamics(plant))


def joint_delays(plant: Any) -> tuple[float, ...]:
    """Return the delay of each joint [s] for slow setpoints, without the hold."""
    return tuple(pace.delay for pace in joint_dynamics(plant))


def joint_dynamics(plant: Any) -> tuple[JointDynamics, ...]:
    """Return the dynamics of each joint, cached by plant."""
    if plant.stages == 1:
        return (JointDynamics(POLE, 2.0 / POLE),)
    key = plant.digest()
    if key not in _DYNAMICS:
        smooth = plant.replace({"hysteresis.width": 0.0})
        _DYNAMICS[key] = tuple(_dynamics(smooth, k) for k in range(plant.stages))
    return _DYNAMICS[key]


def _dynamics(plant: Any, joint: int) -> JointDynamics:
    from pam_envs.plants.redundant_manipulator.rollout import simulate_manipulator

    period = plant.control_period
    commands = np.zeros((round(SECONDS / period), plant.stages))
    commands[1:, joint] = STEP
    pulse = np.diff(simulate_manipulator(plant, commands)["angle"][:, joint])
    behind = np.flatnonzero(-phase(pulse, period) > 0.5 * np.pi)
    pole = min(POLE, float(FREQUENCIES[behind[0]])) if behind.size else POLE
    return JointDynamics(pole, mean_time(pulse, period))


def mean_time(pulse: Array, period: float) -> float:
    """Return the delay [s] for slow inputs, without the hold, from a response's increments."""
    time = (np.arange(len(pulse)) + 1.0) * period
    return float(time @ pulse / np.sum(pulse)) - 0.5 * period


def phase(pulse: Array, period: float) -> Array:
    """Return the phase [rad] at ``FREQUENCIES``, without the hold, from a response's increments."""
    time = (np.arange(len(pulse)) + 1.0) * period
    response = np.exp(-1j * np.multiply.outer(FREQUENCIES, time)) @ pulse
    return np.unwrap(np.angle(response)) + 0.5 * period * FREQUENCIES
