"""How fast each joint of a nominal plant is: the double pole that stands for it in a controller.

A stage alone is the paper's nominal model, two poles at 23 rad/s. In an arm a joint also moves what
hangs on it. Its pole is then the frequency at which its angle lags its own set-point by a quarter
of a turn, as ``p^2 / (s + p)^2`` does at ``p`` (and a swinging joint at its natural frequency), but
not above that of a stage. It is found by small steps of one joint after the other, the arm straight
and the memory off.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from baselines.controller import Array
from baselines.joint_model import POLE

STEP = 0.02
"""[rad]."""
SECONDS = 8.0
FREQUENCIES = np.geomspace(0.5, 60.0, 400)
"""[rad/s]."""

_POLES: dict[str, tuple[float, ...]] = {}


def joint_poles(plant: Any) -> tuple[float, ...]:
    """Return the pole of each joint [rad/s], found once for each plant.

    Parameters
    ----------
    plant : AntagonisticJoint or RedundantManipulator
        Nominal plant.
    """
    if plant.stages == 1:
        return (POLE,)
    key = plant.digest()
    if key not in _POLES:
        smooth = plant.replace({"memory.width": 0.0})
        _POLES[key] = tuple(_pole(smooth, k) for k in range(plant.stages))
    return _POLES[key]


def _pole(plant: Any, joint: int) -> float:
    from pam_envs.plants.manipulator_rollout import simulate_manipulator

    commands = np.zeros((round(SECONDS / plant.control_period), plant.stages))
    commands[1:, joint] = STEP
    angles = simulate_manipulator(plant, commands)["angle"][:, joint]
    lag = -phase(np.diff(angles), plant.control_period)
    behind = np.flatnonzero(lag > 0.5 * np.pi)
    return min(POLE, float(FREQUENCIES[behind[0]])) if behind.size else POLE


def phase(pulse: Array, period: float) -> Array:
    """Return the phase [rad] at ``FREQUENCIES`` of what answers a held step with these increments.

    Half a period is taken off for the hold.
    """
    time = (np.arange(len(pulse)) + 1.0) * period
    response = np.exp(-1j * np.multiply.outer(FREQUENCIES, time)) @ pulse
    return np.unwrap(np.angle(response)) + 0.5 * period * FREQUENCIES
