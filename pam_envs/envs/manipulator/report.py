"""Observation and report of ``PAM/RedundantManipulator-v0``: poses, rewards, limits."""

from __future__ import annotations

import math
from typing import Any

from pam_envs.envs.core.step import (
    CHOICE,
    EPISODE_SECONDS,
    FIRST_INFO,
    N_INFO,
    PERIOD,
    copy_rows,
    write_references,
)
from pam_envs.envs.manipulator import layout as L
from pam_envs.kernels.build import LANES, kernel
from pam_envs.mechanics.serial_chain.kinematics import N_STAGES, place_chain
from pam_envs.mechanics.serial_chain.rows import DIRECTION, POINT, block
from pam_envs.plants.redundant_manipulator import rows as M
from pam_envs.plants.redundant_manipulator.step import CHAIN_WORK
from pam_envs.references.path import along
from pam_envs.tasks.joint_tracking import distance
from pam_envs.tasks.rewards import effort_reward, ended_reward, error_reward, excess


@kernel
def copy_row(source: Any, to: Any) -> None:
    """Copy a row."""
    for j in range(LANES):
        to[j] = source[j]


@kernel
def copy_pose(work: Any, to: int) -> None:
    """Copy the pose that :func:`place_chain` wrote to the scratch."""
    tip = block(CHAIN_WORK, N_STAGES, N_STAGES)
    for i in range(3):
        copy_row(work[tip + POINT + i], work[to + i])
        copy_row(work[tip + DIRECTION + i], work[to + 3 + i])


@kernel
def observe(rows: Any, fixed: Any, choices: Any, work: Any) -> int:
    """Write readings, their pose and the actions of a tile; return the next row."""
    first = FIRST_INFO + N_INFO + 1
    for k in range(N_STAGES):
        copy_row(rows[L.READ_ANGLE + k], work[first + k])
        copy_row(rows[L.RATE + k], work[first + N_STAGES + k])
    first = first + 2 * N_STAGES
    for k in range(2 * N_STAGES):
        copy_row(rows[L.READ_PRESSURE + k], work[first + k])
    first = first + 2 * N_STAGES
    copy_row(rows[L.DECLARED_PAYLOAD], work[first])
    place_chain(rows, fixed, work, L.READ_ANGLE, M.CHAIN, CHAIN_WORK)
    copy_pose(work, first + 1)
    first = first + 1 + L.N_POSE
    actions = N_STAGES if choices[L.CHOICE.mode] == L.BY_ANGLE else 2 * N_STAGES
    for k in range(actions):
        copy_row(rows[L.ACTION + k], work[first + k])
    return first + actions  # type: ignore[no-any-return]


@kernel
def report(rows: Any, fixed: Any, choices: Any, work: Any, references: int) -> None:
    """Write poses, planned angles, and copies of the state."""
    place_chain(rows, fixed, work, M.ANGLE, M.CHAIN, CHAIN_WORK)
    copy_pose(work, FIRST_INFO + L.INFO.state_x)
    count = choices[CHOICE.preview] + 1
    for i in range(L.N_POSE):
        copy_row(work[references + i * count], work[FIRST_INFO + L.INFO.state_reference_x + i])
    copy_rows(rows, work)
    planned = FIRST_INFO + N_INFO - 1 - N_STAGES
    for k in range(N_STAGES):
        copy_row(work[references + (L.N_POSE + k) * count], work[planned + k])


