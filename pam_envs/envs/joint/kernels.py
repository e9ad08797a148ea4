"""What sets ``PAM/AntagonisticJoint-v0`` apart in a step: actions, disturbance, report, start.

The step itself stands in :mod:`pam_envs.envs.core.step`.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.payload import carry_payload, draw_payload
from pam_envs.envs.core.step import (
    AT_OWN,
    EPISODE_SECONDS,
    MOST_PREVIEW,
    PERIOD,
    SUBSTEPS,
    write_references,
)
from pam_envs.envs.joint.layout import (
    ACTION,
    AMPLITUDE,
    BY_BOTH,
    BY_PRESSURE,
    C_ANGLE,
    C_PRESSURE,
    COMMON_SIGNALS,
    COPIED_ROWS,
    DISTURBANCE,
    E_AIR,
    E_TRAVEL,
    EFFORT_WEIGHT,
    ENDED,
    ERROR_SCALE,
    FAMILY,
    FIRST_COPIED,
    FIXED_SIGNALS,
    FREQUENCY,
    HYSTERESIS,
    INFO,
    LARGEST_ANGLE,
    M_ANGLE,
    M_PRESSURE,
    MODE,
    N_ELEMENTS,
    N_PAYLOADS,
    N_SINES,
    NOISE_A,
    NOISE_ANGLE,
    OLD_A,
    OLD_ACTION,
    OLD_AIR,
    OLD_B,
    OLD_SET_A,
    OLD_SET_B,
    OUTPUT,
    PAYLOAD_CHANGE,
    PRESTRESS,
    PULSE,
    PULSE_WINDOW,
    PULSES,
    R_EFFORT,
    R_ENDED,
    R_TRACKING,
    REF,
    REFERENCE,
    SATURATED,
    SENSOR_A,
    SENSOR_ANGLE,
    SENSOR_B,
    SIGNALS,
    SINE,
    SOFT_ANGLE,
    SOFT_PRESSURE,
    START,
    START_ANGLE,
    STEP,
    STEP_SECONDS,
    TIME,
    TOLD_PAYLOAD,
    TRACKING_WEIGHT,
    WORST_PERIOD,
)
from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.arithmetic import sine_of_turns
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.random import normal, uniform
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint.pair import command
from pam_envs.plants.antagonistic_joint.step import (
    N_WORK,
    advance,
    begin_lane,
    replacements,
    start_hysteresis,
)
from pam_envs.references.trajectory import SAMPLES, draw_reference, reference_value
from pam_envs.sensing.sensor import read_sensor
from pam_envs.tasks.tracking import effort_reward, ended_reward, excess, tracking_reward


@kernel
def pulse(key_a: int, key_b: int, step: int, size: float) -> float:
    """Return the disturbance [N m] in a control period: a pulse in every window of 5 s.

    It lasts 1 s; when it begins, its sign and its size, from half of ``size`` on, are drawn.
    """
    window = step // PULSE_WINDOW
    first = int(0.2 * PULSE_WINDOW + 0.5 * PULSE_WINDOW * uniform(key_a, key_b, PULSES, 2 * window))
    since = step - window * PULSE_WINDOW - first
    if since < 0 or since >= PULSE:
        return 0.0
    drawn = 2.0 * uniform(key_a, key_b, PULSES, 2 * window + 1) - 1.0
    return size * (0.5 * drawn + (0.5 if drawn > 0.0 else -0.5))


@kernel
def apply_joint(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Change payload and disturbance at their times, and turn what is asked for into pressures."""
    step, config, mode = counts[K.STEP], settings[0], choices[MODE]
    carry_payload(rows, step, config[PERIOD], TOLD_PAYLOAD, K.PAYLOAD)
    for j in range(LANES):
        rows[OLD_SET_A][j] = rows[K.SET_POINT_A][j]
        rows[OLD_SET_B][j] = rows[K.SET_POINT_B][j]
    if config[DISTURBANCE] > 0.0:
        for j in range(LANES):
            rows[K.DISTURBANCE][j] = pulse(
                counts[K.KEY_A][j], counts[K.KEY_B][j], step[j], config[DISTURBANCE]
            )
    for j in range(LANES):
        if mode == BY_PRESSURE:
            rows[K.SET_POINT_A][j] = rows[ACTION][j]
            rows[K.SET_POINT_B][j] = rows[ACTION + 1][j]
        else:
            prestress = rows[ACTION + 1][j] if mode == BY_BOTH else config[PRESTRESS]
            short = command(
                rows, fixed, j, rows[ACTION][j], prestress, K.COMMAND, K.PRESTRESS, K.SET_POINT_A
            )
            work[SATURATED][j] = max(work[SATURATED][j], short)


