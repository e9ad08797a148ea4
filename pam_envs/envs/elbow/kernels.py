"""Kernels of ``PAM/ElbowOrthosis-v0``: model computations, actions, references, report, start.

The model computations (estimates, references, allocation of pressures) use the nominal bundles and
the readings, and neglect friction.
"""

from functools import lru_cache
from typing import Any

from pam_envs.constants import GRAVITY
from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.kernels import advance_plant, report_end, report_pressure, sense
from pam_envs.envs.core.step import CHOICE, PERIOD
from pam_envs.envs.elbow import layout as L
from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.arithmetic import PER_TURN, sine_of_turns
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.random import uniform
from pam_envs.mechanics.allocation import allocate, stiffness_of, torque_of
from pam_envs.plants.elbow_orthosis import rows as K
from pam_envs.plants.elbow_orthosis.step import (
    SENSED_ANGLE,
    SENSED_PRESSURE,
    advance,
    begin_lane,
    operators,
    replacements,
    start_hysteresis,
)
from pam_envs.references.reaches import draw_motion, motion_at
from pam_envs.tasks.rewards import error_reward, excess
from pam_envs.tasks.torque_stiffness import (
    FREE,
    MIXED,
    WALL,
    WEIGHT,
    object_stiffness,
    object_torque,
)


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


