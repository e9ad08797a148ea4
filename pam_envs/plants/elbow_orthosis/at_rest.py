"""Smooth equations of the elbow orthosis about a point of rest, for :meth:`Plant.linearise`."""

import numpy as np

from pam_envs.arrays import Array
from pam_envs.plants.core.linearise import Branch, Equilibrium, local_branch
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis


def at_rest(
    plant: ElbowOrthosis,
    angle: float | None = None,
    pressures: tuple[float, float] | None = None,
    branch: Branch = "loading",
) -> Equilibrium:
    """Return the equations about the rest at an angle, held by a wearer who intends that pose.

    States: pressure_a, pressure_b [Pa], angle [rad] (flexion), velocity [rad/s]. Inputs:
    set_point_a, set_point_b [Pa]. Outputs: angle, torque [N m] of the bundles. Proportional valves
    only.

    Parameters
    ----------
    angle : float, optional
        Flexion [rad], reached from the middle of the range, which is the default.
    pressures : tuple of float, optional
        Of bundles a and b [Pa]; default: half of the full pressure.
    """
    if plant.valves != "proportional":
        raise ValueError(
            "valves = 'on_off' take pulses and have no setpoint: linearise the plant with "
            "valves='proportional'"
        )
    pulley, link, wearer = plant.pulley, plant.link, plant.wearer
    theta = float(pulley.middle if angle is None else angle)
    held = np.array(pressures or (0.5 * plant.full_pressure,) * 2, float)
    travel = float(pulley.travel(theta))
    start = travel - 1e-12 if travel == 0.0 else 0.0
    limits = plant.friction_limits(held)
    lines = [local_branch(operator, travel, start, branch, 1e-6)
             for operator in plant.hysteresis.at_limits(limits)]  # fmt: skip
    weight = link.mass * link.centre + wearer.mass * wearer.centre

    def torque(q: float, p: Array) -> float:
        at = pulley.travel(q)
        shape_a, shape_b, _, _ = plant.geometry(q)
        less_a, less_b = plant.friction(np.array([at - line(at) for line in lines]), p)
        factor_a, factor_b = plant.coefficients(*p)
        forces = factor_a * (shape_a - less_a), factor_b * (shape_b - less_b)
        return float(pulley.torque(*(np.maximum(0.0, force) for force in forces)))

    def balance(q: float, p: Array) -> float:
        return torque(q, p) - weight * link.gravity * float(np.sin(q)) - wearer.stiffness * q

    drive = -balance(theta, held)

    def derivative(state: Array, command: Array) -> Array:
        q, speed = state[2:]
        drag = (link.damping + wearer.damping) * speed
        bend = (balance(q, state[:2]) + drive - drag) / (link.inertia + wearer.inertia)
        lag = (command - state[:2]) / plant.regulator.time_constant
        return np.array([*lag, speed, bend])

    return Equilibrium(
        derivative,
        lambda state: np.array([state[2], torque(state[2], state[:2])]),
        np.array([*held, theta, 0.0]),
        held,
        np.array([10.0, 10.0, 1e-6, 1e-6, 10.0, 10.0]),
        (
            ("pressure_a", "pressure_b", "angle", "velocity"),
            ("set_point_a", "set_point_b"),
            ("angle", "torque"),
        ),
    )
