"""Kernels of ``PAM/RedundantManipulator-v0``: actions, sensors, path, report, start.

A path is a table of poses and of planned joint angles, made before the first step. An episode draws
one of them; the tool moves along it and back with minimum jerk.
"""

import math
from functools import lru_cache
from typing import Any

from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.kernels import (
    advance_plant,
    change_of,
    change_payload,
    draw_payload,
    report_end,
    report_pressure,
    sense,
)
from pam_envs.envs.core.step import CHANNELS, CHOICE, FIRST_INFO, N_INFO, PERIOD
from pam_envs.envs.manipulator import layout as L
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.random import uniform
from pam_envs.mechanics.serial_chain.kernels import (
    DIRECTION,
    N_STAGES,
    POINT,
    block,
    parameter_rows,
    place_chain,
)
from pam_envs.plants.antagonistic_joint.pair import advance, command, leaked_air
from pam_envs.plants.core.rollout import start_hysteresis
from pam_envs.plants.redundant_manipulator import rows as M
from pam_envs.plants.redundant_manipulator.step import (
    CHAIN_WORK,
    SENSED_ANGLE,
    SENSED_PRESSURE,
    begin_lane,
    hysteresis_rows,
    replacements,
)
from pam_envs.references.path import along
from pam_envs.tasks.rewards import error_reward, excess


