"""The stride as planned: what the references will be if the wearer goes on as he does.

The plan knows the wearer's path and pace, but of his body and of the brace no more than the
orthosis does: the parameters before any is drawn.
"""

from __future__ import annotations

from typing import Any

from pam_envs.constants import GRAVITY
from pam_envs.envs.core.step import AT_OWN, PERIOD
from pam_envs.envs.knee.gait_layout import (
    ANGLE_CHANNEL,
    FILTER,
    KNOWN_ARM,
    KNOWN_MASS,
    KNOWN_RELAXED,
    KNOWN_SHANK,
    KNOWN_WIRE,
    LOWEST_TORQUE,
    MISMATCH,
    PLAN_FILTER,
    PRIMING,
    RATIO,
    SAMPLES,
    SOURCE,
)
from pam_envs.kernels.build import kernel, routine
from pam_envs.mechanics.knee_lever import wanted_tension
from pam_envs.mechanics.leg import centre_of_pressure, sine_and_cosine
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
    fraction_of_turn,
)
from pam_envs.sensing.butterworth import ROWS as FILTER_ROWS
from pam_envs.sensing.butterworth import butterworth
from pam_envs.sensing.butterworth import settle as settle_filter
from pam_envs.sensing.shoe import estimated_torque, heel_load
from pam_envs.tasks.gait_assistance import assistance_wanted


@kernel
def lean(shank: float, ankle: float, flat_foot: float) -> float:
    """Return the angle [rad] that the shoe's sensor takes for the shank's lean."""
    return shank + flat_foot * (ankle - shank)


@kernel
def planned_sole(
    fixed: Any, gait: Any, phase: float, body_mass: float, j: int
) -> tuple[float, float]:
    """Return ground force [N] and centre of pressure [m] at a phase of the planned stride."""
    loaded = curve(gait, GROUND_Z, phase)
    cop = centre_of_pressure(
        curve(gait, COP, phase),
        curve(gait, GROUND_X, phase),
        loaded,
        NATURAL_STRIDE / fixed[K.STRIDE_TIME][j],
        fixed[K.LEG_AIM_HEIGHT][j],
        fixed[K.SHOE_HEEL][j],
        fixed[K.SHOE_TIP][j],
    )
    return body_mass * GRAVITY * max(0.0, loaded), cop


@kernel
def planned_torque(
    fixed: Any, settings: Any, choices: Any, phase: float, body_mass: float, j: int
) -> tuple[float, bool]:
    """Return the assistance [N m] before the low-pass, and whether it is stance, as planned.

    Of the sensors' estimate for a wearer of ``body_mass`` [kg]: the true demand is not planned
    ahead.
    """
    gait, config = settings[choices[AT_OWN] :], settings[0]
    ground, cop = planned_sole(fixed, gait, phase, body_mass, j)
    inclination = lean(
        curve(gait, SHANK, phase), curve(gait, ANKLE, phase), fixed[K.SHOE_FLAT_FOOT][j]
    )
    sine, _ = sine_and_cosine(inclination)
    estimate = estimated_torque(ground, cop, sine, config[KNOWN_SHANK])
    heel = heel_load(ground, cop, fixed[K.SHOE_HEEL][j], fixed[K.SHOE_TIP][j])
    stance = heel > fixed[K.SHOE_THRESHOLD][j]
    return assistance_wanted(estimate, config[RATIO], config[LOWEST_TORQUE]), stance


@kernel
def planned_reference(
    rows: Any,
    fixed: Any,
    samples: Any,
    settings: Any,
    choices: Any,
    step: int,
    lane: int,
    channel: int,
) -> float:
    """Return the planned tension [N] or angle [rad] of a control period.

    The low-pass has a hysteresis: the periods have to be asked for one after the other.
    """
    config = settings[0]
    turns = rows[K.START_PHASE][lane] + step * config[PERIOD] / fixed[K.STRIDE_TIME][lane]
    phase = fraction_of_turn(turns)
    angle = fixed[K.LEVER_MOUNT_ANGLE][lane] + curve(settings[choices[AT_OWN] :], KNEE, phase)
    if channel == ANGLE_CHANNEL:
        return angle
    share, stance = planned_torque(fixed, settings, choices, phase, config[KNOWN_MASS], lane)
    torque, shift = butterworth(rows, PLAN_FILTER, lane, share), 0.0
    if choices[SOURCE] == SAMPLES:
        torque = samples[0][min(step, len(samples[0]) - 1)]
    if not stance:
        torque, shift = 0.0, config[MISMATCH]
    return shift + wanted_tension(  # type: ignore[no-any-return]
        angle,
        torque,
        config[KNOWN_ARM],
        config[KNOWN_WIRE],
        config[KNOWN_RELAXED],
    )


@routine
def prime(rows: Any, fixed: Any, settings: Any, choices: Any, phase: float, j: int) -> float:
    """Let both low-passes of lane ``j`` see the stride before; return their output [N m].

    The stride before was sensed and not planned: it is of the wearer's true mass.
    """
    per_step = settings[0][PERIOD] / fixed[K.STRIDE_TIME][j]
    start, torque = phase + 1000.0 - PRIMING * per_step, 0.0
    for k in range(PRIMING + 1):
        there = fraction_of_turn(start + k * per_step)
        share, _ = planned_torque(fixed, settings, choices, there, fixed[K.LEG_BODY_MASS][j], j)
        if k == 0:
            settle_filter(rows, FILTER, j, share)
        if k == PRIMING:  # the plan's low-pass will be shown this period by itself
            for i in range(FILTER_ROWS):
                rows[PLAN_FILTER + i][j] = rows[FILTER + i][j]
        torque = butterworth(rows, FILTER, j, share)
    return torque


@routine
def pressure_for(fixed: Any, gait: Any, torque: float, phase: float, j: int) -> float:
    """Return the pressure [Pa] that a muscle without hysteresis would need at a phase of the stride."""
    angle = fixed[K.LEVER_MOUNT_ANGLE][j] + curve(gait, KNEE, phase)
    arm = fixed[K.LEVER_ARM][j]
    tension = wanted_tension(
        angle, torque, arm, fixed[K.LEVER_STIFFNESS][j], fixed[K.LEVER_RELAXED_ANGLE][j]
    )
    sine, _ = sine_and_cosine(0.5 * angle)
    length = 2.0 * arm * sine - fixed[K.LEVER_FITTINGS][j]
    stretch = max(1e-3, length - fixed[K.SHORTEST_LENGTH][j])
    pressure = tension / (stretch * fixed[K.GAIN][j] * fixed[K.STIFFNESS_RATIO][j])
    return max(0.0, min(0.8 * fixed[K.MAX_PRESSURE][j], pressure))
