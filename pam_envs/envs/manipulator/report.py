"""What a step of ``PAM/RedundantManipulator-v0`` reports: observation, poses, rewards, limits."""

from __future__ import annotations

import math
from typing import Any

from pam_envs.envs.core.step import (
    EPISODE_SECONDS,
    FIRST_INFO,
    N_INFO,
    PERIOD,
    PREVIEW,
    write_references,
)
from pam_envs.envs.manipulator.layout import (
    ACTION,
    BY_ANGLE,
    C_ANGLE,
    C_PRESSURE,
    E_AIR,
    E_TRAVEL,
    EFFORT_WEIGHT,
    FIRST_COPIED,
    JOINT_ROWS,
    LARGEST_ANGLE,
    M_ANGLE,
    M_PRESSURE,
    MODE,
    MUSCLE_ROWS,
    N_POSE,
    OLD_AIR,
    OLD_PRESSURE,
    OLD_SET_POINT,
    OUTPUT,
    PATH,
    PATH_SECONDS,
    POINTING_SCALE,
    POINTING_WEIGHT,
    POSITION_SCALE,
    POSITION_WEIGHT,
    R_EFFORT,
    R_ENDED,
    R_POINTING,
    R_POSITION,
    RATE,
    READ_ANGLE,
    READ_PRESSURE,
    REF,
    REST_SECONDS,
    S_JOINTS,
    S_PATH,
    S_PAYLOAD,
    S_POINTING,
    S_POSE,
    S_REFERENCE,
    S_RESTING,
    S_SLACK,
    SEEN_OUTPUT,
    SOFT_ANGLE,
    SOFT_PRESSURE,
    TIME,
    TOLD_PAYLOAD,
    WORST_PERIOD,
)
from pam_envs.kernels.build import LANES, kernel
from pam_envs.mechanics.serial_chain_kinematics import N_STAGES, place_chain
from pam_envs.mechanics.serial_chain_rows import DIRECTION, POINT, block
from pam_envs.plants.redundant_manipulator import rows as M
from pam_envs.plants.redundant_manipulator.step import CHAIN_WORK
from pam_envs.references.path import along
from pam_envs.tasks.joint_tracking import distance
from pam_envs.tasks.tracking import effort_reward, ended_reward, excess, tracking_reward


@kernel
def copy_row(source: Any, to: Any) -> None:
    """Copy a row."""
    for j in range(LANES):
        to[j] = source[j]


@kernel
def copy_pose(work: Any, to: int) -> None:
    """Copy the pose that :func:`place_chain` has left in the scratch."""
    tip = block(CHAIN_WORK, N_STAGES, N_STAGES)
    for i in range(3):
        copy_row(work[tip + POINT + i], work[to + i])
        copy_row(work[tip + DIRECTION + i], work[to + 3 + i])


@kernel
def observe(rows: Any, fixed: Any, choices: Any, work: Any) -> int:
    """Write the readings of a tile, their pose, and what was asked for; return the next row."""
    first = FIRST_INFO + N_INFO + 1
    for k in range(N_STAGES):
        copy_row(rows[READ_ANGLE + k], work[first + k])
        copy_row(rows[RATE + k], work[first + N_STAGES + k])
    first = first + 2 * N_STAGES
    for k in range(2 * N_STAGES):
        copy_row(rows[READ_PRESSURE + k], work[first + k])
    first = first + 2 * N_STAGES
    copy_row(rows[TOLD_PAYLOAD], work[first])
    place_chain(rows, fixed, work, READ_ANGLE, M.CHAIN, CHAIN_WORK)
    copy_pose(work, first + 1)
    first = first + 1 + N_POSE
    asked = N_STAGES if choices[MODE] == BY_ANGLE else 2 * N_STAGES
    for k in range(asked):
        copy_row(rows[ACTION + k], work[first + k])
    return first + asked  # type: ignore[no-any-return]


@kernel
def report(rows: Any, fixed: Any, choices: Any, work: Any, references: int) -> None:
    """Write poses, and all that is reported as it stands in the state."""
    place_chain(rows, fixed, work, M.ANGLE, M.CHAIN, CHAIN_WORK)
    copy_pose(work, FIRST_INFO + S_POSE)
    count = choices[PREVIEW] + 1
    for i in range(N_POSE):
        copy_row(work[references + i * count], work[FIRST_INFO + S_REFERENCE + i])
    to = FIRST_INFO + FIRST_COPIED
    for i in range(len(JOINT_ROWS)):
        for k in range(N_STAGES):
            copy_row(rows[JOINT_ROWS[i] + k], work[to + i * N_STAGES + k])
    to = to + len(JOINT_ROWS) * N_STAGES
    for i in range(len(MUSCLE_ROWS)):
        for k in range(2 * N_STAGES):
            copy_row(rows[MUSCLE_ROWS[i] + k], work[to + 2 * i * N_STAGES + k])
    to = to + 2 * len(MUSCLE_ROWS) * N_STAGES
    for k in range(N_STAGES):
        copy_row(work[references + (N_POSE + k) * count], work[to + k])