@kernel
def evaluate(
    rows: Any, fixed: Any, counts: Any, ahead: Any, settings: Any, choices: Any, work: Any
) -> None:
    """Write observation and report of a tile into ``work``."""
    references = observe(rows, fixed, choices, work)
    write_references(counts, ahead, choices, work, references)
    report(rows, fixed, choices, work, references)
    planned = FIRST_INFO + N_INFO - 1 - N_STAGES
    for j in range(LANES):
        off, largest, higher = 0.0, 0.0, 0.0
        for k in range(N_STAGES):
            angle = rows[M.ANGLE + k][j]
            error = angle - work[planned + k][j]
            off = off + error * error
            largest = max(largest, abs(angle))
        moved, travel = 0.0, 0.0
        for k in range(2 * N_STAGES):
            pressure = rows[M.PRESSURE + k][j]
            higher = max(higher, pressure)
            travel = travel + abs(pressure - rows[L.OLD_PRESSURE + k][j])
            moved = moved + abs(rows[M.SET_POINT + k][j] - rows[L.OLD_SET_POINT + k][j])
            rows[L.OLD_PRESSURE + k][j] = pressure
        work[FIRST_INFO + L.INFO.time][j] = counts[M.STEP][j] * settings[0][PERIOD]
        work[FIRST_INFO + L.INFO.state_joint_error][j] = math.sqrt(off / N_STAGES)
        share = along(
            work[FIRST_INFO + L.INFO.time][j],
            settings[0][L.CONFIG.rest_seconds],
            settings[0][L.CONFIG.path_seconds],
        )
        work[FIRST_INFO + L.INFO.state_resting][j] = 0.0 if 0.0 < share < 1.0 else 1.0
        work[FIRST_INFO + L.INFO.effort_pressure_travel][j] = travel
        judge(rows, fixed, settings[0], work, largest, higher, moved, j)


@kernel
def apart(work: Any, one: int, other: int, j: int) -> float:
    """Return the distance between two vectors, given their first rows."""
    return distance(  # type: ignore[no-any-return]
        work[one][j] - work[other][j],
        work[one + 1][j] - work[other + 1][j],
        work[one + 2][j] - work[other + 2][j],
    )


@kernel
def judge(
    rows: Any, fixed: Any, config: Any, work: Any, largest: float, higher: float, moved: float,
    j: int,
) -> None:  # fmt: skip
    """Write output, rewards, costs and margins of lane ``j``.

    ``largest`` is the size of the largest angle [rad], ``higher`` the highest pressure [Pa],
    ``moved`` the change of all set-points [Pa].
    """
    pose, reference = FIRST_INFO + L.INFO.state_x, FIRST_INFO + L.INFO.state_reference_x
    off = apart(work, pose, reference, j)
    aside = apart(work, pose + 3, reference + 3, j)
    seen = FIRST_INFO + N_INFO + 2 + 4 * N_STAGES
    work[FIRST_INFO + L.INFO.sensor_output][j] = apart(work, seen, reference, j)
    work[FIRST_INFO + L.INFO.reference][j] = 0.0
    work[FIRST_INFO + L.INFO.output][j] = off
    work[FIRST_INFO + L.INFO.state_pointing_error][j] = aside
    work[FIRST_INFO + L.INFO.reward_position][j] = error_reward(
        off, config[L.CONFIG.position_scale], config[L.CONFIG.position_weight]
    )
    work[FIRST_INFO + L.INFO.reward_pointing][j] = error_reward(
        aside, config[L.CONFIG.pointing_scale], config[L.CONFIG.pointing_weight]
    )
    full = 2 * N_STAGES * fixed[M.MAX_PRESSURE][j]
    work[FIRST_INFO + L.INFO.reward_effort][j] = effort_reward(
        moved, full, config[L.CONFIG.effort_weight]
    )
    work[FIRST_INFO + L.INFO.cost_angle][j] = excess(largest, config[L.CONFIG.soft_angle])
    work[FIRST_INFO + L.INFO.cost_pressure][j] = excess(higher, config[L.CONFIG.soft_pressure])
    work[FIRST_INFO + L.INFO.margin_angle][j] = config[L.CONFIG.largest_angle] - largest
    work[FIRST_INFO + L.INFO.margin_pressure][j] = config[L.CONFIG.soft_pressure] - higher
    ended = 1.0 if largest > config[L.CONFIG.largest_angle] else 0.0
    work[FIRST_INFO + N_INFO][j] = ended
    work[FIRST_INFO + L.INFO.reward_ended][j] = ended_reward(
        ended, work[FIRST_INFO + L.INFO.time][j], config[EPISODE_SECONDS], config[PERIOD],
        config[L.CONFIG.worst_period],
    )  # fmt: skip
    work[FIRST_INFO + L.INFO.effort_air][j] = max(0.0, rows[M.AIR][j] - rows[L.OLD_AIR][j])
    rows[L.OLD_AIR][j] = rows[M.AIR][j]
