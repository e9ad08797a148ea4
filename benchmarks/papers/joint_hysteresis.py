"""Hysteresis of a joint and its inverse: loop widths, symmetry, congruency (fluidic_muscles, 3)."""

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from baselines.joint.model import JointModel, joint_model
from benchmarks.papers.joint_studies import DEGREE, RANGE
from benchmarks.papers.published import as_published
from pam_envs.arrays import Array
from pam_envs.hysteresis.preisach import Preisach
from pam_envs.identification.joint_forc import (
    JointHysteresis,
    measure_hysteresis,
    measure_joint,
    series_inverse,
)
from pam_envs.identification.joint_muscle import HangingMuscle
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint


def loop_path(
    plant: Any, model: JointModel, amplitude: float = 20.0 * DEGREE
) -> tuple[Array, Array]:
    """Return desired and reached angles [rad]: an initial rise, then one cycle down and up.

    The setpoints of the plant's ``rest_angles`` come from the inverse of the model's hysteresis.
    """
    up = np.linspace(-amplitude, amplitude, 81)
    desired = np.concatenate([np.linspace(0.0, amplitude, 41), up[::-1], up])
    commands, (_, state) = [], model.start(np.zeros((1, 1)))
    for angle in desired:
        command = np.clip(model.inverse(np.array([[angle]]), state), model.low, model.high)
        _, state = model.forward(command, state)
        commands.append(command.item())
    return desired, plant.rest_angles(np.array(commands))


def loop_width(plant: Any, model: JointModel, amplitude: float = 20.0 * DEGREE) -> float:
    """Return the largest width [rad] of the loop of :func:`loop_path`."""
    reached = loop_path(plant, model, amplitude)[1]
    return float(np.max(np.abs(reached[41:122][::-1] - reached[122:])))


def width_ratio(plant: Any, amplitude: float = 10.0 * DEGREE) -> float:
    """Return the loop width with a straight line for the inverse, over that with the inverse.

    If the plant is a Preisach operator itself, the ratio shows only the resolution of the
    identified map.
    """
    model = joint_model(plant)
    widths = [loop_width(plant, known, amplitude) for known in (model.narrowed(0.0), model)]
    return widths[0] / widths[1]


def inhomogeneous() -> Preisach:
    """Return a hysteresis whose relay density varies by 30 %, starting at its lowest output."""

    def density(a: Array, b: Array) -> Array:
        return np.asarray((1.0 + 0.3 * np.cos(0.5 * np.pi * (a + b) / RANGE)) * np.exp(-(a - b)))

    half = Preisach.from_density(density, -RANGE, RANGE, levels=33)
    share = 0.4 * 2.0 * RANGE / float(half.everett[-1, 0])
    return half.scaled(share, 0.0).plus_linear(0.6)


def inverse_error(histories: int = 60) -> tuple[float, float]:
    """Return the errors of the recursion and of the printed sum (3.5), relative to the range.

    For the recursion it is the error of the output, for the sum the error of the input.
    """
    model, draw = inhomogeneous(), np.random.default_rng(2)
    top = float(model.everett[-1, 0])
    worst_exact = worst_series = 0.0
    for _ in range(histories):
        desired = model.start_output + top * draw.uniform(0.0, 1.0, draw.integers(3, 7))
        inputs, state = [], model.initial_state()
        for value in desired:
            found, state = model.inverse_step(value, state)
            inputs.append(float(found))
        reached = model.simulate(np.array(inputs))[0]
        worst_exact = max(worst_exact, float(np.max(np.abs(reached - desired))) / top)
        printed = series_inverse(model, desired)
        worst_series = max(worst_series, float(np.max(np.abs(printed - inputs))) / (2.0 * RANGE))
    return worst_exact, worst_series


def relay_output(model: Preisach, path: Sequence[int]) -> Array:
    """Return the outputs of the sum of relays (3.1) after each of a series of grid points.

    A cell's relay is up after an input at or above its upper corner, down after one at or below
    its lower corner; at the start all are down.
    """
    cells = len(model.levels) - 1
    switch_up, switch_down = np.arange(1, cells + 1)[:, None], np.arange(cells)[None, :]
    up, outputs = np.zeros((cells, cells), bool), []
    for point in path:
        up = (up | (switch_up <= point)) & ~(switch_down >= point)
        outputs.append(model.start_output + float(np.sum(model.weights[up])))
    return np.array(outputs)


def antisymmetry_error() -> float:
    """Return the largest error of ``f_ab = -f_ba`` over the range, of symmetric weights.

    ``f_ab`` is the output after a rise to ``a`` and a fall to ``b``, ``f_ba`` that after a fall to
    ``b`` and a rise to ``a``, both from the nearest saturation and counted from mid-range.
    """
    plays = inhomogeneous()
    middle, inputs = plays.start_output + 0.5 * float(plays.everett[-1, 0]), plays.levels
    worst = 0.0
    for a in range(4, len(inputs), 4):
        for b in range(0, a, 4):
            down = plays.simulate(inputs[[0, a, b]])[0][-1] - middle
            risen = plays.simulate(inputs[[0, -1, b, a]])[0][-1] - middle
            worst = max(worst, abs(float(down + risen)))
    return worst / float(plays.everett[-1, 0])


PRESSURES = (0.5e5, 6.5e5)
"""Range of the single muscle's pressure [Pa]; below, it does not lift its load."""


@cache
def verdicts() -> dict[str, JointHysteresis]:
    """Return the measured hysteresis of two simulated joints and of one of their muscles."""
    joints = {
        "paper joint": as_published(AntagonisticJoint.paper("maxwell_slip")),
        "measured joint": as_published(AntagonisticJoint.measured("maxwell_slip")),
    }
    found = {
        name: measure_joint(joint.rest_angles, joint.angle_range[1])
        for name, joint in joints.items()
    }
    muscle = HangingMuscle(joints["paper joint"])
    found["one DMSP-10 under 100 N"] = measure_hysteresis(muscle.rest_contractions, *PRESSURES)
    return found
