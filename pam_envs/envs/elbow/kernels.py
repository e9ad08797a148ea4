"""What sets ``PAM/ElbowOrthosis-v0`` apart in a step: actions, references, report, start.

The step itself stands in :mod:`pam_envs.envs.core.step`.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from pam_envs.constants import GRAVITY
from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.step import (
    AT_OWN,
    EPISODE_SECONDS,
    MOST_PREVIEW,
    PERIOD,
    PREVIEW,
    SUBSTEPS,
    write_references,
)
from pam_envs.envs.elbow.layout import (
    ACTION,
    BY_TORQUE,
    C_ANGLE,
    C_PRESSURE,
    CHANNELS,
    COMMAND_RANGE,
    COMMON_SIGNALS,
    COPIED_ROWS,
    E_AIR,
    E_SWITCHINGS,
    E_TRAVEL,
    EFFORT_WEIGHT,
    ENDED,
    FARTHEST_WALL,
    FIRST_COPIED,
    FIXED_SIGNALS,
    HANDLE,
    HEAVIEST,
    HIGHEST,
    HIGHEST_ANGLE,
    HYSTERESIS,
    INFO,
    LEVEL,
    LIGHTEST,
    LOWEST,
    LOWEST_ANGLE,
    M_ANGLE,
    M_PRESSURE,
    MODE,
    MOTION,
    MOTION_HIGH,
    MOTION_KIND,
    MOTION_LOW,
    N_ELEMENTS,
    NEAREST_WALL,
    NOISE_A,
    NOISE_ANGLE,
    OBJECT,
    OBJECT_KIND,
    OLD_A,
    OLD_ACTION,
    OLD_B,
    OLD_COMMAND_A,
    OLD_COMMAND_B,
    OLD_SEEN,
    OLD_SWITCHES,
    OLD_USED,
    OUTPUT,
    PLACE,
    PULSED,
    R_EFFORT,
    R_ENDED,
    R_STIFFNESS,
    R_TORQUE,
    REF,
    S_OBJECT_TORQUE,
    S_STIFFNESS_CLIPPED,
    S_STIFFNESS_REFERENCE,
    S_TORQUE_CLIPPED,
    SATURATED,
    SEEN_A,
    SEEN_ANGLE,
    SEEN_B,
    SENSOR_STIFFNESS,
    SENSOR_TORQUE,
    SIGNALS,
    SOFT_PRESSURE,
    SOFTEST_FREE,
    SOFTEST_HELD,
    SOFTEST_WALL,
    START,
    START_SHARE,
    STIFFEST_FREE,
    STIFFEST_HELD,
    STIFFEST_WALL,
    STIFFNESS_SCALE,
    STIFFNESS_WEIGHT,
    STRENGTH,
    TASK,
    TIME,
    TORQUE_SCALE,
    TORQUE_WEIGHT,
    WINDOW,
    WORST_PERIOD,
)
from pam_envs.envs.elbow.program import asked_for, estimate, own_weight, pressures_for, within_reach
from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.random import normal, uniform
from pam_envs.plants.elbow_orthosis import rows as K
from pam_envs.plants.elbow_orthosis.step import (
    N_WORK,
    advance,
    begin_lane,
    replacements,
    start_hysteresis,
)
from pam_envs.references.reaches import draw_motion, motion_at
from pam_envs.sensing.sensor import read_sensor
from pam_envs.tasks.torque_stiffness import FREE, MIXED, WALL, WEIGHT, error_reward
from pam_envs.tasks.tracking import effort_reward, ended_reward, excess


@kernel
def apply_elbow(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Move the wearer's intention on, and turn what is asked for into commands to the valves.

    Pulses are kept as they were taken until the next ones are.
    """
    step, period, by_torque = counts[K.STEP], settings[0][PERIOD], choices[MODE] == BY_TORQUE
    model = settings[choices[AT_OWN]]
    for j in range(LANES):
        keep_period(rows, j)
        angle, rate, acceleration = motion_at(rows, MOTION, j, (step[j] + 1) * period)
        rows[K.INTENT][j] = angle
        rows[K.INTENT_RATE][j] = rate
        rows[K.INTENT_ACCELERATION][j] = acceleration
    for j in range(LANES):
        a, b = rows[ACTION][j], rows[ACTION + 1][j]
        if by_torque:
            wanted, stiff = a, b
            a, b = pressures_for(model, rows[SEEN_ANGLE][j], wanted, stiff)
            torque, stiffness = estimate(model, rows[SEEN_ANGLE][j], a, b)
            if abs(torque - wanted) + abs(stiffness - stiff) > 1e-9:
                work[SATURATED][j] = 1.0
        if choices[PULSED] > 0 and rows[K.CLOCK][j] >= 0.5 * period:
            a, b = rows[K.COMMAND_A][j], rows[K.COMMAND_B][j]
        rows[K.COMMAND_A][j] = a
        rows[K.COMMAND_B][j] = b


