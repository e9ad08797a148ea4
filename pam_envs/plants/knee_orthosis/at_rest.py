"""Smooth equations of the knee orthosis about a point of rest, for :meth:`Plant.linearise`."""

from collections.abc import Callable
from typing import Any

import numpy as np

from pam_envs.arrays import Array
from pam_envs.hysteresis.slip import SlipModel
from pam_envs.plants.core.linearise import Branch, Equilibrium, local_branch
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.pneumatics.measured_dynamics import modes


def at_rest(
    plant: KneeOrthosis,
    pressure: float = 2e5,
    knee: float = 0.0,
    branch: Branch = "loading",
) -> Equilibrium:
    """Return the equations about the rest at a setpoint pressure.

    States: pressure [Pa] (with the measured dynamics its modes instead), then angle [rad] and
    velocity [rad/s], except in the rig. On the leg the angle is that of the wire about the wearer's
    path, which the wearer holds with the stiffness of the swing. Input: set_point [Pa]. Outputs:
    tension [N], torque [N m] (extension positive), pressure [Pa], and the angle.

    Parameters
    ----------
    pressure : float
        Setpoint [Pa], reached by inflation from none.
    knee : float
        Flexion of the knee [rad], on the leg.
    """
    full, muscle, lever = plant.regulator.max_pressure, plant.muscle, plant.lever
    if not 0.0 < pressure < full:
        raise ValueError(f"pressure = {pressure:g} Pa; give one between 0 and {full:g} Pa")
    line = local_branch(plant.hysteresis.scaled, pressure, 0.0, branch, 1e-4 * full)
    by_length = plant.hysteresis.drive == "length"
    ratio = muscle.stiffness_ratio if by_length or not plant.hysteresis.operator else 1.0

    def stiffness(p: Any) -> Array:
        return np.asarray(muscle.gain * ratio * line(p))

    matrix, settled, share = _regulator(plant)
    air = len(settled)
    rig, leg = plant.mounting == "rig", plant.mounting == "leg"
    if rig:
        angle = float(lever.angle(plant.fixture.length))
    else:
        free = float(plant.angle_at(stiffness(pressure), pressure))
        angle = lever.mount_angle + knee if leg else free
    inertia = lever.inertia + (plant.leg.inertia if leg else 0.0)
    damping = lever.damping + (plant.leg.hold_damping if leg else 0.0)
    hold = plant.leg.hold_stiffness if leg else 0.0

    def tension_torque(state: Array) -> tuple[float, float]:
        theta = angle if rig else state[air]
        p, length = share @ state[:air], float(lever.length(theta))
        pull = max(0.0, float(plant.pull(stiffness(p), p, length)) + rub(length))
        return pull, float(lever.torque(pull, theta))

    rub = _friction(plant, float(lever.length(angle)), pressure, branch)
    rest = np.concatenate([pressure * settled, [] if rig else [angle, 0.0]])
    balance = tension_torque(rest)[1]

    def derivative(state: Array, command: Array) -> Array:
        rates = matrix @ (state[:air] - settled * command[0])
        if rig:
            return rates
        theta, speed = state[air:]
        torque = tension_torque(state)[1] - (balance if leg else 0.0)
        pull = torque + hold * (theta - angle) + damping * speed
        return np.array([*rates, speed, -pull / inertia])

    def outputs(state: Array) -> Array:
        shown = [*tension_torque(state), share @ state[:air]]
        return np.array(shown if rig else [*shown, state[air]])

    lags = ("pressure",) if air == 1 else tuple(f"mode_{k}" for k in range(air))
    moving = () if rig else ("angle", "velocity")
    return Equilibrium(
        derivative,
        outputs,
        rest,
        np.array([pressure]),
        np.array([10.0] * air + ([] if rig else [1e-6, 1e-5]) + [10.0]),
        ((*lags, *moving), ("set_point",), ("tension", "torque", "pressure", *moving[:1])),
    )


def _friction(
    plant: KneeOrthosis, length: float, pressure: float, branch: Branch
) -> Callable[[float], float]:
    """Return the friction [N] driven by length [m] near a rest, reached by shortening."""
    held, model = plant.hysteresis, plant.hysteresis.model
    if not isinstance(model, SlipModel):
        return lambda x: 0.0
    limited = model.limited(float(held.limit(pressure)))
    start = float(plant.lever.length(plant.lever.relaxed_angle))
    line = local_branch(limited, length - start, 0.0, branch, 1e-6)
    return lambda x: held.friction * float(x - start - line(x - start))


def _regulator(plant: KneeOrthosis) -> tuple[Array, Array, Array]:
    """Return ``A``, ``settled`` and ``share`` of ``s' = A (s - settled u)``, ``p = share s``."""
    if plant.dynamics == "lag":
        return np.array([[-1.0 / plant.regulator.time_constant]]), np.ones(1), np.ones(1)
    *real, (pole, gain) = modes()
    n = len(real)
    matrix = np.diag([*(p.real for p, _ in real), pole.real, pole.real])
    matrix[n, n + 1], matrix[n + 1, n] = -pole.imag, pole.imag
    share = [*(g.real for _, g in real), 2.0 * gain.real, -2.0 * gain.imag]
    return matrix, np.array([*[1.0] * (n + 1), 0.0]), np.array(share)
