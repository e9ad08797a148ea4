"""Kernels of ``PAM/KneeWalk-v0`` and of stairs: sensors, references, wearer, report, start.

The preview shows the references of the planned stride: from path and pace of the wearer, and from
the nominal parameters of body and brace, before randomization.
"""

from functools import lru_cache
from typing import Any

from pam_envs.constants import GRAVITY
from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.kernels import sense
from pam_envs.envs.core.step import CHOICE, PERIOD
from pam_envs.envs.knee import gait_layout as L
from pam_envs.envs.knee.brace_kernels import advance_knee, air_drawn, report_brace
from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.random import uniform
from pam_envs.mechanics.knee_lever import required_tension as tension_for
from pam_envs.mechanics.leg import centre_of_pressure
from pam_envs.muscle.emg import activation, excitation, left_of_gap
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.step import SENSED, begin_lane, replacements
from pam_envs.references import gait as G
from pam_envs.references.gait import curve, fraction_of_turn, vertical_load
from pam_envs.sensing.butterworth import ROWS as FILTER_ROWS
from pam_envs.sensing.butterworth import butterworth
from pam_envs.sensing.butterworth import settle as settle_filter
from pam_envs.sensing.shoe import estimated_torque, heel_load
from pam_envs.tasks.gait_assistance import desired_assistance, over_assistance
from pam_envs.tasks.rewards import error_reward, excess


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
    quick = G.NATURAL_STRIDE / fixed[K.STRIDE_TIME][j]
    loaded = vertical_load(gait, phase, quick)
    cop = centre_of_pressure(
        curve(gait, G.COP, phase),
        curve(gait, G.GROUND_X, phase),
        loaded,
        quick,
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
    rows: Any, fixed: Any, counts: Any, samples: Any, settings: Any, choices: Any, step: int,
    lane: int, channel: int,
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


VENTED = 1e3
"""Gauge pressure [Pa] up to which a growing muscle draws ambient air, at no cost."""


@kernel
def read(rows: Any, fixed: Any, counts: Any, k: int, step: int, j: int) -> None:
    """Read sensor ``k`` of lane ``j`` at a control period."""
    true, noise = rows[SENSED[k]][j], L.SENSORS[k]
    rows[L.READ_TENSION + k][j] = sense(true, fixed, counts, noise, L.NOISE + k, step, j)


@kernel
def share_of_torque(rows: Any, fixed: Any, settings: Any, choices: Any, j: int) -> float:
    """Return the assistance [N m] of lane ``j`` before the low-pass; detect stance and swing."""
    rows[L.READ_GROUND][j] = max(0.0, rows[L.READ_GROUND][j])
    rows[L.READ_STANCE][j] = 1.0 if rows[L.READ_HEEL][j] > fixed[K.SHOE_THRESHOLD][j] else 0.0
    ankle, config = rows[L.READ_ANKLE][j], settings[0]
    shank = rows[K.SHANK][j] + (ankle - rows[K.ANKLE][j])
    sine, _ = sine_and_cosine(lean(shank, ankle, fixed[K.SHOE_FLAT_FOOT][j]))
    estimate = estimated_torque(
        rows[L.READ_GROUND][j], rows[L.READ_COP][j], sine, config[L.CONFIG.known_shank]
    )
    if choices[CHOICE.reference] == L.DEMAND:
        estimate = rows[K.DEMAND][j]
    return desired_assistance(estimate, config[L.CONFIG.ratio], config[L.CONFIG.lowest_torque])


@kernel
def set_references(rows: Any, fixed: Any, settings: Any, j: int) -> None:
    """Write the references of tension and angle of lane ``j``.

    Stance: the tension of the nominal brace for the desired torque, and the sensed angle. Swing:
    that for no torque, plus a mismatch, and the wearer's path.
    """
    config, torque, shift = settings[0], rows[L.DESIRED_TORQUE][j], 0.0
    angle = rows[L.READ_ANGLE][j]
    if rows[L.READ_STANCE][j] < 0.5:
        torque, shift = 0.0, config[L.CONFIG.mismatch]
        angle = fixed[K.LEVER_MOUNT_ANGLE][j] + rows[K.KNEE][j]
    rows[L.DESIRED_ANGLE][j] = angle
    tension = nominal_tension(config, rows[L.READ_ANGLE][j], torque)
    rows[L.DESIRED_TENSION][j] = shift + tension


@kernel
def work_of_wearer(rows: Any, fixed: Any, settings: Any, period: float, j: int) -> None:
    """Advance the calibrated activation of lane ``j``'s extensors, above the resting level."""
    demand = settings[0][L.CONFIG.demand_share] * rows[K.ESTIMATE][j]
    largest = fixed[K.ACTIVATION_LARGEST_TORQUE][j]
    risen = left_of_gap(period, fixed[K.ACTIVATION_RISE_TIME][j])
    fallen = left_of_gap(period, fixed[K.ACTIVATION_FALL_TIME][j])
    helped = excitation(demand - rows[K.TORQUE][j], largest, 0.0)
    alone = excitation(demand, largest, 0.0)
    rows[L.BEARS][j] = activation(rows[L.BEARS][j], helped, risen, fallen)
    rows[L.BEARS_FREE][j] = activation(rows[L.BEARS_FREE][j], alone, risen, fallen)


@kernel
def advance_leg(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any,
) -> None:  # fmt: skip
    """Advance plant and wearer by a control period, read the sensors, set the references."""
    advance_knee(rows, fixed, counts, tables, samples, settings, choices, work)
    step, torque, period = counts[K.STEP], rows[L.DESIRED_TORQUE], settings[0][PERIOD]
    for k in range(len(L.SENSORS)):
        for j in range(LANES):
            read(rows, fixed, counts, k, step[j] + 1, j)
    for j in range(LANES):
        torque[j] = share_of_torque(rows, fixed, settings, choices, j)
    for j in range(LANES):
        torque[j] = butterworth(rows, L.FILTER, j, torque[j])
    if choices[CHOICE.reference] == L.SAMPLES:
        for j in range(LANES):
            torque[j] = samples[0][min(step[j] + 1, len(samples[0]) - 1)]
    for j in range(LANES):
        set_references(rows, fixed, settings, j)
    for j in range(LANES):
        work_of_wearer(rows, fixed, settings, period, j)


@kernel
def evaluate(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Write true references, rewards, costs, margins and efforts of a tile into ``work``."""
    config, first = settings[0], L.SIGNALS + choices[CHOICE.fixed]
    other = first + choices[CHOICE.preview] + 1
    for j in range(LANES):  # the present references are the true ones and not the planned ones
        work[first][j], work[other][j] = rows[L.DESIRED_TENSION][j], rows[L.DESIRED_ANGLE][j]
    for j in range(LANES):
        desired = rows[L.DESIRED_TENSION][j]
        stance, tension, off = rows[K.STANCE][j], rows[K.TENSION][j], abs(rows[K.DEVIATION][j])
        seen, demand = rows[L.READ_STANCE][j], rows[K.DEMAND][j]
        over = over_assistance(rows[K.TORQUE][j], demand)
        work[L.INFO.reference][j], work[L.INFO.output][j] = desired, tension
        work[L.INFO.state_torque_ideal][j] = config[L.CONFIG.ratio] * demand
        work[L.INFO.reward_tension][j] = error_reward(
            stance * seen * (tension - desired),
            config[L.CONFIG.tension_scale], config[L.CONFIG.tension_weight],
        )  # fmt: skip
        work[L.INFO.reward_angle][j] = error_reward(
            (1.0 - stance) * (1.0 - seen) * off,
            config[L.CONFIG.angle_scale], config[L.CONFIG.angle_weight],
        )  # fmt: skip
        work[L.INFO.reward_over_assistance][j] = error_reward(
            over, config[L.CONFIG.over_scale], config[L.CONFIG.over_weight]
        )
        report_brace(rows, fixed, config, work, L.INFO, L.CONFIG, j)
        work[L.INFO.cost_deviation][j] = excess(off, config[L.CONFIG.soft_deviation])
        work[L.INFO.margin_tension][j] = config[L.CONFIG.highest_tension] - tension
        work[L.INFO.margin_deviation][j] = config[L.CONFIG.largest_deviation] - off
        broken = min(work[L.INFO.margin_tension][j], work[L.INFO.margin_deviation][j])
        work[L.ENDED][j] = 1.0 if broken < 0.0 else 0.0
        work[L.INFO.effort_over_assistance][j] = over
        drawn = air_drawn(rows, fixed, j)
        work[L.INFO.effort_air][j] = drawn if rows[K.PRESSURE][j] > VENTED else 0.0


@routine
def begin_leg(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any, j: int,
) -> None:  # fmt: skip
    """Start lane ``j`` at a phase of the stride, near the pressure that the reference needs."""
    key_a, key_b, config = counts[K.KEY_A][j], counts[K.KEY_B][j], settings[0]
    gait = settings[choices[CHOICE.at_own] :]
    start = config[L.CONFIG.start_phase]
    phase = uniform(key_a, key_b, L.START, 0) if start < 0.0 else start
    share = 1.0 + config[L.CONFIG.start_spread] * (2.0 * uniform(key_a, key_b, L.START, 1) - 1.0)
    torque = prime(rows, fixed, settings, choices, phase, j)
    pressure = share * pressure_for(fixed, gait, torque, phase, j)
    elements = choices[CHOICE.elements]
    begin_lane(rows, fixed, counts, tables, gait, L.HYSTERESIS, elements, j, phase, pressure)
    for k in range(len(L.SENSORS)):
        read(rows, fixed, counts, k, 0, j)
    share_of_torque(rows, fixed, settings, choices, j)
    given = choices[CHOICE.reference] == L.SAMPLES
    rows[L.DESIRED_TORQUE][j] = samples[0][0] if given else torque
    set_references(rows, fixed, settings, j)
    largest = fixed[K.ACTIVATION_LARGEST_TORQUE][j]
    demand = config[L.CONFIG.demand_share] * rows[K.ESTIMATE][j]
    rows[L.BEARS][j] = excitation(demand - rows[K.TORQUE][j], largest, 0.0)
    rows[L.BEARS_FREE][j] = excitation(demand, largest, 0.0)


@lru_cache(maxsize=16)
def kernels_for(kind: str, dynamics: str, extended: bool = False) -> Kernels:
    """Return the kernels for a hysteresis model and a dynamics, plain or with effects."""
    rows = L.HYSTERESIS + state_rows(kind)
    return Kernels(
        "gait",
        kernels_for,
        (kind, dynamics, extended),
        L.REPORT,
        evaluate,
        begin_leg,
        rows=rows + (K.STATE.end if extended else 0),
        parameters=K.N_PARAMETERS,
        counts=K.N_COUNTS,
        set_points=K.SET_POINT,
        old_set_points=K.OLD_SET_POINT,
        channels=L.CHANNELS,
        config=L.CONFIG,
        advance=advance_leg,
        reference=planned_reference,
        placeholders={
            "FIRST_HYSTERESIS": L.HYSTERESIS,
            **replacements(kind, "leg", dynamics, rows if extended else None),
        },
    )