@kernel
def keep_period(rows: Any, j: int) -> None:
    """Keep what the period's effort is counted from, and what the sensors gave before it."""
    rows[OLD_COMMAND_A][j] = rows[K.COMMAND_A][j]
    rows[OLD_COMMAND_B][j] = rows[K.COMMAND_B][j]
    rows[OLD_A][j] = rows[K.PRESSURE_A][j]
    rows[OLD_B][j] = rows[K.PRESSURE_B][j]
    rows[OLD_USED][j] = rows[K.USED][j]
    rows[OLD_SWITCHES][j] = rows[K.SWITCHES][j]
    rows[OLD_SEEN][j] = rows[SEEN_ANGLE][j]


@kernel
def advance_elbow(
    rows: Any,
    fixed: Any,
    counts: Any,
    tables: Any,
    samples: Any,
    settings: Any,
    choices: Any,
    work: Any,
) -> None:
    """Advance the plant by a control period."""
    advance(
        rows,
        fixed,
        counts,
        tables,
        HYSTERESIS,
        choices[N_ELEMENTS],
        choices[SUBSTEPS],
        settings[0][PERIOD],
        work,
    )


@kernel
def reference_at(
    rows: Any,
    fixed: Any,
    samples: Any,
    settings: Any,
    choices: Any,
    step: int,
    lane: int,
    channel: int,
) -> float:
    """Return the reference of one lane at a control period, at the angle that is intended then."""
    angle, _, _ = motion_at(rows, MOTION, lane, step * settings[0][PERIOD])
    torque, stiffness = asked_for(rows, settings, choices, lane, angle, step)
    torque, stiffness = within_reach(settings[choices[AT_OWN]], angle, torque, stiffness)
    return torque if channel == 0 else stiffness


@kernel
def read_elbow(rows: Any, fixed: Any, counts: Any, j: int) -> None:
    """Write what the sensors give for lane ``j``."""
    step, key_a, key_b = counts[K.STEP][j], counts[K.KEY_A][j], counts[K.KEY_B][j]
    rows[SEEN_ANGLE][j] = read_sensor(
        rows[K.ANGLE][j],
        fixed[K.ANGLE_NOISE][j],
        fixed[K.ANGLE_RESOLUTION][j],
        fixed[K.ANGLE_BIAS][j],
        normal(key_a, key_b, NOISE_ANGLE, step),
    )
    for k in range(2):
        rows[SEEN_A + k][j] = read_sensor(
            rows[K.PRESSURE_A + k][j],
            fixed[K.PRESSURE_NOISE][j],
            fixed[K.PRESSURE_RESOLUTION][j],
            fixed[K.PRESSURE_BIAS][j],
            normal(key_a, key_b, NOISE_A + k, step),
        )


@kernel
def observe(rows: Any, counts: Any, settings: Any, choices: Any, work: Any, j: int) -> None:
    """Write the observation of lane ``j`` but for the previews, from what the sensors gave."""
    model, step = settings[choices[AT_OWN]], counts[K.STEP][j]
    angle, before = rows[SEEN_ANGLE][j], rows[OLD_SEEN][j]
    torque, stiffness = estimate(model, angle, rows[SEEN_A][j], rows[SEEN_B][j])
    work[SENSOR_TORQUE][j], work[SENSOR_STIFFNESS][j] = torque, stiffness
    work[SIGNALS][j] = angle
    work[SIGNALS + 1][j] = (angle - before) / settings[0][PERIOD] if step > 0 else 0.0
    work[SIGNALS + 2][j] = rows[SEEN_A][j]
    work[SIGNALS + 3][j] = rows[SEEN_B][j]
    work[SIGNALS + 4][j] = rows[K.COMMAND_A][j]
    work[SIGNALS + 5][j] = rows[K.COMMAND_B][j]
    work[SIGNALS + 6][j] = torque
    work[SIGNALS + 7][j] = stiffness
    if choices[PULSED] > 0:
        work[SIGNALS + 8][j] = max(0.0, rows[K.CLOCK][j])
    wanted, stiff = asked_for(rows, settings, choices, j, angle, step)
    wanted, stiff = within_reach(model, angle, wanted, stiff)
    first = SIGNALS + choices[FIXED_SIGNALS]
    work[first][j] = wanted
    work[first + choices[PREVIEW] + 1][j] = stiff


