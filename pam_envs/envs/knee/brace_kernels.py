"""Kernels of ``PAM/KneeTension-v0`` and ``PAM/KneeStiffness-v0``: sensors, report, start."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.kernels import sense, trajectory_at
from pam_envs.envs.core.step import CHOICE, PERIOD, copy_rows, write_references
from pam_envs.envs.knee import brace_layout as L
from pam_envs.envs.knee.kernels import advance_knee
from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.random import uniform
from pam_envs.mechanics.knee_lever import muscle_length
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.step import SENSED, begin_lane, replacements
from pam_envs.references import trajectory as T
from pam_envs.references.trajectory import draw_reference
from pam_envs.tasks.rewards import effort_reward, error_reward, excess


@kernel
def read_brace(rows: Any, fixed: Any, counts: Any, work: Any, j: int) -> None:
    """Write the readings of lane ``j``."""
    step = counts[K.STEP][j]
    tension = sense(rows[SENSED[0]][j], fixed, counts, K.TENSION_NOISE, L.NOISE_T, step, j)
    angle = sense(rows[SENSED[1]][j], fixed, counts, K.ANGLE_NOISE, L.NOISE_A, step, j)
    pressure = sense(rows[SENSED[2]][j], fixed, counts, K.PRESSURE_NOISE, L.NOISE_P, step, j)
    sine, _ = sine_and_cosine(0.5 * angle)
    length = muscle_length(sine, fixed[K.LEVER_ARM][j], fixed[K.LEVER_FITTINGS][j])
    stiffness = tension / max(1e-3, length - fixed[K.SHORTEST_LENGTH][j])
    work[L.INFO.sensor_tension][j] = work[L.SIGNALS][j] = tension
    work[L.INFO.sensor_stiffness][j] = work[L.SIGNALS + 1][j] = stiffness
    work[L.INFO.sensor_angle][j] = work[L.SIGNALS + 2][j] = angle
    work[L.INFO.sensor_pressure][j] = work[L.SIGNALS + 3][j] = pressure


@kernel
def evaluate(
    rows: Any, fixed: Any, counts: Any, ahead: Any, settings: Any, choices: Any, work: Any
) -> None:
    """Write observation and report of a tile into ``work``."""
    set_point = rows[K.SET_POINT]
    copy_rows(rows, work)
    for j in range(LANES):
        read_brace(rows, fixed, counts, work, j)
        work[L.SIGNALS + 4][j] = set_point[j]
    write_references(counts, ahead, choices, work, L.SIGNALS + L.FIXED_SIGNALS)
    judge(rows, fixed, counts, settings[0], choices, work)


@kernel
def judge(rows: Any, fixed: Any, counts: Any, config: Any, choices: Any, work: Any) -> None:
    """Write time, output, rewards, costs, margins and efforts of a tile into ``work``."""
    pressure, set_point, older = rows[K.PRESSURE], rows[K.SET_POINT], rows[K.OLD_SET_POINT]
    stiffness = choices[L.CHOICE.quantity] == L.STIFFNESS
    reference = work[L.SIGNALS + L.FIXED_SIGNALS]
    for j in range(LANES):
        output = rows[K.STIFFNESS][j] if stiffness else rows[K.TENSION][j]
        work[L.INFO.time][j] = counts[K.STEP][j] * config[PERIOD]
        work[L.INFO.output][j] = output
        work[L.INFO.reference][j] = reference[j]
        work[L.INFO.reward_tracking][j] = error_reward(
            output - reference[j], config[L.CONFIG.error_scale], config[L.CONFIG.tracking_weight]
        )
        work[L.INFO.reward_effort][j] = effort_reward(
            set_point[j] - older[j], fixed[K.MAX_PRESSURE][j], config[L.CONFIG.effort_weight]
        )
        work[L.INFO.cost_pressure][j] = excess(pressure[j], config[L.CONFIG.soft_pressure])
        margin = config[L.CONFIG.highest_tension] - rows[K.TENSION][j]
        work[L.INFO.margin_tension][j] = margin
        work[L.INFO.margin_pressure][j] = config[L.CONFIG.soft_pressure] - pressure[j]
        work[L.ENDED][j] = 1.0 if margin < 0.0 else 0.0
        work[L.INFO.effort_pressure_travel][j] = abs(pressure[j] - rows[K.OLD_PRESSURE][j])
        work[L.INFO.effort_air][j] = max(0.0, rows[K.AIR][j] - rows[K.OLD_AIR][j])
        rows[K.OLD_PRESSURE][j] = pressure[j]
        rows[K.OLD_AIR][j] = rows[K.AIR][j]


@routine
def begin_brace(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any, member: int, j: int,
) -> None:  # fmt: skip
    """Bring lane ``j`` to rest under a drawn pressure, and draw its reference."""
    key_a, key_b, config = counts[K.KEY_A][j], counts[K.KEY_B][j], settings[0]
    counts[K.MEMBER][j] = member
    span = config[L.CONFIG.start_high] - config[L.CONFIG.start_low]
    pressure = config[L.CONFIG.start_low] + span * uniform(key_a, key_b, L.START, 0)
    gait, elements = settings[choices[CHOICE.at_own] :], choices[CHOICE.elements]
    begin_lane(rows, fixed, counts, tables, gait, L.HYSTERESIS, elements, j, 0.0, pressure)
    low, high = config[L.CONFIG.reference_low], config[L.CONFIG.reference_high]
    family = choices[CHOICE.reference]
    if family == L.PAPER:
        draw_paper(rows, j, low, high, config[L.CONFIG.frequency])
    elif family != T.SAMPLES:
        draw_reference(rows, L.REFERENCE, j, key_a, key_b, family, low, high)


@routine
def draw_paper(rows: Any, j: int, low: float, high: float, frequency: float) -> None:
    """Set the reference of lane ``j`` to a sine between ``low`` and ``high``, from ``low`` on."""
    rows[L.REFERENCE + T.RATE][j] = 1.0
    rows[L.REFERENCE + T.RAMP][j] = 0.0
    for k in range(T.KNOTS):
        rows[L.REFERENCE + T.KNOT + k][j] = 0.5 * (low + high)
    for k in range(3 * T.SINES):
        rows[L.REFERENCE + T.SINE + k][j] = 0.0
    rows[L.REFERENCE + T.SINE][j] = 0.5 * (high - low)
    rows[L.REFERENCE + T.SINE + 1][j] = frequency
    rows[L.REFERENCE + T.SINE + 2][j] = -0.25


@lru_cache(maxsize=16)
def kernels_for(kind: str, mounting: str, dynamics: str, extended: bool = False) -> Kernels:
    """Return the kernels for a hysteresis model, mounting and dynamics, plain or with effects."""
    rows = L.HYSTERESIS + state_rows(kind)
    return Kernels(
        f"brace_{kind}_{mounting}_{dynamics}" + ("_extended" if extended else ""),
        kernels_for,
        (kind, mounting, dynamics, extended),
        L.REPORT,
        advance=advance_knee,
        reference=trajectory_at,
        evaluate=evaluate,
        begin=begin_brace,
        config=L.CONFIG,
        choices=L.CHOICE,
        placeholders={
            "FIRST_HYSTERESIS": L.HYSTERESIS,
            "FIRST_REFERENCE": L.REFERENCE,
            **replacements(kind, mounting, dynamics, rows if extended else None),
        },
        rows=rows + (K.STATE.end if extended else 0),
        parameters=K.N_PARAMETERS,
        counts=K.N_COUNTS,
        signals=L.FIXED_SIGNALS,
        set_points=K.SET_POINT,
        old_set_points=K.OLD_SET_POINT,
    )