@kernel
def advance_joint(
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
    """Return the reference [rad] of one lane at a control period."""
    config, family = settings[0], choices[FAMILY]
    time = step * config[PERIOD]
    if family == SAMPLES:
        return samples[0][min(step, len(samples[0]) - 1)]  # type: ignore[no-any-return]
    if family == SINE:
        return config[AMPLITUDE] * sine_of_turns(config[FREQUENCY] * time)  # type: ignore[no-any-return]
    if family == STEP:
        return 0.0 if time < STEP_SECONDS else config[AMPLITUDE]
    return reference_value(rows, REFERENCE, lane, time, choices[N_SINES])


@kernel
def read_joint(rows: Any, fixed: Any, counts: Any, work: Any, j: int) -> None:
    """Write what the sensors give for lane ``j``."""
    step, key_a, key_b = counts[K.STEP][j], counts[K.KEY_A][j], counts[K.KEY_B][j]
    work[SENSOR_ANGLE][j] = read_sensor(
        rows[K.ANGLE][j],
        fixed[K.ANGLE_NOISE][j],
        fixed[K.ANGLE_RESOLUTION][j],
        fixed[K.ANGLE_BIAS][j],
        normal(key_a, key_b, NOISE_ANGLE, step),
    )
    for k in range(2):
        work[SENSOR_A + k][j] = read_sensor(
            rows[K.PRESSURE_A + k][j],
            fixed[K.PRESSURE_NOISE][j],
            fixed[K.PRESSURE_RESOLUTION][j],
            fixed[K.PRESSURE_BIAS][j],
            normal(key_a, key_b, NOISE_A + k, step),
        )


@kernel
def evaluate(
    rows: Any, fixed: Any, counts: Any, ahead: Any, settings: Any, choices: Any, work: Any
) -> None:
    """Write what can be observed and reported of a tile into ``work``."""
    for k in range(len(COPIED_ROWS)):
        source, to = rows[COPIED_ROWS[k]], work[FIRST_COPIED + k]
        for j in range(LANES):
            to[j] = source[j]
    for j in range(LANES):
        read_joint(rows, fixed, counts, work, j)
        work[SIGNALS][j] = work[SENSOR_ANGLE][j]
        work[SIGNALS + 1][j] = work[SENSOR_A][j]
        work[SIGNALS + 2][j] = work[SENSOR_B][j]
        work[SIGNALS + 3][j] = rows[K.SET_POINT_A][j]
        work[SIGNALS + 4][j] = rows[K.SET_POINT_B][j]
        work[SIGNALS + 5][j] = rows[TOLD_PAYLOAD][j]
        work[SIGNALS + COMMON_SIGNALS][j] = rows[ACTION][j]
        work[SIGNALS + COMMON_SIGNALS + 1][j] = rows[ACTION + 1][j]
    write_references(counts, ahead, choices, work, SIGNALS + choices[FIXED_SIGNALS])
    judge(rows, fixed, counts, settings, choices, work)


@kernel
def judge(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Write time, output, rewards, costs, margins and efforts of a tile into ``work``."""
    config, now = settings[0], work[SIGNALS + choices[FIXED_SIGNALS]]
    for j in range(LANES):
        angle, full = rows[K.ANGLE][j], fixed[K.MAX_PRESSURE][j]
        pressure_a, pressure_b = rows[K.PRESSURE_A][j], rows[K.PRESSURE_B][j]
        higher = max(pressure_a, pressure_b)
        work[TIME][j] = counts[K.STEP][j] * config[PERIOD]
        work[REF][j] = now[j]
        work[OUTPUT][j] = angle
        work[R_TRACKING][j] = tracking_reward(
            angle - now[j], config[ERROR_SCALE], config[TRACKING_WEIGHT]
        )
        moved = abs(rows[K.SET_POINT_A][j] - rows[OLD_SET_A][j])
        moved = moved + abs(rows[K.SET_POINT_B][j] - rows[OLD_SET_B][j])
        work[R_EFFORT][j] = effort_reward(moved, 2.0 * full, config[EFFORT_WEIGHT])
        work[C_ANGLE][j] = excess(abs(angle), config[SOFT_ANGLE])
        work[C_PRESSURE][j] = excess(higher, config[SOFT_PRESSURE])
        work[M_ANGLE][j] = config[LARGEST_ANGLE] - abs(angle)
        work[M_PRESSURE][j] = config[SOFT_PRESSURE] - higher
        work[ENDED][j] = 1.0 if work[M_ANGLE][j] < 0.0 else 0.0
        work[R_ENDED][j] = ended_reward(
            work[ENDED][j],
            work[TIME][j],
            config[EPISODE_SECONDS],
            config[PERIOD],
            config[WORST_PERIOD],
        )
        travel = abs(pressure_a - rows[OLD_A][j]) + abs(pressure_b - rows[OLD_B][j])
        work[E_TRAVEL][j] = travel
        work[E_AIR][j] = max(0.0, rows[K.AIR][j] - rows[OLD_AIR][j])
        remember_period(rows, j)


@kernel
def remember_period(rows: Any, j: int) -> None:
    """Keep what the next period's effort is counted from."""
    rows[OLD_A][j] = rows[K.PRESSURE_A][j]
    rows[OLD_B][j] = rows[K.PRESSURE_B][j]
    rows[OLD_AIR][j] = rows[K.AIR][j]


@routine
def begin_joint(
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
    """Bring lane ``j`` to rest at a drawn angle under a drawn payload, and draw its reference."""
    key_a, key_b, config = counts[K.KEY_A][j], counts[K.KEY_B][j], settings[0]
    counts[K.MEMBER][j] = member
    payloads = settings[choices[AT_OWN]]
    draw_payload(
        rows, key_a, key_b, START, payloads, choices[N_PAYLOADS], config[PAYLOAD_CHANGE],
        config[EPISODE_SECONDS], TOLD_PAYLOAD, K.PAYLOAD, j,
    )  # fmt: skip
    rows[K.DISTURBANCE][j] = 0.0
    angle = config[START_ANGLE] * (2.0 * uniform(key_a, key_b, START, 3) - 1.0)
    prestress, elements = config[PRESTRESS], choices[N_ELEMENTS]
    start_hysteresis(rows, counts, HYSTERESIS, j)
    begin_lane(rows, fixed, counts, tables, HYSTERESIS, elements, j, angle, prestress)
    by_pressure = choices[MODE] == BY_PRESSURE
    rows[ACTION][j] = rows[K.SET_POINT_A][j] if by_pressure else angle
    rows[ACTION + 1][j] = rows[K.SET_POINT_B][j] if by_pressure else prestress
    rows[OLD_SET_A][j] = rows[K.SET_POINT_A][j]
    rows[OLD_SET_B][j] = rows[K.SET_POINT_B][j]
    remember_period(rows, j)
    if choices[FAMILY] < SAMPLES:
        low, high = -config[AMPLITUDE], config[AMPLITUDE]
        draw_reference(rows, REFERENCE, j, key_a, key_b, choices[FAMILY], low, high)


@lru_cache(maxsize=16)
def kernels_for(kind: str, dynamics: str) -> Kernels:
    """Return the kernels for a kind of hysteresis and a make of the plant."""
    functions = {
        "env_apply": apply_joint,
        "env_advance": advance_joint,
        "env_reference": reference_at,
        "env_evaluate": evaluate,
        "env_begin": begin_joint,
        **replacements(kind, dynamics),
    }
    return Kernels(
        f"joint_{kind}_{dynamics}",
        kernels_for,
        (kind, dynamics),
        functions,
        info=INFO,
        rows=HYSTERESIS + 2 * state_rows(kind),
        parameters=K.N_PARAMETERS,
        counts=K.N_COUNTS,
        scratch=N_WORK,
        signals=COMMON_SIGNALS + 2 + 1 + MOST_PREVIEW,
        set_points=ACTION,
        old_set_points=OLD_ACTION,
    )