@kernel
def apply_elbow(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Advance the intended motion, and convert actions to commands of the valves.

    Pulses keep their widths until the next ones are taken.
    """
    step, period, model = counts[K.STEP], settings[0][PERIOD], settings[choices[CHOICE.at_own]]
    for j in range(LANES):
        store_period(rows, j)
        rows[K.INTENT][j], rows[K.INTENT_RATE][j], rows[K.INTENT_ACCELERATION][j] = motion_at(
            rows, L.MOTION, j, counts[K.KEY_A][j], counts[K.KEY_B][j], (step[j] + 1) * period
        )
    for j in range(LANES):
        a, b = rows[L.ACTION][j], rows[L.ACTION + 1][j]
        if choices[L.CHOICE.mode] == L.BY_TORQUE:
            desired, stiff = a, b
            a, b = pressures_for(model, rows[L.READ_ANGLE][j], desired, stiff)
            torque, stiffness = estimate(model, rows[L.READ_ANGLE][j], a, b)
            if abs(torque - desired) + abs(stiffness - stiff) > 1e-9:
                work[L.INFO.saturated][j] = 1.0
        if choices[L.CHOICE.pulsed] > 0 and rows[K.CLOCK][j] >= 0.5 * period:
            a, b = rows[K.COMMAND_A][j], rows[K.COMMAND_B][j]
        rows[K.COMMAND_A][j], rows[K.COMMAND_B][j] = a, b


@kernel
def store_period(rows: Any, j: int) -> None:
    """Store the values from which the period's effort is counted, and the last reading."""
    rows[L.OLD_COMMAND_A][j] = rows[K.COMMAND_A][j]
    rows[L.OLD_COMMAND_B][j] = rows[K.COMMAND_B][j]
    rows[L.OLD_A][j] = rows[K.PRESSURE_A][j]
    rows[L.OLD_B][j] = rows[K.PRESSURE_B][j]
    rows[L.OLD_USED][j] = rows[K.USED][j]
    rows[L.OLD_SWITCHES][j] = rows[K.SWITCHES][j]
    rows[L.OLD_READ][j] = rows[L.READ_ANGLE][j]


@kernel
def reference_at(
    rows: Any, fixed: Any, counts: Any, samples: Any, settings: Any, choices: Any, step: int,
    lane: int, channel: int,
) -> float:  # fmt: skip
    """Return the reference of one lane at a control period, at the angle intended then."""
    angle, _, _ = motion_at(
        rows, L.MOTION, lane, counts[K.KEY_A][lane], counts[K.KEY_B][lane],
        step * settings[0][PERIOD],
    )  # fmt: skip
    torque, stiffness = desired_at(rows, settings, choices, lane, angle, step)
    torque, stiffness = within_reach(settings[choices[CHOICE.at_own]], angle, torque, stiffness)
    return torque if channel == 0 else stiffness


@kernel
def advance_elbow(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any,
) -> None:  # fmt: skip
    """Advance the plant by a control period and read its sensors."""
    advance_plant(rows, fixed, counts, tables, samples, settings, choices, work)
    step = counts[K.STEP]
    for j in range(LANES):
        read_elbow(rows, fixed, counts, step[j] + 1, j)


@kernel
def read_elbow(rows: Any, fixed: Any, counts: Any, step: int, j: int) -> None:
    """Read the sensors of lane ``j`` at a control period."""
    rows[L.READ_ANGLE][j] = sense(
        rows[SENSED_ANGLE][j], fixed, counts, K.ANGLE_NOISE, L.NOISE_ANGLE, step, j
    )
    for k in range(2):
        rows[L.READ_A + k][j] = sense(
            rows[SENSED_PRESSURE + k][j], fixed, counts, K.PRESSURE_NOISE, L.NOISE_A + k, step, j
        )


@kernel
def observe(rows: Any, counts: Any, settings: Any, choices: Any, work: Any, j: int) -> None:
    """Write rate, estimates, and references at the sensed angle of lane ``j``."""
    model, step = settings[choices[CHOICE.at_own]], counts[K.STEP][j]
    angle, before = rows[L.READ_ANGLE][j], rows[L.OLD_READ][j]
    torque, stiffness = estimate(model, angle, rows[L.READ_A][j], rows[L.READ_B][j])
    work[L.INFO.sensor_torque][j] = work[L.SIGNALS + 6][j] = torque
    work[L.INFO.sensor_stiffness][j] = work[L.SIGNALS + 7][j] = stiffness
    work[L.SIGNALS + 1][j] = (angle - before) / settings[0][PERIOD] if step > 0 else 0.0
    if choices[L.CHOICE.pulsed] > 0:
        work[L.SIGNALS + 8][j] = max(0.0, rows[K.CLOCK][j])
    torque, stiffness = desired_at(rows, settings, choices, j, angle, step)
    torque, stiffness = within_reach(model, angle, torque, stiffness)
    first = L.SIGNALS + choices[CHOICE.fixed]
    work[first][j] = torque
    work[first + choices[CHOICE.preview] + 1][j] = stiffness


@kernel
def evaluate(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Write observation, references at the true angle, rewards, costs, margins and efforts."""
    config, model, step = settings[0], settings[choices[CHOICE.at_own]], counts[K.STEP]
    for j in range(LANES):
        observe(rows, counts, settings, choices, work, j)
        angle, torque = rows[K.ANGLE][j], rows[K.TORQUE][j]
        desired, stiff = desired_at(rows, settings, choices, j, angle, step[j])
        reference, stiffness = within_reach(model, angle, desired, stiff)
        work[L.INFO.reference][j], work[L.INFO.output][j] = reference, torque
        work[L.INFO.state_stiffness_reference][j] = stiffness
        work[L.INFO.state_object_torque][j] = desired - own_weight(model, config, angle)
        work[L.INFO.state_torque_clipped][j] = desired - reference
        work[L.INFO.state_stiffness_clipped][j] = stiff - stiffness
        work[L.INFO.reward_torque][j] = error_reward(
            torque - reference, config[L.CONFIG.torque_scale], config[L.CONFIG.torque_weight]
        )
        error, scale = rows[K.STIFFNESS][j] - stiffness, config[L.CONFIG.stiffness_scale]
        work[L.INFO.reward_stiffness][j] = error_reward(
            error, scale, config[L.CONFIG.stiffness_weight]
        )
        a, b = rows[K.PRESSURE_A][j], rows[K.PRESSURE_B][j]
        moved, full = effort_of(rows, choices, j), config[L.CONFIG.command_range]
        report_pressure(work, config, L.INFO, L.CONFIG, max(a, b), moved, full, j)
        beyond = max(model[L.MODEL.lowest] - angle, angle - model[L.MODEL.highest])
        work[L.INFO.cost_angle][j] = excess(beyond, 0.0)
        margin = min(angle - config[L.CONFIG.lowest_angle], config[L.CONFIG.highest_angle] - angle)
        work[L.INFO.margin_angle][j] = margin
        report_end(work, config, L.INFO, L.CONFIG, L.ENDED, margin < 0.0, j)
        travel = abs(a - rows[L.OLD_A][j]) + abs(b - rows[L.OLD_B][j])
        work[L.INFO.effort_pressure_travel][j] = travel
        work[L.INFO.effort_air][j] = max(0.0, rows[K.USED][j] - rows[L.OLD_USED][j])
        work[L.INFO.effort_switchings][j] = rows[K.SWITCHES][j] - rows[L.OLD_SWITCHES][j]


@kernel
def effort_of(rows: Any, choices: Any, j: int) -> float:
    """Return the change of both setpoints, or the sum of the last pulse widths."""
    a, b = rows[K.COMMAND_A][j], rows[K.COMMAND_B][j]
    if choices[L.CHOICE.pulsed] > 0:
        return abs(a) + abs(b)
    return abs(a - rows[L.OLD_COMMAND_A][j]) + abs(b - rows[L.OLD_COMMAND_B][j])


@kernel
def between(config: Any, low: int, high: int, share: float) -> float:
    """Return a number between two of the configuration, given by their indices."""
    return config[low] + (config[high] - config[low]) * share  # type: ignore[no-any-return]


@routine
def draw_object(rows: Any, counts: Any, settings: Any, choices: Any, j: int) -> None:
    """Draw the virtual object of lane ``j``."""
    key_a, key_b, config = counts[K.KEY_A][j], counts[K.KEY_B][j], settings[0]
    kind = choices[CHOICE.reference]
    if kind == MIXED:
        kind = int(3.0 * uniform(key_a, key_b, L.TASK, 0))
    kind = min(kind, FREE)
    strength, u = 0.0, uniform(key_a, key_b, L.TASK, 1)
    if kind == WEIGHT:
        mass = between(config, L.CONFIG.lightest, L.CONFIG.heaviest, u)
        strength = mass * GRAVITY * config[L.CONFIG.handle]
    if kind == WALL:
        strength = between(config, L.CONFIG.softest_wall, L.CONFIG.stiffest_wall, u)
    place, soft = uniform(key_a, key_b, L.TASK, 2), uniform(key_a, key_b, L.TASK, 3)
    level = between(config, L.CONFIG.softest_free, L.CONFIG.stiffest_free, soft)
    if kind == WEIGHT:
        level = between(config, L.CONFIG.softest_held, L.CONFIG.stiffest_held, soft)
    rows[L.OBJECT][j], rows[L.STRENGTH][j], rows[L.LEVEL][j] = float(kind), strength, level
    rows[L.PLACE][j] = between(config, L.CONFIG.nearest_wall, L.CONFIG.farthest_wall, place)


@routine
def begin_elbow(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any, j: int,
) -> None:  # fmt: skip
    """Bring lane ``j`` to rest where the wearer holds it, and draw motion and object."""
    key_a, key_b, config = counts[K.KEY_A][j], counts[K.KEY_B][j], settings[0]
    model = settings[choices[CHOICE.at_own]]
    low = config[L.CONFIG.motion_low]
    high = config[L.CONFIG.motion_high]
    window = config[L.CONFIG.window]
    draw_motion(rows, L.MOTION, j, key_a, key_b, choices[L.CHOICE.motion], low, high, window)
    draw_object(rows, counts, settings, choices, j)
    angle, _, _ = motion_at(rows, L.MOTION, j, key_a, key_b, 0.0)
    rows[K.INTENT][j], rows[K.INTENT_RATE][j], rows[K.INTENT_ACCELERATION][j] = angle, 0.0, 0.0
    rows[K.DISTURBANCE][j] = 0.0
    torque, stiffness = desired_at(rows, settings, choices, j, angle, 0)
    a, b = pressures_for(model, angle, torque, stiffness)
    if config[L.CONFIG.start_share] > 0.0:
        a = config[L.CONFIG.start_share] * uniform(key_a, key_b, L.START, 0)
        b = config[L.CONFIG.start_share] * uniform(key_a, key_b, L.START, 1)
    if choices[L.CHOICE.pulsed] > 0:
        a, b = min(a, fixed[K.VALVE_SUPPLY_PRESSURE][j]), min(b, fixed[K.VALVE_SUPPLY_PRESSURE][j])
    start_hysteresis(rows, counts, L.HYSTERESIS, j)
    begin_lane(rows, fixed, counts, tables, L.HYSTERESIS, choices[CHOICE.elements], j, a, b)
    rows[L.ACTION][j], rows[L.ACTION + 1][j] = rows[K.COMMAND_A][j], rows[K.COMMAND_B][j]
    if choices[L.CHOICE.mode] == L.BY_TORQUE:
        rows[L.ACTION][j], rows[L.ACTION + 1][j] = estimate(model, angle, a, b)
    rows[L.READ_ANGLE][j] = rows[K.ANGLE][j]
    store_period(rows, j)
    read_elbow(rows, fixed, counts, 0, j)


@lru_cache(maxsize=16)
def kernels_for(kind: str, valves: str, extended: bool = False) -> Kernels:
    """Return the kernels for a hysteresis model and valves, plain or with effects."""
    rows = L.HYSTERESIS + operators(kind) * state_rows(kind)
    return Kernels(
        "elbow",
        kernels_for,
        (kind, valves, extended),
        L.REPORT,
        evaluate,
        begin_elbow,
        rows=rows + (K.STATE.end if extended else 0),
        parameters=K.N_PARAMETERS,
        counts=K.N_COUNTS,
        set_points=L.ACTION,
        old_set_points=L.OLD_ACTION,
        channels=L.CHANNELS,
        config=L.CONFIG,
        choices=L.CHOICE,
        apply=apply_elbow,
        advance=advance_elbow,
        reference=reference_at,
        placeholders={
            "plant_advance": advance,
            "FIRST_HYSTERESIS": L.HYSTERESIS,
            **replacements(kind, valves, rows if extended else None),
        },
    )
