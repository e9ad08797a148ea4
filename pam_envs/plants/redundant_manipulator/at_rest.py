"""Smooth equations of the manipulator about a point of rest, for :meth:`Plant.linearise`."""

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.plants.antagonistic_joint.at_rest import Inputs, pair_equilibrium
from pam_envs.plants.core.linearise import Branch, Equilibrium
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
    pose = np.array(np.broadcast_to(np.asarray(angles, float), (plant.stages,)))
    inverse_mass = np.asarray(np.linalg.inv(plant.chain.mass_matrix(pose, payload)), np.float64)
    damping = plant.link.damping + plant.arm.damping_factor * np.array(plant.joint_damping)
    return pair_equilibrium(plant, pose, prestress, payload, inputs, branch, inverse_mass, damping)