@kernel
def evaluate(
    rows: Any, fixed: Any, counts: Any, ahead: Any, settings: Any, choices: Any, work: Any
) -> None:
    """Write what can be observed and reported of a tile into ``work``."""
    references = observe(rows, fixed, choices, work)
    write_references(counts, ahead, choices, work, references)
    report(rows, fixed, choices, work, references)
    planned = FIRST_INFO + N_INFO - 1 - N_STAGES
    for j in range(LANES):
        off, largest, higher, slack = 0.0, 0.0, 0.0, rows[M.SLACK][j]
        for k in range(N_STAGES):
            angle = rows[M.ANGLE + k][j]
            error = angle - work[planned + k][j]
            off = off + error * error
            largest = max(largest, abs(angle))
        asked, travel = 0.0, 0.0
        for k in range(2 * N_STAGES):
            pressure = rows[M.PRESSURE + k][j]
            higher = max(higher, pressure)
            travel = travel + abs(pressure - rows[OLD_PRESSURE + k][j])
            asked = asked + abs(rows[M.SET_POINT + k][j] - rows[OLD_SET_POINT + k][j])
            rows[OLD_PRESSURE + k][j] = pressure
        work[FIRST_INFO + TIME][j] = counts[M.STEP][j] * settings[0][PERIOD]
        work[FIRST_INFO + S_JOINTS][j] = math.sqrt(off / N_STAGES)
        work[FIRST_INFO + S_PAYLOAD][j] = rows[M.PAYLOAD][j]
        work[FIRST_INFO + S_SLACK][j] = slack
        work[FIRST_INFO + S_PATH][j] = rows[PATH][j]
        share = along(
            work[FIRST_INFO + TIME][j], settings[0][REST_SECONDS], settings[0][PATH_SECONDS]
        )
        work[FIRST_INFO + S_RESTING][j] = 0.0 if 0.0 < share < 1.0 else 1.0
        work[FIRST_INFO + E_TRAVEL][j] = travel
        judge(rows, fixed, settings[0], work, largest, higher, asked, j)


@kernel
def apart(work: Any, one: int, other: int, j: int) -> float:
    """Return how far apart two vectors are that begin in two rows."""
    return distance(  # type: ignore[no-any-return]
        work[one][j] - work[other][j],
        work[one + 1][j] - work[other + 1][j],
        work[one + 2][j] - work[other + 2][j],
    )


@kernel
def judge(
    rows: Any, fixed: Any, config: Any, work: Any, largest: float, higher: float, asked: float,
    j: int,
) -> None:  # fmt: skip
    """Write output, rewards, costs and margins of lane ``j``.

    ``largest`` is the size of the largest angle [rad], ``higher`` the highest pressure [Pa],
    ``asked`` the change of all set-points [Pa].
    """
    pose, wanted = FIRST_INFO + S_POSE, FIRST_INFO + S_REFERENCE
    off = apart(work, pose, wanted, j)
    aside = apart(work, pose + 3, wanted + 3, j)
    seen = FIRST_INFO + N_INFO + 2 + 4 * N_STAGES
    work[FIRST_INFO + SEEN_OUTPUT][j] = apart(work, seen, wanted, j)
    work[FIRST_INFO + REF][j] = 0.0
    work[FIRST_INFO + OUTPUT][j] = off
    work[FIRST_INFO + S_POINTING][j] = aside
    work[FIRST_INFO + R_POSITION][j] = tracking_reward(
        off, config[POSITION_SCALE], config[POSITION_WEIGHT]
    )
    work[FIRST_INFO + R_POINTING][j] = tracking_reward(
        aside, config[POINTING_SCALE], config[POINTING_WEIGHT]
    )
    full = 2 * N_STAGES * fixed[M.MAX_PRESSURE][j]
    work[FIRST_INFO + R_EFFORT][j] = effort_reward(asked, full, config[EFFORT_WEIGHT])
    work[FIRST_INFO + C_ANGLE][j] = excess(largest, config[SOFT_ANGLE])
    work[FIRST_INFO + C_PRESSURE][j] = excess(higher, config[SOFT_PRESSURE])
    work[FIRST_INFO + M_ANGLE][j] = config[LARGEST_ANGLE] - largest
    work[FIRST_INFO + M_PRESSURE][j] = config[SOFT_PRESSURE] - higher
    ended = 1.0 if largest > config[LARGEST_ANGLE] else 0.0
    work[FIRST_INFO + N_INFO][j] = ended
    work[FIRST_INFO + R_ENDED][j] = ended_reward(
        ended, work[FIRST_INFO + TIME][j], config[EPISODE_SECONDS], config[PERIOD],
        config[WORST_PERIOD],
    )  # fmt: skip
    work[FIRST_INFO + E_AIR][j] = max(0.0, rows[M.AIR][j] - rows[OLD_AIR][j])
    rows[OLD_AIR][j] = rows[M.AIR][j]