@kernel
def apply_chain(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Change the payload at its time, and convert actions to pressures."""
    step, config, saturated = counts[M.STEP], settings[0], work[FIRST_INFO + N_INFO - 1]
    change_payload(rows, step, config[PERIOD], L.DECLARED_PAYLOAD, M.PAYLOAD)
    for k in range(2 * N_STAGES):
        old, set_point = rows[L.OLD_SET_POINT + k], rows[M.SET_POINT + k]
        for j in range(LANES):
            old[j] = set_point[j]
        if choices[L.CHOICE.mode] == L.BY_PRESSURE:
            action = rows[L.ACTION + k]
            for j in range(LANES):
                set_point[j] = action[j]
    if choices[L.CHOICE.mode] == L.BY_ANGLE:
        for k in range(N_STAGES):
            for j in range(LANES):
                short = command(
                    rows, fixed, j, rows[L.ACTION + k][j], config[L.CONFIG.prestress],
                    M.COMMAND + k, M.PRESTRESS + k, M.SET_POINT + 2 * k,
                )  # fmt: skip
                saturated[j] = max(saturated[j], short)


@kernel
def advance_chain(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any,
) -> None:  # fmt: skip
    """Advance the plant by a control period and read its sensors."""
    advance_plant(rows, fixed, counts, tables, samples, settings, choices, work)
    step, period = counts[M.STEP], settings[0][PERIOD]
    for j in range(LANES):
        read_lane(rows, fixed, counts, step[j] + 1, period, j)


@kernel
def read_lane(rows: Any, fixed: Any, counts: Any, step: int, period: float, j: int) -> None:
    """Read the sensors of lane ``j`` at a control period, and filter the rates of the angles."""
    for k in range(N_STAGES):
        true, draw = rows[SENSED_ANGLE + k][j], step * N_STAGES + k
        angle = sense(true, fixed, counts, M.ANGLE_NOISE, L.NOISE_ANGLE, draw, j)
        rate = rows[L.RATE + k][j]
        change = angle - rows[L.READ_ANGLE + k][j] - period * rate
        rows[L.RATE + k][j] = 0.0 if step == 0 else rate + change / (L.RATE_TIME + period)
        rows[L.READ_ANGLE + k][j] = angle
    for k in range(2 * N_STAGES):
        true, draw = rows[SENSED_PRESSURE + k][j], 2 * step * N_STAGES + k
        rows[L.READ_PRESSURE + k][j] = sense(
            true, fixed, counts, M.PRESSURE_NOISE, L.NOISE_PRESSURE, draw, j
        )


@kernel
def path_at(
    rows: Any, fixed: Any, counts: Any, samples: Any, settings: Any, choices: Any, step: int,
    lane: int, channel: int,
) -> float:  # fmt: skip
    """Return one number of the desired pose, or one planned angle, at a control period."""
    config = settings[0]
    points = samples[int(rows[L.PATH][lane]) * CHANNELS + channel]
    s = along(step * config[PERIOD], config[L.CONFIG.rest_seconds], config[L.CONFIG.path_seconds])
    place = s * (len(points) - 1)
    k = min(int(place), len(points) - 2)
    return points[k] + (place - k) * (points[k + 1] - points[k])  # type: ignore[no-any-return]


@kernel
def copy_pose(work: Any, to: int) -> None:
    """Copy the pose that :func:`place_chain` wrote to the scratch."""
    tip = block(CHAIN_WORK, N_STAGES, N_STAGES)
    for i in range(3):
        for j in range(LANES):
            work[to + i][j] = work[tip + POINT + i][j]
            work[to + 3 + i][j] = work[tip + DIRECTION + i][j]


@kernel
def evaluate(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Write poses, planned angles, rewards, costs, margins and efforts of a tile into ``work``."""
    info, count = work[FIRST_INFO:], choices[CHOICE.preview] + 1
    references, planned = N_INFO + 1 + choices[CHOICE.fixed], N_INFO - 1 - N_STAGES
    place_chain(rows, fixed, work, L.READ_ANGLE, M.CHAIN, CHAIN_WORK)
    copy_pose(work, FIRST_INFO + N_INFO + 2 + 4 * N_STAGES)
    place_chain(rows, fixed, work, M.ANGLE, M.CHAIN, CHAIN_WORK)
    copy_pose(work, FIRST_INFO + L.INFO.state_x)
    for i in range(L.N_POSE + N_STAGES):
        to = L.INFO.state_reference_x + i if i < L.N_POSE else planned + i - L.N_POSE
        for j in range(LANES):
            info[to][j] = info[references + i * count][j]
    for j in range(LANES):
        off, largest = 0.0, 0.0
        for k in range(N_STAGES):
            angle = rows[M.ANGLE + k][j]
            error = angle - info[planned + k][j]
            off = off + error * error
            largest = max(largest, abs(angle))
        info[L.INFO.state_joint_error][j] = math.sqrt(off / N_STAGES)
        seconds = settings[0][L.CONFIG.path_seconds]
        share = along(info[L.INFO.time][j], settings[0][L.CONFIG.rest_seconds], seconds)
        info[L.INFO.state_resting][j] = 0.0 if 0.0 < share < 1.0 else 1.0
        judge_pressures(rows, fixed, settings[0], info, j)
        judge(settings[0], info, largest, j)


@kernel
def judge_pressures(rows: Any, fixed: Any, config: Any, info: Any, j: int) -> None:
    """Write costs, margins and efforts of the pressures of lane ``j``."""
    higher, moved, travel = 0.0, 0.0, 0.0
    for k in range(2 * N_STAGES):
        higher = max(higher, rows[M.PRESSURE + k][j])
        travel = travel + abs(change_of(rows, M.PRESSURE + k, L.OLD_PRESSURE + k, j))
        moved = moved + abs(rows[M.SET_POINT + k][j] - rows[L.OLD_SET_POINT + k][j])
    full = 2 * N_STAGES * fixed[M.REGULATOR_MAX_PRESSURE][j]
    report_pressure(info, config, L.INFO, L.CONFIG, higher, moved, full, j)
    info[L.INFO.effort_pressure_travel][j] = travel
    drawn = change_of(rows, M.AIR, L.OLD_AIR, j) + leaked_air(rows, fixed, j)
    info[L.INFO.effort_air][j] = max(0.0, drawn)


@kernel
def apart(info: Any, one: int, other: int, j: int) -> float:
    """Return the distance between two vectors, given their first rows."""
    x, y = info[one][j] - info[other][j], info[one + 1][j] - info[other + 1][j]
    z = info[one + 2][j] - info[other + 2][j]
    return math.sqrt(x * x + y * y + z * z)


@kernel
def judge(config: Any, info: Any, largest: float, j: int) -> None:
    """Write errors, rewards, costs and margins of lane ``j``; ``largest`` is its largest angle."""
    pose, reference = L.INFO.state_x, L.INFO.state_reference_x
    off, aside = apart(info, pose, reference, j), apart(info, pose + 3, reference + 3, j)
    info[L.INFO.sensor_output][j] = apart(info, N_INFO + 2 + 4 * N_STAGES, reference, j)
    info[L.INFO.reference][j], info[L.INFO.output][j] = 0.0, off
    info[L.INFO.state_pointing_error][j] = aside
    info[L.INFO.reward_position][j] = error_reward(
        off, config[L.CONFIG.position_scale], config[L.CONFIG.position_weight]
    )
    info[L.INFO.reward_pointing][j] = error_reward(
        aside, config[L.CONFIG.pointing_scale], config[L.CONFIG.pointing_weight]
    )
    info[L.INFO.cost_angle][j] = excess(largest, config[L.CONFIG.soft_angle])
    info[L.INFO.margin_angle][j] = config[L.CONFIG.largest_angle] - largest
    broken = largest > config[L.CONFIG.largest_angle]
    report_end(info, config, L.INFO, L.CONFIG, N_INFO, broken, j)


@routine
def begin_chain(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any, j: int,
) -> None:  # fmt: skip
    """Bring lane ``j`` to rest at the beginning of a drawn path, under a drawn payload."""
    key_a, key_b, config = counts[M.KEY_A][j], counts[M.KEY_B][j], settings[0]
    draw_payload(
        rows, counts, settings, choices, L.START, choices[L.CHOICE.payloads],
        config[L.CONFIG.payload_change], L.DECLARED_PAYLOAD, M.PAYLOAD, j,
    )  # fmt: skip
    path = int(uniform(key_a, key_b, L.START, 3) * choices[L.CHOICE.paths])
    rows[L.PATH][j] = path
    for k in range(N_STAGES):
        rows[M.COMMAND + k][j] = samples[path * CHANNELS + L.N_POSE + k][0]
        rows[M.PRESTRESS + k][j] = config[L.CONFIG.prestress]
        rows[M.DISTURBANCE + k][j] = 0.0
    start_hysteresis(rows, counts, L.HYSTERESIS, j)
    begin_lane(rows, fixed, counts, tables, L.HYSTERESIS, choices[CHOICE.elements], j, work)
    for k in range(2 * N_STAGES):
        rows[L.OLD_SET_POINT + k][j] = rows[L.ACTION + k][j] = rows[M.SET_POINT + k][j]
        rows[L.OLD_PRESSURE + k][j] = rows[M.PRESSURE + k][j]
    if choices[L.CHOICE.mode] == L.BY_ANGLE:
        for k in range(N_STAGES):
            rows[L.ACTION + k][j] = rows[M.COMMAND + k][j]
    rows[L.OLD_AIR][j] = rows[M.AIR][j]
    read_lane(rows, fixed, counts, 0, config[PERIOD], j)


@lru_cache(maxsize=16)
def kernels_for(kind: str, stages: int, extended: bool = False) -> Kernels:
    """Return the kernels for a kind of hysteresis and a number of joints, plain or with effects."""
    rows = L.HYSTERESIS + hysteresis_rows(kind, stages)
    return Kernels(
        "manipulator",
        kernels_for,
        (kind, stages, extended),
        L.report_for(stages),
        evaluate,
        begin_chain,
        rows=rows + (M.STATE.end if extended else 0),
        parameters=M.CHAIN + parameter_rows(stages),
        counts=M.N_COUNTS,
        set_points=L.ACTION,
        old_set_points=L.OLD_ACTION,
        channels=L.N_POSE + stages,
        config=L.CONFIG,
        choices=L.CHOICE,
        indices={L.PATH: L.CHOICE.paths},
        apply=apply_chain,
        advance=advance_chain,
        reference=path_at,
        placeholders={
            "plant_advance": advance,
            "FIRST_HYSTERESIS": L.HYSTERESIS,
            **replacements(kind, stages, rows if extended else None),
        },
    )
