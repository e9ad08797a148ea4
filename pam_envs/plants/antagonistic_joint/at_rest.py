"""Smooth equations of the antagonistic joint about a point of rest, for :meth:`Plant.linearise`."""

from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from pam_envs.arrays import Array
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.statics import PairPlant
from pam_envs.plants.core.linearise import Branch, Equilibrium, local_branch

Inputs = Literal["pressure", "angle"]
SIZE = 1e-5
"""Contraction, or angle [rad], over which the slope of a branch is taken."""


def at_rest(
    plant: AntagonisticJoint,
    angle: float = 0.0,
    prestress: float | None = None,
    payload: float = 0.0,
    inputs: Inputs = "pressure",
    branch: Branch = "loading",
) -> Equilibrium:
    """Return the equations about the rest at an angle and a co-contraction.

    States: pressure_a, pressure_b [Pa], angle [rad], velocity [rad/s]; of the reduced plant angle
    and velocity. Inputs: set_point_a, set_point_b [Pa], or with ``inputs="angle"`` command [rad]
    and co_contraction [N] through the feedforward (of the reduced plant: command). Output: angle.

    Parameters
    ----------
    angle : float
        Angle at rest [rad], reached from the straight joint.
    prestress : float, optional
        Co-contraction [N]; default: the nominal one.
    payload : float
        Mass at the link's end [kg].
    """
    link = plant.link
    if plant.dynamics == "reduced":
        return _reduced(plant, angle, payload, branch)
    inertia = link.inertia + payload * link.length**2
    dynamics = np.array([[1.0 / inertia]]), np.array([link.damping])
    return pair_equilibrium(plant, np.array([angle]), prestress, payload, inputs, branch, *dynamics)


def pair_equilibrium(
    plant: PairPlant, pose: Array, prestress: float | None, payload: float, inputs: Inputs,
    branch: Branch, inverse_mass: Array, damping: Array,
) -> Equilibrium:  # fmt: skip
    """Return the equations of n joints with pairs of muscles about the rest at a pose, (n,) [rad].

    ``inverse_mass`` (n, n) [1/(kg m2)] and ``damping`` (n,) [N m s/rad] are those of the links; the
    names of an arm's joints are numbered.
    """
    n = len(pose)
    stress = np.full(n, plant.prestress if prestress is None else prestress)
    weight = plant.weight_torque(pose, payload)
    a, b, short = plant.pressures_for(pose, stress, weight)
    if np.any(short):
        raise ValueError(
            f"angles = {pose.tolist()} rad are out of reach at {stress[0]:g} N: choose smaller ones"
        )
    pulls = [muscle_torque(plant, float(phi), branch) for phi in pose]

    def derivative(state: Array, command: Array) -> Array:
        pressures, phi, speed = state[: 2 * n].reshape(n, 2), state[2 * n : 3 * n], state[3 * n :]
        torque = [
            pull(*args) for pull, *args in zip(pulls, phi, speed, pressures, strict=True)
        ] - plant.weight_torque(phi, payload)
        set_points = command.reshape(n, 2)
        if inputs == "angle":
            set_points = np.stack(plant.pressures_for(command[:n], command[n:], weight)[:2], -1)
        lag = (set_points - pressures) / plant.regulator.time_constant
        return np.concatenate([lag.ravel(), speed, inverse_mass @ (torque - damping * speed)])

    def named(name: str, ends: tuple[str, ...] = ("",)) -> list[str]:
        alone = isinstance(plant, AntagonisticJoint)
        joints = ["_" if ends[0] else ""] if alone else [f"_{k + 1}" for k in range(n)]
        return [f"{name}{joint}{end}" for joint in joints for end in ends]

    held, by_angle = np.stack([a, b], -1).ravel(), inputs == "angle"
    steps = [1e-6] * n + [1e-3] * n if by_angle else [10.0] * 2 * n
    given = named("command") + named("co_contraction")
    return Equilibrium(
        derivative,
        lambda state: state[2 * n : 3 * n],
        np.concatenate([held, pose, np.zeros(n)]),
        np.concatenate([pose, stress]) if by_angle else held,
        np.array([10.0] * 2 * n + [1e-6] * 2 * n + steps),
        (
            tuple(named("pressure", ("a", "b")) + named("angle") + named("velocity")),
            tuple(given if by_angle else named("set_point", ("a", "b"))),
            tuple(named("angle")),
        ),
    )


def muscle_torque(
    plant: Any, angle: float, branch: Branch
) -> Callable[[float, float, Array], float]:
    """Return the torque [N m] of a pair by angle [rad], velocity [rad/s] and pressures [Pa].

    The friction of both muscles is that of their branches at ``angle``.
    """
    muscle, lever, friction = plant.muscle, plant.lever, plant.hysteresis
    straight = lever.contraction(0.0, muscle.rest_length)
    at = lever.contraction(angle, muscle.rest_length) - straight
    ways = np.sign(lever.contraction(angle + 1e-3, muscle.rest_length) - straight - at)
    starts = np.where(at == 0.0, -1e-12 * ways, 0.0)
    sides = np.array([1.0, -1.0])
    gains = muscle.gain * (1.0 + sides * muscle.imbalance)
    rubs = 1.0 + sides * muscle.friction_imbalance

    def torque(phi: float, speed: float, pressures: Array) -> float:
        x, rate = lever.contraction(phi, muscle.rest_length), lever.rate(phi)
        felt = np.array([
            local_branch(friction.at_pressure(float(p)), float(a), float(start), branch, SIZE)(v)
            for p, a, start, v in zip(pressures, at, starts, x - straight, strict=True)
        ])  # fmt: skip
        drag = rubs * friction.stiffness(pressures) * (x - straight - felt)
        slide = muscle.viscosity * pressures * -rate * speed / muscle.rest_length
        forces = gains * muscle.corrected(pressures, x) - drag - slide
        return float(-np.sum(np.maximum(0.0, forces) * rate))

    return torque


def _reduced(plant: AntagonisticJoint, angle: float, payload: float, branch: Branch) -> Equilibrium:
    """Return the equations of the reduced plant: a branch of its hysteresis and a double pole."""
    nominal, width = plant.nominal, plant.hysteresis.width
    line = local_branch(plant.hysteresis.operator, angle, 0.0, branch, SIZE)
    weight = float(plant.weight_torque(line(angle), payload))

    def derivative(state: Array, command: Array) -> Array:
        phi, speed = state
        target = command[0] - width * (command[0] - float(line(command[0])))
        torque = (weight - float(plant.weight_torque(phi, payload))) / nominal.stiffness
        pole = nominal.pole
        return np.array([speed, pole * pole * (target - phi + torque) - 2.0 * pole * speed])

    rest = angle - width * (angle - float(line(angle)))
    return Equilibrium(
        derivative,
        lambda state: state[:1],
        np.array([rest, 0.0]),
        np.array([angle]),
        np.full(3, 1e-6),
        (("angle", "velocity"), ("command",), ("angle",)),
    )