@kernel
def evaluate(
    rows: Any, fixed: Any, counts: Any, ahead: Any, settings: Any, choices: Any, work: Any
) -> None:
    """Write what can be observed and reported of a tile into ``work``."""
    write_references(counts, ahead, choices, work, SIGNALS + choices[FIXED_SIGNALS])
    for j in range(LANES):
        read_elbow(rows, fixed, counts, j)
    for j in range(LANES):
        observe(rows, counts, settings, choices, work, j)
        judge(rows, counts, settings, choices, work, j)
    for k in range(len(COPIED_ROWS)):
        source, to = rows[COPIED_ROWS[k]], work[FIRST_COPIED + k]
        for j in range(LANES):
            to[j] = source[j]


@kernel
def judge(rows: Any, counts: Any, settings: Any, choices: Any, work: Any, j: int) -> None:
    """Write what is asked of lane ``j`` where it truly is, rewards, costs, margins and efforts."""
    config, model, step = settings[0], settings[choices[AT_OWN]], counts[K.STEP][j]
    angle, torque = rows[K.ANGLE][j], rows[K.TORQUE][j]
    asked, stiff = asked_for(rows, settings, choices, j, angle, step)
    wanted, stiffness = within_reach(model, angle, asked, stiff)
    work[TIME][j] = step * config[PERIOD]
    work[REF][j], work[OUTPUT][j] = wanted, torque
    work[S_STIFFNESS_REFERENCE][j] = stiffness
    work[S_OBJECT_TORQUE][j] = asked - own_weight(model, config, angle)
    work[S_TORQUE_CLIPPED][j] = asked - wanted
    work[S_STIFFNESS_CLIPPED][j] = stiff - stiffness
    work[R_TORQUE][j] = error_reward(torque - wanted, config[TORQUE_SCALE], config[TORQUE_WEIGHT])
    work[R_STIFFNESS][j] = error_reward(
        rows[K.STIFFNESS][j] - stiffness, config[STIFFNESS_SCALE], config[STIFFNESS_WEIGHT]
    )
    moved = effort_of(rows, choices, j)
    work[R_EFFORT][j] = effort_reward(moved, config[COMMAND_RANGE], config[EFFORT_WEIGHT])
    a, b = rows[K.PRESSURE_A][j], rows[K.PRESSURE_B][j]
    work[C_PRESSURE][j] = excess(max(a, b), config[SOFT_PRESSURE])
    work[M_PRESSURE][j] = config[SOFT_PRESSURE] - max(a, b)
    beyond = max(model[LOWEST] - angle, angle - model[HIGHEST])
    work[C_ANGLE][j] = excess(beyond, 0.0)
    work[M_ANGLE][j] = min(angle - config[LOWEST_ANGLE], config[HIGHEST_ANGLE] - angle)
    work[ENDED][j] = 1.0 if work[M_ANGLE][j] < 0.0 else 0.0
    work[R_ENDED][j] = ended_reward(
        work[ENDED][j],
        work[TIME][j],
        config[EPISODE_SECONDS],
        config[PERIOD],
        config[WORST_PERIOD],
    )
    work[E_TRAVEL][j] = abs(a - rows[OLD_A][j]) + abs(b - rows[OLD_B][j])
    work[E_AIR][j] = max(0.0, rows[K.USED][j] - rows[OLD_USED][j])
    work[E_SWITCHINGS][j] = rows[K.SWITCHES][j] - rows[OLD_SWITCHES][j]


@kernel
def effort_of(rows: Any, choices: Any, j: int) -> float:
    """Return how far both set-points moved, or how long both pulses are that were last taken."""
    a, b = rows[K.COMMAND_A][j], rows[K.COMMAND_B][j]
    if choices[PULSED] > 0:
        return abs(a) + abs(b)
    return abs(a - rows[OLD_COMMAND_A][j]) + abs(b - rows[OLD_COMMAND_B][j])


