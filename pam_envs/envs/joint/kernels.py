"""Kernels of ``PAM/AntagonisticJoint-v0``: actions, disturbance, report, start."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.kernels import (
    change_of,
    change_payload,
    draw_payload,
    report_end,
    report_pressure,
    report_tracking,
    sense,
    trajectory_at,
)
from pam_envs.envs.core.step import CHOICE, PERIOD
from pam_envs.envs.joint import layout as L
from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.arithmetic import sine_of_turns
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.random import uniform
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint.pair import command
from pam_envs.plants.antagonistic_joint.step import (
    SENSED_ANGLE,
    SENSED_PRESSURE,
    advance,
    begin_lane,
    replacements,
    start_hysteresis,
)
from pam_envs.references.trajectory import SAMPLES, draw_reference
from pam_envs.tasks.rewards import excess


@kernel
def pulse(key_a: int, key_b: int, step: int, size: float) -> float:
    """Return the disturbance [N m] in a control period: one pulse of 1 s in every 5 s.

    Its start, its sign and its size, between half of ``size`` and ``size``, are drawn.
    """
    window = step // L.PULSE_WINDOW
    first = int(
        0.2 * L.PULSE_WINDOW + 0.5 * L.PULSE_WINDOW * uniform(key_a, key_b, L.PULSES, 2 * window)
    )
    since = step - window * L.PULSE_WINDOW - first
    if since < 0 or since >= L.PULSE:
        return 0.0
    drawn = 2.0 * uniform(key_a, key_b, L.PULSES, 2 * window + 1) - 1.0
    return size * (0.5 * drawn + (0.5 if drawn > 0.0 else -0.5))


@kernel
def apply_joint(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Change payload and disturbance at their times, and convert actions to pressures."""
    step, config, mode = counts[K.STEP], settings[0], choices[L.CHOICE.mode]
    change_payload(rows, step, config[PERIOD], L.DECLARED_PAYLOAD, K.PAYLOAD)
    for j in range(LANES):
        rows[L.OLD_SET_A][j] = rows[K.SET_POINT_A][j]
        rows[L.OLD_SET_B][j] = rows[K.SET_POINT_B][j]
    if config[L.CONFIG.disturbance] > 0.0:
        for j in range(LANES):
            rows[K.DISTURBANCE][j] = pulse(
                counts[K.KEY_A][j], counts[K.KEY_B][j], step[j], config[L.CONFIG.disturbance]
            )
    for j in range(LANES):
        if mode == L.BY_PRESSURE:
            rows[K.SET_POINT_A][j] = rows[L.ACTION][j]
            rows[K.SET_POINT_B][j] = rows[L.ACTION + 1][j]
        else:
            prestress = rows[L.ACTION + 1][j] if mode == L.BY_BOTH else config[L.CONFIG.prestress]
            short = command(
                rows, fixed, j, rows[L.ACTION][j], prestress, K.COMMAND, K.PRESTRESS, K.SET_POINT_A
            )
            work[L.INFO.saturated][j] = max(work[L.INFO.saturated][j], short)


@kernel
def reference_at(
    rows: Any, fixed: Any, samples: Any, settings: Any, choices: Any, step: int, lane: int,
    channel: int,
) -> float:  # fmt: skip
    """Return the reference [rad] of one lane at a control period."""
    config, family = settings[0], choices[CHOICE.reference]
    time = step * config[PERIOD]
    if family == L.SINE:
        turns = config[L.CONFIG.frequency] * time
        return config[L.CONFIG.amplitude] * sine_of_turns(turns)  # type: ignore[no-any-return]
    if family == L.STEP:
        return 0.0 if time < L.STEP_SECONDS else config[L.CONFIG.amplitude]
    return trajectory_at(rows, fixed, samples, settings, choices, step, lane, channel)


@kernel
def read_joint(rows: Any, fixed: Any, counts: Any, work: Any, j: int) -> None:
    """Write the readings of lane ``j``."""
    step = counts[K.STEP][j]
    angle = sense(rows[SENSED_ANGLE][j], fixed, counts, K.ANGLE_NOISE, L.NOISE_ANGLE, step, j)
    work[L.INFO.sensor_angle][j] = work[L.SIGNALS][j] = angle
    for k in range(2):
        pressure = sense(
            rows[SENSED_PRESSURE + k][j], fixed, counts, K.PRESSURE_NOISE, L.NOISE_A + k, step, j
        )
        work[L.INFO.sensor_pressure_a + k][j] = work[L.SIGNALS + 1 + k][j] = pressure


