"""Model computations of the orthosis: estimates, references, allocation of pressures.

They use the nominal bundles and the readings, and neglect friction.
"""

from __future__ import annotations

from typing import Any

from pam_envs.envs.core.step import CHOICE
from pam_envs.envs.elbow import layout as L
from pam_envs.kernels.arithmetic import PER_TURN, sine_of_turns
from pam_envs.kernels.build import kernel
from pam_envs.mechanics.allocation import allocate, stiffness_of, torque_of
from pam_envs.tasks.torque_stiffness import object_stiffness, object_torque


@kernel
def shapes_at(model: Any, angle: float) -> tuple[float, float, float, float]:
    """Return phi_a, phi_b [m^2], psi_a, psi_b [m] of the nominal bundles at an angle [rad]."""
    a = model[L.MODEL.radius] * (model[L.MODEL.highest] - angle)
    b = model[L.MODEL.radius] * (angle - model[L.MODEL.lowest])
    phi_a = (model[L.MODEL.length_a] - a) * (model[L.MODEL.reach_a] - a)
    phi_b = (model[L.MODEL.length_b] - b) * (model[L.MODEL.reach_b] - b)
    psi_a = 2.0 * a - model[L.MODEL.length_a] - model[L.MODEL.reach_a]
    return phi_a, phi_b, psi_a, 2.0 * b - model[L.MODEL.length_b] - model[L.MODEL.reach_b]


@kernel
def estimate(model: Any, angle: float, a: float, b: float) -> tuple[float, float]:
    """Return torque [N m] and stiffness [N m/rad] at an angle [rad] and two pressures [Pa]."""
    phi_a, phi_b, psi_a, psi_b = shapes_at(model, angle)
    share_a, share_b = a / model[L.MODEL.full_pressure], b / model[L.MODEL.full_pressure]
    x_a = model[L.MODEL.low_a] + (model[L.MODEL.high_a] - model[L.MODEL.low_a]) * share_a
    x_b = model[L.MODEL.low_b] + (model[L.MODEL.high_b] - model[L.MODEL.low_b]) * share_b
    torque = torque_of(x_a, x_b, model[L.MODEL.radius], phi_a, phi_b)
    return torque, stiffness_of(x_a, x_b, model[L.MODEL.radius], psi_a, psi_b)


@kernel
def pressures_for(model: Any, angle: float, torque: float, stiffness: float) -> tuple[float, float]:
    """Return the pressures [Pa] for torque and stiffness at an angle, torque first."""
    phi_a, phi_b, psi_a, psi_b = shapes_at(model, angle)
    x_a, x_b = allocate(
        torque,
        stiffness,
        model[L.MODEL.radius],
        phi_a,
        phi_b,
        psi_a,
        psi_b,
        model[L.MODEL.low_a],
        model[L.MODEL.high_a],
        model[L.MODEL.low_b],
        model[L.MODEL.high_b],
    )
    full = model[L.MODEL.full_pressure]
    a = full * (x_a - model[L.MODEL.low_a]) / (model[L.MODEL.high_a] - model[L.MODEL.low_a])
    return a, full * (x_b - model[L.MODEL.low_b]) / (model[L.MODEL.high_b] - model[L.MODEL.low_b])


@kernel
def own_weight(model: Any, config: Any, angle: float) -> float:
    """Return the torque [N m] that compensates the orthosis' weight, if it does."""
    return config[L.CONFIG.bears] * model[L.MODEL.weight] * sine_of_turns(angle * PER_TURN)  # type: ignore[no-any-return]


@kernel
def desired_at(
    rows: Any, settings: Any, choices: Any, lane: int, angle: float, step: int
) -> tuple[float, float]:
    """Return the desired torque [N m] and stiffness [N m/rad] at an angle."""
    config, own = settings[0], choices[CHOICE.at_own]
    if choices[CHOICE.reference] == L.SAMPLES:
        k = min(step, choices[L.CHOICE.samples] - 1)
        return settings[own + 1][k], settings[own + 2][k]
    kind, place, strength = rows[L.OBJECT][lane], rows[L.PLACE][lane], rows[L.STRENGTH][lane]
    level = rows[L.LEVEL][lane]
    torque = object_torque(kind, angle, place, strength) + own_weight(settings[own], config, angle)
    return torque, object_stiffness(
        kind, angle, place, strength, level, config[L.CONFIG.wall_depth]
    )


@kernel
def within_reach(model: Any, angle: float, torque: float, stiffness: float) -> tuple[float, float]:
    """Return the nearest torque and stiffness that pressures can give at an angle, torque first."""
    a, b = pressures_for(model, angle, torque, stiffness)
    return estimate(model, angle, a, b)
