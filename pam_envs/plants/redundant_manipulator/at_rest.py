"""Smooth equations of the manipulator about a point of rest, for :meth:`Plant.linearise`."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.plants.antagonistic_joint.at_rest import Inputs, muscle_torque
from pam_envs.plants.core.linearise import Array, Branch, Equilibrium
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator


def at_rest(
    plant: RedundantManipulator,
    angles: ArrayLike = 0.0,
    prestress: float | None = None,
    payload: float = 0.0,
    inputs: Inputs = "pressure",
    branch: Branch = "loading",
) -> Equilibrium:
    """Return the equations about the rest of n joints at their angles, shape () or (n,) [rad].

    States: pressure_1a, pressure_1b, ... [Pa], angle_1, ... [rad], velocity_1, ... [rad/s]. Inputs:
    set_point_1a, ... [Pa]; or with ``inputs="angle"`` command_1, ... [rad] and co_contraction_1,
    ... [N] through the feedforward. Outputs: the angles. ``prestress`` [N] is that of every joint
    (default: the nominal one), ``payload`` the mass at the tip [kg].
    """
    n = plant.stages
    pose = np.array(np.broadcast_to(np.asarray(angles, float), (n,)))
    stress = np.full(n, plant.prestress if prestress is None else prestress)
    weight = plant.weight_torque(pose, payload)
    a, b, short = plant.pressures_for(pose, stress, weight)
    if np.any(short):
        raise ValueError(f"angles = {pose.tolist()} rad are out of reach: choose smaller ones")
    pulls = [muscle_torque(plant, float(phi), branch) for phi in pose]
    inverse_mass = np.linalg.inv(plant.chain.mass_matrix(pose, payload))
    damping = plant.link.damping + plant.arm.damping_factor * np.array(plant.joint_damping)

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

    sides = [f"{k + 1}{side}" for k in range(n) for side in "ab"]
    each = [str(k + 1) for k in range(n)]
    held = np.stack([a, b], -1).ravel()
    by_angle = inputs == "angle"
    return Equilibrium(
        derivative,
        lambda state: state[2 * n : 3 * n],
        np.concatenate([held, pose, np.zeros(n)]),
        np.concatenate([pose, stress]) if by_angle else held,
        np.array(
            [10.0] * 2 * n
            + [1e-6] * 2 * n
            + ([1e-6] * n + [1e-3] * n if by_angle else [10.0] * 2 * n)
        ),
        (
            tuple(
                [f"pressure_{s}" for s in sides]
                + [f"angle_{k}" for k in each]
                + [f"velocity_{k}" for k in each]
            ),
            tuple([f"command_{k}" for k in each] + [f"co_contraction_{k}" for k in each])
            if by_angle
            else tuple(f"set_point_{s}" for s in sides),
            tuple(f"angle_{k}" for k in each),
        ),
    )
