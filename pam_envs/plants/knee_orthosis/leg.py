"""The wearer's stride at one phase: path, ground force, demand on the knee, muscles."""

from __future__ import annotations

from typing import Any

from pam_envs.constants import GRAVITY
from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import kernel, routine
from pam_envs.mechanics.leg import (
    centre_of_pressure,
    gravity_stiffness,
    ground_torque,
    knee_acceleration,
    shank_torque,
)
from pam_envs.muscle.emg import activation, excitation, left_of_gap
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.references.gait import (
    ANKLE,
    COP,
    GROUND_X,
    GROUND_Z,
    KNEE,
    NATURAL_STRIDE,
    SHANK,
    curve,
    curve_and_rates,
)
from pam_envs.sensing.shoe import estimated_torque, heel_load


@routine
def gait_at(rows: Any, fixed: Any, gait: Any, j: int, phase: float) -> None:
    """Write the stride of one lane at a phase, 0 to 1: path, ground, demand, hold."""
    pace = 1.0 / fixed[K.STRIDE_TIME][j]
    knee, knee_turn, knee_bend = curve_and_rates(gait, KNEE, phase)
    lean, lean_turn, lean_bend = curve_and_rates(gait, SHANK, phase)
    weight = fixed[K.LEG_BODY_MASS][j] * GRAVITY
    loaded = curve(gait, GROUND_Z, phase)
    quick = NATURAL_STRIDE * pace
    rows[K.PHASE][j] = phase
    rows[K.KNEE][j] = knee
    rows[K.KNEE_RATE][j] = knee_turn * pace
    rows[K.KNEE_ACCELERATION][j] = knee_bend * pace * pace
    rows[K.SHANK][j] = lean
    rows[K.ANKLE][j] = curve(gait, ANKLE, phase)
    rows[K.GROUND_Z][j] = weight * loaded
    leaning = curve(gait, GROUND_X, phase)
    rows[K.GROUND_X][j] = weight * leaning * quick * quick
    rows[K.COP][j] = centre_of_pressure(
        curve(gait, COP, phase),
        leaning,
        loaded,
        quick,
        fixed[K.LEG_AIM_HEIGHT][j],
        fixed[K.SHOE_HEEL][j],
        fixed[K.SHOE_TIP][j],
    )
    ahead, up = knee_acceleration(
        knee - lean,
        (knee_turn - lean_turn) * pace,
        (knee_bend - lean_bend) * pace * pace,
        fixed[K.LEG_THIGH][j],
    )
    sine, cosine = sine_and_cosine(lean)
    balance(rows, fixed, j, sine, cosine, ahead, up, lean_bend * pace * pace)
    restoring = gravity_stiffness(
        sine, cosine, ahead, up, fixed[K.LEG_MASS][j], fixed[K.LEG_CENTRE][j]
    )
    hold(rows, fixed, j, loaded, restoring)


@kernel
def balance(
    rows: Any, fixed: Any, j: int, sine: float, cosine: float, ahead: float, up: float,
    angular: float,
) -> None:  # fmt: skip
    """Write the load torque of the knee, its estimate by Eq. (1), and the load on the heel."""
    vertical, cop = rows[K.GROUND_Z][j], rows[K.COP][j]
    shank = fixed[K.LEG_SHANK][j]
    ground = ground_torque(
        vertical, rows[K.GROUND_X][j], cop, sine, cosine, shank, fixed[K.LEG_ANKLE_HEIGHT][j]
    )
    rows[K.DEMAND][j] = ground + shank_torque(
        sine, cosine, ahead, up, angular, fixed[K.LEG_MASS][j], fixed[K.LEG_CENTRE][j],
        fixed[K.LEG_INERTIA][j],
    )  # fmt: skip
    flat = fixed[K.SHOE_FLAT_FOOT][j]
    inclination = (1.0 - flat) * rows[K.SHANK][j] + flat * rows[K.ANKLE][j]
    seen, _ = sine_and_cosine(inclination)
    rows[K.ESTIMATE][j] = estimated_torque(vertical, cop, seen, shank)
    heel = heel_load(vertical, cop, fixed[K.SHOE_HEEL][j], fixed[K.SHOE_TIP][j])
    rows[K.HEEL][j] = heel
    rows[K.STANCE][j] = 1.0 if heel > fixed[K.SHOE_THRESHOLD][j] else 0.0


@kernel
def hold(rows: Any, fixed: Any, j: int, loaded: float, restoring: float) -> None:
    """Write stiffness [N m/rad] and damping [N m s/rad] with which the wearer holds his path."""
    passive, free = fixed[K.LEG_STIFFNESS][j], fixed[K.LEG_HOLD_STIFFNESS][j]
    rows[K.HOLD][j] = passive + free + restoring + fixed[K.LEG_STANCE_STIFFNESS][j] * loaded
    passive, free = fixed[K.LEG_DAMPING][j], fixed[K.LEG_HOLD_DAMPING][j]
    rows[K.HOLD_RATE][j] = passive + free + fixed[K.LEG_STANCE_DAMPING][j] * loaded


@kernel
def excite(fixed: Any, j: int, torque: float) -> float:
    """Return the excitation of muscles that bear a torque [N m]."""
    return excitation(torque, fixed[K.ACTIVATION_LARGEST_TORQUE][j], fixed[K.ACTIVATION_FLOOR][j])


@kernel
def start_muscles(rows: Any, fixed: Any, j: int) -> None:
    """Set the activity of the wearer's muscles to that without the orthosis."""
    demand = rows[K.DEMAND][j]
    rows[K.QUADS][j] = rows[K.QUADS_FREE][j] = excite(fixed, j, demand)
    rows[K.FLEXORS][j] = rows[K.FLEXORS_FREE][j] = excite(fixed, j, -demand)


@kernel
def share_muscles(rows: Any, fixed: Any, j: int, period: float) -> None:
    """Advance the activations, with the orthosis' torque as delivered and without it."""
    risen = left_of_gap(period, fixed[K.ACTIVATION_RISE_TIME][j])
    fallen = left_of_gap(period, fixed[K.ACTIVATION_FALL_TIME][j])
    demand = rows[K.DEMAND][j]
    rest = demand - rows[K.TORQUE][j]
    rows[K.QUADS][j] = activation(rows[K.QUADS][j], excite(fixed, j, rest), risen, fallen)
    rows[K.FLEXORS][j] = activation(rows[K.FLEXORS][j], excite(fixed, j, -rest), risen, fallen)
    free = excite(fixed, j, demand)
    rows[K.QUADS_FREE][j] = activation(rows[K.QUADS_FREE][j], free, risen, fallen)
    free = excite(fixed, j, -demand)
    rows[K.FLEXORS_FREE][j] = activation(rows[K.FLEXORS_FREE][j], free, risen, fallen)
