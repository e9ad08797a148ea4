"""References of the planned stride, for the preview.

The plan uses the path and the pace of the wearer, and the nominal parameters of body and brace,
before randomisation.
"""

from __future__ import annotations

from typing import Any

from pam_envs.constants import GRAVITY
from pam_envs.envs.core.step import CHOICE, PERIOD
from pam_envs.envs.knee import gait_layout as L
from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import kernel, routine
from pam_envs.mechanics.knee_lever import required_tension as tension_for
from pam_envs.mechanics.leg import centre_of_pressure
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.references import gait as G
from pam_envs.references.gait import curve, fraction_of_turn
from pam_envs.sensing.butterworth import ROWS as FILTER_ROWS
from pam_envs.sensing.butterworth import butterworth
from pam_envs.sensing.butterworth import settle as settle_filter
from pam_envs.sensing.shoe import estimated_torque, heel_load
from pam_envs.tasks.gait_assistance import desired_assistance


@kernel
def lean(shank: float, ankle: float, flat_foot: float) -> float:
    """Return the lean of the shank [rad] as the sensor of the shoe measures it."""
    return shank + flat_foot * (ankle - shank)


@kernel
def nominal_tension(config: Any, angle: float, torque: float) -> float:
    """Return the tension [N] of the nominal brace for a torque at an angle."""
    return tension_for(  # type: ignore[no-any-return]
        angle,
        torque,
        config[L.CONFIG.known_arm],
        config[L.CONFIG.known_wire],
        config[L.CONFIG.known_relaxed],
    )


@kernel
def planned_sole(
    fixed: Any, gait: Any, phase: float, body_mass: float, j: int
) -> tuple[float, float]:
    """Return ground force [N] and centre of pressure [m] at a phase of the planned stride."""
    loaded = curve(gait, G.GROUND_Z, phase)
    cop = centre_of_pressure(
        curve(gait, G.COP, phase),
        curve(gait, G.GROUND_X, phase),
        loaded,
        G.NATURAL_STRIDE / fixed[K.STRIDE_TIME][j],
        fixed[K.LEG_AIM_HEIGHT][j],
        fixed[K.SHOE_HEEL][j],
        fixed[K.SHOE_TIP][j],
    )
    return body_mass * GRAVITY * max(0.0, loaded), cop


@kernel
def planned_torque(
    fixed: Any, settings: Any, choices: Any, phase: float, body_mass: float, j: int
) -> tuple[float, bool]:
    """Return the planned assistance [N m] before the low-pass, and whether it is stance."""
    gait, config = settings[choices[CHOICE.at_own] :], settings[0]
    ground, cop = planned_sole(fixed, gait, phase, body_mass, j)
    inclination = lean(
        curve(gait, G.SHANK, phase), curve(gait, G.ANKLE, phase), fixed[K.SHOE_FLAT_FOOT][j]
    )
    sine, _ = sine_and_cosine(inclination)
    estimate = estimated_torque(ground, cop, sine, config[L.CONFIG.known_shank])
    heel = heel_load(ground, cop, fixed[K.SHOE_HEEL][j], fixed[K.SHOE_TIP][j])
    stance = heel > fixed[K.SHOE_THRESHOLD][j]
    ratio, lowest = config[L.CONFIG.ratio], config[L.CONFIG.lowest_torque]
    return desired_assistance(estimate, ratio, lowest), stance


@kernel
def planned_reference(
    rows: Any, fixed: Any, samples: Any, settings: Any, choices: Any, step: int, lane: int,
    channel: int,
) -> float:  # fmt: skip
    """Return the planned tension [N] or angle [rad] of a control period.

    The low-pass has a state: the periods have to be evaluated one after the other.
    """
    config = settings[0]
    turns = rows[K.START_PHASE][lane] + step * config[PERIOD] / fixed[K.STRIDE_TIME][lane]
    phase = fraction_of_turn(turns)
    angle = fixed[K.LEVER_MOUNT_ANGLE][lane] + curve(
        settings[choices[CHOICE.at_own] :], G.KNEE, phase
    )
    if channel == L.ANGLE_CHANNEL:
        return angle
    share, stance = planned_torque(
        fixed, settings, choices, phase, config[L.CONFIG.known_mass], lane
    )
    torque, shift = butterworth(rows, L.PLAN_FILTER, lane, share), 0.0
    if choices[CHOICE.reference] == L.SAMPLES:
        torque = samples[0][min(step, len(samples[0]) - 1)]
    if not stance:
        torque, shift = 0.0, config[L.CONFIG.mismatch]
    return shift + nominal_tension(config, angle, torque)  # type: ignore[no-any-return]


@routine
def prime(rows: Any, fixed: Any, settings: Any, choices: Any, phase: float, j: int) -> float:
    """Run both low-passes of lane ``j`` over the previous stride; return their output [N m].

    The previous stride was sensed, not planned, so that it has the true body mass.
    """
    per_step = settings[0][PERIOD] / fixed[K.STRIDE_TIME][j]
    start, torque = phase + 1000.0 - L.PRIMING * per_step, 0.0
    for k in range(L.PRIMING + 1):
        there = fraction_of_turn(start + k * per_step)
        share, _ = planned_torque(fixed, settings, choices, there, fixed[K.LEG_BODY_MASS][j], j)
        if k == 0:
            settle_filter(rows, L.FILTER, j, share)
        if k == L.PRIMING:  # the low-pass of the plan starts one period later
            for i in range(FILTER_ROWS):
                rows[L.PLAN_FILTER + i][j] = rows[L.FILTER + i][j]
        torque = butterworth(rows, L.FILTER, j, share)
    return torque


@routine
def pressure_for(fixed: Any, gait: Any, torque: float, phase: float, j: int) -> float:
    """Return the pressure [Pa] of a muscle without hysteresis for a torque at a phase."""
    angle = fixed[K.LEVER_MOUNT_ANGLE][j] + curve(gait, G.KNEE, phase)
    arm = fixed[K.LEVER_ARM][j]
    tension = tension_for(
        angle, torque, arm, fixed[K.LEVER_STIFFNESS][j], fixed[K.LEVER_RELAXED_ANGLE][j]
    )
    sine, _ = sine_and_cosine(0.5 * angle)
    length = 2.0 * arm * sine - fixed[K.LEVER_FITTINGS][j]
    stretch = max(1e-3, length - fixed[K.MUSCLE_SHORTEST_LENGTH][j])
    pressure = tension / (stretch * fixed[K.MUSCLE_GAIN][j] * fixed[K.MUSCLE_STIFFNESS_RATIO][j])
    return max(0.0, min(0.8 * fixed[K.REGULATOR_MAX_PRESSURE][j], pressure))
