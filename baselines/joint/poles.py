"""How fast each joint of a nominal plant is: the double pole that stands for it in a controller.

A stage alone is the paper's nominal model, two poles at 23 rad/s. In an arm a joint also moves what
hangs on it. Its pole is then the frequency at which its angle lags its own set-point by a quarter
of a turn, as ``p^2 / (s + p)^2`` does at ``p`` (and a swinging joint at its natural frequency), but
not above that of a stage. Beside it stands the joint's delay for slow set-points, ``2 / p`` of a
double pole, but less of a joint that swings: the mean time of its answer to a pulse. Both are found
by small steps of one joint after the other, the arm straight and the hysteresis off.
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


class Pace(NamedTuple):
    """How fast a joint is.

    Attributes
    ----------
    pole : float
        [rad/s].
    delay : float
        [s].
    """

    pole: float
    delay: float


_PACES: dict[str, tuple[Pace, ...]] = {}


def joint_poles(plant: Any) -> tuple[float, ...]:
    """Return the pole of each joint [rad/s].

    Parameters
    ----------
    plant : AntagonisticJoint or RedundantManipulator
        Nominal plant.
    """
    return tuple(pace.pole for pace in joint_paces(plant))


def joint_delays(plant: Any) -> tuple[float, ...]:
    """Return the delay of each joint [s] for slow set-points, without that of the hold."""
    return tuple(pace.delay for pace in joint_paces(plant))


def joint_paces(plant: Any) -> tuple[Pace, ...]:
    """Return how fast each joint is, found once for each plant."""
    if plant.stages == 1:
        return (Pace(POLE, 2.0 / POLE),)
    key = plant.digest()
    if key not in _PACES:
        smooth = plant.replace({"hysteresis.width": 0.0})
        _PACES[key] = tuple(_pace(smooth, k) for k in range(plant.stages))
    return _PACES[key]


def _pace(plant: Any, joint: int) -> Pace:
    from pam_envs.plants.redundant_manipulator.rollout import simulate_manipulator

    period = plant.control_period
    commands = np.zeros((round(SECONDS / period), plant.stages))
    commands[1:, joint] = STEP
    pulse = np.diff(simulate_manipulator(plant, commands)["angle"][:, joint])
    behind = np.flatnonzero(-phase(pulse, period) > 0.5 * np.pi)
    pole = min(POLE, float(FREQUENCIES[behind[0]])) if behind.size else POLE
    return Pace(pole, mean_time(pulse, period))


def mean_time(pulse: Array, period: float) -> float:
    """Return the delay [s] for slow inputs of what answers a held step with these increments.

    Half a period is taken off for the hold.
    """
    time = (np.arange(len(pulse)) + 1.0) * period
    return float(time @ pulse / np.sum(pulse)) - 0.5 * period


def phase(pulse: Array, period: float) -> Array:
    """Return the phase [rad] at ``FREQUENCIES`` of what answers a held step with these increments.

    Half a period is taken off for the hold.
    """
    time = (np.arange(len(pulse)) + 1.0) * period
    response = np.exp(-1j * np.multiply.outer(FREQUENCIES, time)) @ pulse
    return np.unwrap(np.angle(response)) + 0.5 * period * FREQUENCIES
