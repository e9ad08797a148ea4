"""What sets ``PAM/RedundantManipulator-v0`` apart in a step: path, report, reward, start.

The step itself stands in :mod:`pam_envs.envs.core.step`. A path is a table of poses and of
planned joint angles, made before the first step; an episode draws one of them, and the tool runs
along it and back with the least jerk.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.payload import carry_payload, draw_payload
from pam_envs.envs.core.step import (
    AT_OWN,
    CHANNELS,
    EPISODE_SECONDS,
    FIRST_INFO,
    MOST_PREVIEW,
    N_INFO,
    PERIOD,
    SUBSTEPS,
)
from pam_envs.envs.manipulator.layout import (
    ACTION,
    BY_ANGLE,
    BY_PRESSURE,
    HYSTERESIS,
    MODE,
    N_ELEMENTS,
    N_PATHS,
    N_PAYLOADS,
    N_POSE,
    NOISE_ANGLE,
    NOISE_PRESSURE,
    OLD_ACTION,
    OLD_AIR,
    OLD_PRESSURE,
    OLD_SET_POINT,
    PATH,
    PATH_SECONDS,
    PAYLOAD_CHANGE,
    PRESTRESS,
    RATE,
    RATE_TIME,
    READ_ANGLE,
    READ_PRESSURE,
    REST_SECONDS,
    START,
    TOLD_PAYLOAD,
    info_keys,
)
from pam_envs.envs.manipulator.report import evaluate
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.random import normal, uniform
from pam_envs.mechanics.serial_chain_kinematics import N_STAGES
from pam_envs.mechanics.serial_chain_rows import parameter_rows
from pam_envs.plants.antagonistic_joint.pair import command
from pam_envs.plants.redundant_manipulator import rows as M
from pam_envs.plants.redundant_manipulator.step import (
    advance,
    begin_lane,
    hysteresis_rows,
    replacements,
    start_hysteresis,
    work_rows,
)
from pam_envs.references.path import along
from pam_envs.sensing.sensor import read_sensor


@kernel
def apply_chain(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Change the payload at its time, and turn what is asked for into pressures."""
    step, config, saturated = counts[M.STEP], settings[0], work[FIRST_INFO + N_INFO - 1]
    carry_payload(rows, step, config[PERIOD], TOLD_PAYLOAD, M.PAYLOAD)
    for k in range(2 * N_STAGES):
        old, set_point = rows[OLD_SET_POINT + k], rows[M.SET_POINT + k]
        for j in range(LANES):
            old[j] = set_point[j]
        if choices[MODE] == BY_PRESSURE:
            asked = rows[ACTION + k]
            for j in range(LANES):
                set_point[j] = asked[j]
    if choices[MODE] == BY_ANGLE:
        for k in range(N_STAGES):
            for j in range(LANES):
                short = command(
                    rows, fixed, j, rows[ACTION + k][j], config[PRESTRESS], M.COMMAND + k,
                    M.PRESTRESS + k, M.SET_POINT + 2 * k,
                )  # fmt: skip
                saturated[j] = max(saturated[j], short)


@kernel
def advance_chain(
    rows: Any,
    fixed: Any,
    counts: Any,
    tables: Any,
    samples: Any,
    settings: Any,
    choices: Any,
    work: Any,
) -> None:
    """Advance the plant by a control period and read its sensors."""
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
    step, period = counts[M.STEP], settings[0][PERIOD]
    for j in range(LANES):
        read_lane(rows, fixed, counts, step[j] + 1, period, j)


