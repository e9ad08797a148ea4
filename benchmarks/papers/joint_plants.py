"""Steps on the plants of ``PAM/AntagonisticJoint-v0`` and on the assumed hysteresis of the studies.

The advantage of model-following over the PI alone depends on the hysteresis, on the size of the
step and on a preceding turn; all combinations are evaluated. The plants are those of the
environment, without noise: *reduced* is the paper's, with the hysteresis identified on the muscles;
*paper* is the joint of two muscles that carries its link.
"""

from __future__ import annotations

from functools import cache
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from benchmarks.papers.joint_studies import (
    DEGREE,
    FINE,
    HOLD,
    PERIOD,
    Setting,
    StepFigures,
    step,
    step_figures,
)
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint

Array = NDArray[np.float64]

STUDY = "study"
PLANTS = (STUDY, "reduced", "paper")
SIZES = (5.0, 10.0, 15.0, 20.0)
"""Of the steps [deg]."""
CASES = tuple(product(PLANTS, SIZES, (True, False)))
"""Plant, size [deg], and whether the step follows a turn."""


def plant_run(joint: AntagonisticJoint, name: str, size: float) -> Array:
    """Return the angles [rad] at 0, 10 ms, ... of two steps and one back, from the straight joint.

    Parameters
    ----------
    joint : AntagonisticJoint
        Its sensors are taken as free of noise.
    name : str
        Of the controller.
    size : float
        [deg].
    """
    import gymnasium

    from baselines.core.catalogue import make_controller
    from benchmarks.runs.rollout import run

    joint = joint.without_noise()
    reference = size * DEGREE * np.repeat([1.0, 0.0, 1.0], round(HOLD / PERIOD))
    env: Any = gymnasium.make(
        "PAM/AntagonisticJoint-v0",
        disable_env_checker=True,
        plant=joint,
        reference=reference,
        start="straight",
        episode_seconds=PERIOD * len(reference),
    ).unwrapped
    controller = make_controller(name, joint, env.signals, env.action_signals)
    return np.concatenate([[0.0], run(env, controller, 0).signals["output"]])


def figures_of(angles: Array, size: float, turned: bool) -> StepFigures:
    """Return the figures of one of the steps of a run of :func:`plant_run`.

    Between the control instants the angle goes along a cubic spline.
    """
    time = PERIOD * np.arange(len(angles))
    begin = 2.0 * HOLD if turned else 0.0
    fine = FINE * np.arange(1.0, round(HOLD / FINE))
    output = CubicSpline(time, angles)(begin + fine)
    return step_figures(fine, np.asarray(output) / (size * DEGREE))


@cache
def _angles(plant: str, name: str, size: float) -> Array:
    return plant_run(getattr(AntagonisticJoint, plant)(), name, size)


def plant_step(plant: str, name: str, size: float, turned: bool) -> StepFigures:
    """Return the figures of a step on one of ``PLANTS``.

    Parameters
    ----------
    plant, name : str
        Of plant and controller.
    size : float
        [deg].
    turned : bool
        Whether it is the second of two steps, with one back in between.
    """
    if plant == STUDY:
        return step(name, Setting(size=size * DEGREE, turned=turned))
    return figures_of(_angles(plant, name, size), size, turned)
