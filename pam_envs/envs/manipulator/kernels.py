"""Kernels of ``PAM/RedundantManipulator-v0``: actions, sensors, path, start.

A path is a table of poses and of planned joint angles, made before the first step. An episode draws
one of them; the tool moves along it and back with minimum jerk.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.kernels import advance_plant, change_payload, draw_payload, sense
from pam_envs.envs.core.step import CHANNELS, CHOICE, FIRST_INFO, N_INFO, PERIOD
from pam_envs.envs.manipulator import layout as L
from pam_envs.envs.manipulator.report import evaluate
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.random import uniform
from pam_envs.mechanics.serial_chain.kinematics import N_STAGES
from pam_envs.mechanics.serial_chain.rows import parameter_rows
from pam_envs.plants.antagonistic_joint.pair import command
from pam_envs.plants.redundant_manipulator import rows as M
from pam_envs.plants.redundant_manipulator.step import (
    SENSED_ANGLE,
    SENSED_PRESSURE,
    advance,
    begin_lane,
    hysteresis_rows,
    replacements,
    start_hysteresis,
)
from pam_envs.references.path import along


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
    rows: Any, fixed: Any, samples: Any, settings: Any, choices: Any, step: int, lane: int,
    channel: int,
) -> float:  # fmt: skip
    """Return one number of the desired pose, or one planned angle, at a control period."""
    config = settings[0]
    points = samples[int(rows[L.PATH][lane]) * CHANNELS + channel]
    s = along(step * config[PERIOD], config[L.CONFIG.rest_seconds], config[L.CONFIG.path_seconds])
    place = s * (len(points) - 1)
    k = min(int(place), len(points) - 2)
    return points[k] + (place - k) * (points[k + 1] - points[k])  # type: ignore[no-any-return]


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
        apply=apply_chain,
        advance=advance_chain,
        reference=path_at,
        placeholders={
            "plant_advance": advance,
            "FIRST_HYSTERESIS": L.HYSTERESIS,
            **replacements(kind, stages, rows if extended else None),
        },
    )
