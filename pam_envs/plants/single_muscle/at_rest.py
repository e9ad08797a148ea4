"""Smooth equations of the single muscle about a point of rest, for :meth:`Plant.linearise`."""

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import GRAVITY
from pam_envs.plants.core.linearise import Branch, Equilibrium, local_branch
from pam_envs.plants.single_muscle.plant import SingleMuscle


def at_rest(
    plant: SingleMuscle,
    pressure: float = 3e5,
    load: float | None = None,
    branch: Branch = "loading",
) -> Equilibrium:
    """Return the equations about the rest at a setpoint pressure [Pa], reached from none.

    States: pressure [Pa], contraction [m] as measured, velocity [m/s]. Input: set_point [Pa].
    Outputs: contraction, pressure. ``load`` [kg] is by default the plant's.
    """
    mass = plant.mass.load if load is None else load
    law, full = plant.hysteresis, plant.regulator.max_pressure
    if not 0.0 < pressure < full:
        raise ValueError(f"pressure = {pressure:g} Pa; give one between 0 and {full:g} Pa")
    point = float(law.stretched(pressure, full))
    line = local_branch(plant.operator_at(mass), point, 0.0, branch, 1e-4 * full)
    offset = float(plant._absolute(np.zeros(()), np.asarray(mass)))
    inertia = mass + plant.mass.moving_mass

    def drive(p: float) -> Array:
        return law.unstretched(line(law.stretched(p, full)), full)

    def derivative(state: Array, command: Array) -> Array:
        p, x, v = state
        pull = float(plant.muscle.tension(drive(p), (x + offset) / plant.muscle.rest_length))
        force = pull - mass * GRAVITY - plant.mass.damping * v
        return np.array([(command[0] - p) / plant.regulator.time_constant, v, force / inertia])

    contraction = float(plant.contraction_at(drive(pressure), mass))
    return Equilibrium(
        derivative,
        lambda state: state[[1, 0]],
        np.array([pressure, contraction, 0.0]),
        np.array([pressure]),
        np.array([10.0, 1e-6, 1e-3, 10.0]),
        (("pressure", "contraction", "velocity"), ("set_point",), ("contraction", "pressure")),
    )