@routine
def draw_object(rows: Any, counts: Any, settings: Any, choices: Any, j: int) -> None:
    """Draw the virtual object of lane ``j``."""
    key_a, key_b, config = counts[K.KEY_A][j], counts[K.KEY_B][j], settings[0]
    kind = choices[OBJECT_KIND]
    if kind == MIXED:
        kind = int(3.0 * uniform(key_a, key_b, TASK, 0))
    kind = min(kind, FREE)
    u = uniform(key_a, key_b, TASK, 1)
    strength = 0.0
    if kind == WEIGHT:
        mass = config[LIGHTEST] + (config[HEAVIEST] - config[LIGHTEST]) * u
        strength = mass * GRAVITY * config[HANDLE]
    if kind == WALL:
        strength = config[SOFTEST_WALL] + (config[STIFFEST_WALL] - config[SOFTEST_WALL]) * u
    place, soft = uniform(key_a, key_b, TASK, 2), uniform(key_a, key_b, TASK, 3)
    least, most = config[SOFTEST_FREE], config[STIFFEST_FREE]
    if kind == WEIGHT:
        least, most = config[SOFTEST_HELD], config[STIFFEST_HELD]
    rows[LEVEL][j] = least + (most - least) * soft
    rows[OBJECT][j] = float(kind)
    rows[PLACE][j] = config[NEAREST_WALL] + (config[FARTHEST_WALL] - config[NEAREST_WALL]) * place
    rows[STRENGTH][j] = strength


@routine
def begin_elbow(
    rows: Any,
    fixed: Any,
    counts: Any,
    tables: Any,
    samples: Any,
    settings: Any,
    choices: Any,
    work: Any,
    member: int,
    j: int,
) -> None:
    """Bring lane ``j`` to rest where the wearer holds it, and draw motion and object."""
    key_a, key_b, config = counts[K.KEY_A][j], counts[K.KEY_B][j], settings[0]
    model = settings[choices[AT_OWN]]
    counts[K.MEMBER][j] = member
    low, high = config[MOTION_LOW], config[MOTION_HIGH]
    draw_motion(rows, MOTION, j, key_a, key_b, choices[MOTION_KIND], low, high, config[WINDOW])
    draw_object(rows, counts, settings, choices, j)
    angle, _, _ = motion_at(rows, MOTION, j, 0.0)
    rows[K.INTENT][j], rows[K.INTENT_RATE][j] = angle, 0.0
    rows[K.INTENT_ACCELERATION][j] = 0.0
    rows[K.DISTURBANCE][j] = 0.0
    torque, stiffness = asked_for(rows, settings, choices, j, angle, 0)
    a, b = pressures_for(model, angle, torque, stiffness)
    if config[START_SHARE] > 0.0:
        a = config[START_SHARE] * uniform(key_a, key_b, START, 0)
        b = config[START_SHARE] * uniform(key_a, key_b, START, 1)
    if choices[PULSED] > 0:
        a, b = min(a, fixed[K.SUPPLY_PRESSURE][j]), min(b, fixed[K.SUPPLY_PRESSURE][j])
    start_hysteresis(rows, counts, HYSTERESIS, j)
    begin_lane(rows, fixed, counts, tables, HYSTERESIS, choices[N_ELEMENTS], j, a, b)
    rows[ACTION][j], rows[ACTION + 1][j] = rows[K.COMMAND_A][j], rows[K.COMMAND_B][j]
    if choices[MODE] == BY_TORQUE:
        rows[ACTION][j], rows[ACTION + 1][j] = estimate(model, angle, a, b)
    rows[SEEN_ANGLE][j] = rows[K.ANGLE][j]
    keep_period(rows, j)


@lru_cache(maxsize=16)
def kernels_for(kind: str, valves: str) -> Kernels:
    """Return the kernels for a kind of hysteresis and a make of the valves."""
    functions = {
        "env_apply": apply_elbow,
        "env_advance": advance_elbow,
        "env_reference": reference_at,
        "env_evaluate": evaluate,
        "env_begin": begin_elbow,
        **replacements(kind, valves),
    }
    return Kernels(
        f"elbow_{kind}_{valves}",
        kernels_for,
        (kind, valves),
        functions,
        info=INFO,
        rows=HYSTERESIS + state_rows(kind),
        parameters=K.N_PARAMETERS,
        counts=K.N_COUNTS,
        scratch=N_WORK,
        signals=COMMON_SIGNALS + 1 + CHANNELS * (1 + MOST_PREVIEW),
        set_points=ACTION,
        old_set_points=OLD_ACTION,
        channels=CHANNELS,
    )
