"""Observation and report of ``PAM/RedundantManipulator-v0``: poses, rewards, limits."""

from __future__ import annotations

import math
from typing import Any

from pam_envs.envs.core.kernels import change_of, report_end, report_pressure
from pam_envs.envs.core.step import CHOICE, FIRST_INFO, N_INFO
from pam_envs.envs.manipulator import layout as L
from pam_envs.kernels.build import LANES, kernel
from pam_envs.mechanics.serial_chain.kinematics import N_STAGES, place_chain
from pam_envs.mechanics.serial_chain.rows import DIRECTION, POINT, block
from pam_envs.plants.redundant_manipulator import rows as M
from pam_envs.plants.redundant_manipulator.step import CHAIN_WORK
from pam_envs.references.path import along
from pam_envs.tasks.joint_tracking import distance
from pam_envs.tasks.rewards import error_reward, excess


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
    """Write the cost of the pressures of lane ``j``, the effort and the reward for it."""
    higher, moved, travel = 0.0, 0.0, 0.0
    for k in range(2 * N_STAGES):
        higher = max(higher, rows[M.PRESSURE + k][j])
        travel = travel + abs(change_of(rows, M.PRESSURE + k, L.OLD_PRESSURE + k, j))
        moved = moved + abs(rows[M.SET_POINT + k][j] - rows[L.OLD_SET_POINT + k][j])
    full = 2 * N_STAGES * fixed[M.REGULATOR_MAX_PRESSURE][j]
    report_pressure(info, config, L.INFO, L.CONFIG, higher, moved, full, j)
    info[L.INFO.effort_pressure_travel][j] = travel
    info[L.INFO.effort_air][j] = max(0.0, change_of(rows, M.AIR, L.OLD_AIR, j))


@kernel
def apart(info: Any, one: int, other: int, j: int) -> float:
    """Return the distance between two vectors, given their first rows."""
    return distance(  # type: ignore[no-any-return]
        info[one][j] - info[other][j],
        info[one + 1][j] - info[other + 1][j],
        info[one + 2][j] - info[other + 2][j],
    )


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
