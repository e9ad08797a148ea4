"""What the orthosis' own program computes: estimates, references, pressures for a wish.

It knows the nominal bundles and what the sensors give, and nothing of friction.
"""

from __future__ import annotations

from typing import Any

from pam_envs.envs.core.step import AT_OWN
from pam_envs.envs.elbow.layout import (
    BEARS,
    FULL_PRESSURE,
    HIGH_A,
    HIGH_B,
    HIGHEST,
    LENGTH_A,
    LENGTH_B,
    LEVEL,
    LOW_A,
    LOW_B,
    LOWEST,
    N_SAMPLES,
    OBJECT,
    OBJECT_KIND,
    PLACE,
    RADIUS,
    REACH_A,
    REACH_B,
    SAMPLES,
    STRENGTH,
    WALL_DEPTH,
    WEIGHT,
)
from pam_envs.kernels.arithmetic import sine_of_turns
from pam_envs.kernels.build import kernel
from pam_envs.mechanics.allocation import allocate, stiffness_of, torque_of
from pam_envs.tasks.torque_stiffness import PER_TURN, object_stiffness, object_torque


@kernel
def shapes_at(model: Any, angle: float) -> tuple[float, float, float, float]:
    """Return phi_a, phi_b [m^2], psi_a, psi_b [m] of the nominal bundles at an angle [rad]."""
    a, b = model[RADIUS] * (model[HIGHEST] - angle), model[RADIUS] * (angle - model[LOWEST])
    phi_a = (model[LENGTH_A] - a) * (model[REACH_A] - a)
    phi_b = (model[LENGTH_B] - b) * (model[REACH_B] - b)
    psi_a = 2.0 * a - model[LENGTH_A] - model[REACH_A]
    return phi_a, phi_b, psi_a, 2.0 * b - model[LENGTH_B] - model[REACH_B]


@kernel
def estimate(model: Any, angle: float, a: float, b: float) -> tuple[float, float]:
    """Return torque [N m] and stiffness [N m/rad] at an angle [rad] and two pressures [Pa]."""
    phi_a, phi_b, psi_a, psi_b = shapes_at(model, angle)
    share_a, share_b = a / model[FULL_PRESSURE], b / model[FULL_PRESSURE]
    x_a = model[LOW_A] + (model[HIGH_A] - model[LOW_A]) * share_a
    x_b = model[LOW_B] + (model[HIGH_B] - model[LOW_B]) * share_b
    torque = torque_of(x_a, x_b, model[RADIUS], phi_a, phi_b)
    return torque, stiffness_of(x_a, x_b, model[RADIUS], psi_a, psi_b)


@kernel
def pressures_for(model: Any, angle: float, torque: float, stiffness: float) -> tuple[float, float]:
    """Return the pressures [Pa] for torque and stiffness at an angle, torque first."""
    phi_a, phi_b, psi_a, psi_b = shapes_at(model, angle)
    x_a, x_b = allocate(
        torque,
        stiffness,
        model[RADIUS],
        phi_a,
        phi_b,
        psi_a,
        psi_b,
        model[LOW_A],
        model[HIGH_A],
        model[LOW_B],
        model[HIGH_B],
    )
    full = model[FULL_PRESSURE]
    a = full * (x_a - model[LOW_A]) / (model[HIGH_A] - model[LOW_A])
    return a, full * (x_b - model[LOW_B]) / (model[HIGH_B] - model[LOW_B])


@kernel
def own_weight(model: Any, config: Any, angle: float) -> float:
    """Return the torque [N m] that bears the orthosis' own weight, where it bears it."""
    return config[BEARS] * model[WEIGHT] * sine_of_turns(angle * PER_TURN)  # type: ignore[no-any-return]


@kernel
def asked_for(
    rows: Any, settings: Any, choices: Any, lane: int, angle: float, step: int
) -> tuple[float, float]:
    """Return the torque [N m] and the stiffness [N m/rad] that the task asks for at an angle."""
    config, own = settings[0], choices[AT_OWN]
    if choices[OBJECT_KIND] == SAMPLES:
        k = min(step, choices[N_SAMPLES] - 1)
        return settings[own + 1][k], settings[own + 2][k]
    kind, place, strength = rows[OBJECT][lane], rows[PLACE][lane], rows[STRENGTH][lane]
    level = rows[LEVEL][lane]
    torque = object_torque(kind, angle, place, strength) + own_weight(settings[own], config, angle)
    return torque, object_stiffness(kind, angle, place, strength, level, config[WALL_DEPTH])


@kernel
def within_reach(model: Any, angle: float, torque: float, stiffness: float) -> tuple[float, float]:
    """Return what of a torque and a stiffness the pressures can give at an angle, torque first."""
    a, b = pressures_for(model, angle, torque, stiffness)
    return estimate(model, angle, a, b)