@kernel
def read_lane(rows: Any, fixed: Any, counts: Any, step: int, period: float, j: int) -> None:
    """Read the sensors of lane ``j`` at a control period, and how fast the angles change."""
    key_a, key_b = counts[M.KEY_A][j], counts[M.KEY_B][j]
    for k in range(N_STAGES):
        angle = read_sensor(
            rows[M.ANGLE + k][j],
            fixed[M.ANGLE_NOISE][j],
            fixed[M.ANGLE_RESOLUTION][j],
            fixed[M.ANGLE_BIAS][j],
            normal(key_a, key_b, NOISE_ANGLE, step * N_STAGES + k),
        )
        rate = rows[RATE + k][j]
        change = angle - rows[READ_ANGLE + k][j] - period * rate
        rows[RATE + k][j] = 0.0 if step == 0 else rate + change / (RATE_TIME + period)
        rows[READ_ANGLE + k][j] = angle
    for k in range(2 * N_STAGES):
        rows[READ_PRESSURE + k][j] = read_sensor(
            rows[M.PRESSURE + k][j],
            fixed[M.PRESSURE_NOISE][j],
            fixed[M.PRESSURE_RESOLUTION][j],
            fixed[M.PRESSURE_BIAS][j],
            normal(key_a, key_b, NOISE_PRESSURE, 2 * step * N_STAGES + k),
        )


@kernel
def path_at(
    rows: Any,
    fixed: Any,
    samples: Any,
    settings: Any,
    choices: Any,
    step: int,
    lane: int,
    channel: int,
) -> float:
    """Return one number of the wanted pose, or one of the planned angles, at a control period."""
    config = settings[0]
    points = samples[int(rows[PATH][lane]) * CHANNELS + channel]
    s = along(step * config[PERIOD], config[REST_SECONDS], config[PATH_SECONDS])
    place = s * (len(points) - 1)
    k = min(int(place), len(points) - 2)
    return points[k] + (place - k) * (points[k + 1] - points[k])  # type: ignore[no-any-return]


@routine
def begin_chain(
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
    """Bring lane ``j`` to rest at the beginning of a drawn path, under a drawn payload."""
    key_a, key_b, config = counts[M.KEY_A][j], counts[M.KEY_B][j], settings[0]
    counts[M.MEMBER][j] = member
    payloads = settings[choices[AT_OWN]]
    draw_payload(
        rows, key_a, key_b, START, payloads, choices[N_PAYLOADS], config[PAYLOAD_CHANGE],
        config[EPISODE_SECONDS], TOLD_PAYLOAD, M.PAYLOAD, j,
    )  # fmt: skip
    path = int(uniform(key_a, key_b, START, 3) * choices[N_PATHS])
    rows[PATH][j] = path
    for k in range(N_STAGES):
        rows[M.COMMAND + k][j] = samples[path * CHANNELS + N_POSE + k][0]
        rows[M.PRESTRESS + k][j] = config[PRESTRESS]
        rows[M.DISTURBANCE + k][j] = 0.0
    start_hysteresis(rows, counts, HYSTERESIS, j)
    begin_lane(rows, fixed, counts, tables, HYSTERESIS, choices[N_ELEMENTS], j, work)
    for k in range(2 * N_STAGES):
        rows[OLD_SET_POINT + k][j] = rows[ACTION + k][j] = rows[M.SET_POINT + k][j]
        rows[OLD_PRESSURE + k][j] = rows[M.PRESSURE + k][j]
    if choices[MODE] == BY_ANGLE:
        for k in range(N_STAGES):
            rows[ACTION + k][j] = rows[M.COMMAND + k][j]
    rows[OLD_AIR][j] = rows[M.AIR][j]
    read_lane(rows, fixed, counts, 0, config[PERIOD], j)


@lru_cache(maxsize=16)
def kernels_for(kind: str, stages: int) -> Kernels:
    """Return the kernels for a kind of hysteresis and a number of joints."""
    functions = {
        "env_apply": apply_chain,
        "env_advance": advance_chain,
        "env_reference": path_at,
        "env_evaluate": evaluate,
        "env_begin": begin_chain,
        **replacements(kind, stages),
    }
    channels = N_POSE + stages
    return Kernels(
        f"manipulator_{kind}_{stages}",
        kernels_for,
        (kind, stages),
        functions,
        info=info_keys(stages),
        rows=HYSTERESIS + hysteresis_rows(kind, stages),
        parameters=M.CHAIN + parameter_rows(stages),
        counts=M.N_COUNTS,
        scratch=work_rows(stages),
        signals=6 * stages + 1 + N_POSE + channels * (1 + MOST_PREVIEW),
        set_points=ACTION,
        old_set_points=OLD_ACTION,
        channels=channels,
    )