@kernel
def evaluate(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Write readings, rewards, costs, margins and efforts of a tile into ``work``."""
    config, reference = settings[0], work[L.SIGNALS + choices[CHOICE.fixed]]
    for j in range(LANES):
        read_joint(rows, fixed, counts, work, j)
        angle = rows[K.ANGLE][j]
        report_tracking(work, config, L.INFO, L.CONFIG, reference[j], angle, j)
        higher = max(rows[K.PRESSURE_A][j], rows[K.PRESSURE_B][j])
        moved = abs(rows[K.SET_POINT_A][j] - rows[L.OLD_SET_A][j])
        moved = moved + abs(rows[K.SET_POINT_B][j] - rows[L.OLD_SET_B][j])
        full = 2.0 * fixed[K.MAX_PRESSURE][j]
        report_pressure(work, config, L.INFO, L.CONFIG, higher, moved, full, j)
        work[L.INFO.cost_angle][j] = excess(abs(angle), config[L.CONFIG.soft_angle])
        margin = config[L.CONFIG.largest_angle] - abs(angle)
        work[L.INFO.margin_angle][j] = margin
        report_end(work, config, L.INFO, L.CONFIG, L.ENDED, margin < 0.0, j)
        travel = abs(change_of(rows, K.PRESSURE_A, L.OLD_A, j))
        travel = travel + abs(change_of(rows, K.PRESSURE_B, L.OLD_B, j))
        work[L.INFO.effort_pressure_travel][j] = travel
        work[L.INFO.effort_air][j] = max(0.0, change_of(rows, K.AIR, L.OLD_AIR, j))


@routine
def begin_joint(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any, member: int, j: int,
) -> None:  # fmt: skip
    """Bring lane ``j`` to rest at a drawn angle under a drawn payload, and draw its reference."""
    key_a, key_b, config = counts[K.KEY_A][j], counts[K.KEY_B][j], settings[0]
    counts[K.MEMBER][j] = member
    draw_payload(
        rows, counts, settings, choices, L.START, choices[L.CHOICE.payloads],
        config[L.CONFIG.payload_change], L.DECLARED_PAYLOAD, K.PAYLOAD, j,
    )  # fmt: skip
    rows[K.DISTURBANCE][j] = 0.0
    angle = config[L.CONFIG.start_angle] * (2.0 * uniform(key_a, key_b, L.START, 3) - 1.0)
    prestress, elements = config[L.CONFIG.prestress], choices[CHOICE.elements]
    start_hysteresis(rows, counts, L.HYSTERESIS, j)
    begin_lane(rows, fixed, counts, tables, L.HYSTERESIS, elements, j, angle, prestress)
    by_pressure = choices[L.CHOICE.mode] == L.BY_PRESSURE
    rows[L.ACTION][j] = rows[K.SET_POINT_A][j] if by_pressure else angle
    rows[L.ACTION + 1][j] = rows[K.SET_POINT_B][j] if by_pressure else prestress
    rows[L.OLD_SET_A][j] = rows[K.SET_POINT_A][j]
    rows[L.OLD_SET_B][j] = rows[K.SET_POINT_B][j]
    rows[L.OLD_A][j], rows[L.OLD_B][j] = rows[K.PRESSURE_A][j], rows[K.PRESSURE_B][j]
    rows[L.OLD_AIR][j] = rows[K.AIR][j]
    if choices[CHOICE.reference] < SAMPLES:
        low, high = -config[L.CONFIG.amplitude], config[L.CONFIG.amplitude]
        draw_reference(rows, L.REFERENCE, j, key_a, key_b, choices[CHOICE.reference], low, high)


@lru_cache(maxsize=16)
def kernels_for(kind: str, dynamics: str, extended: bool = False) -> Kernels:
    """Return the kernels for a hysteresis model and a dynamics, plain or with effects."""
    rows = L.HYSTERESIS + 2 * state_rows(kind)
    return Kernels(
        "joint",
        kernels_for,
        (kind, dynamics, extended),
        L.REPORT,
        evaluate,
        begin_joint,
        rows=rows + (K.STATE.end if extended else 0),
        parameters=K.N_PARAMETERS,
        counts=K.N_COUNTS,
        set_points=L.ACTION,
        old_set_points=L.OLD_ACTION,
        config=L.CONFIG,
        choices=L.CHOICE,
        apply=apply_joint,
        reference=reference_at,
        placeholders={
            "plant_advance": advance,
            "FIRST_HYSTERESIS": L.HYSTERESIS,
            "FIRST_REFERENCE": L.REFERENCE,
            **replacements(kind, dynamics, rows if extended else None),
        },
    )
