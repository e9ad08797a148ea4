"""Kernels of ``PAM/MusclePositioning-v0``: load change, report, reward, start."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from pam_envs.constants import ATMOSPHERE, DENSITY_PER_PRESSURE
from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.kernels import advance_plant, sense, trajectory_at
from pam_envs.envs.core.step import CHOICE, EPISODE_SECONDS, PERIOD, copy_rows, write_references
from pam_envs.envs.positioning import layout as L
from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.history import N_HISTORY
from pam_envs.kernels.random import uniform
from pam_envs.muscle.effective_area import volume
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.effects import replacements
from pam_envs.plants.single_muscle.hysteresis_kernels import hysteresis_kernels
from pam_envs.plants.single_muscle.step import (
    advance,
    begin_effects,
    rest_contraction,
    seen_position,
    seen_pressure,
    true_position,
)
from pam_envs.references.trajectory import SAMPLES, draw_reference
from pam_envs.tasks.rewards import effort_reward, error_reward, excess

remember: Any = None  # a placeholder, replaced for each hysteresis


@kernel
def air_in_muscle(rows: Any, fixed: Any, j: int) -> float:
    """Return the mass of air [kg] in the muscle of lane ``j``."""
    length = fixed[R.REST_LENGTH][j]
    space = volume(rows[R.CONTRACTION][j] / length, length, fixed[R.TALL][j], fixed[R.COSINE][j])
    return DENSITY_PER_PRESSURE * (rows[R.PRESSURE][j] + ATMOSPHERE) * space


@kernel
def change_load(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Change the load at its time."""
    step, load, period = counts[R.STEP], rows[R.LOAD], settings[0][PERIOD]
    declared, when, change = rows[R.TOLD_LOAD], rows[R.CHANGE_TIME], rows[R.CHANGE]
    for j in range(LANES):
        load[j] = declared[j] + (change[j] if step[j] * period >= when[j] else 0.0)


@kernel
def evaluate(
    rows: Any, fixed: Any, counts: Any, ahead: Any, settings: Any, choices: Any, work: Any
) -> None:
    """Write observation and report of a tile into ``work``."""
    step, set_point = counts[R.STEP], rows[R.SET_POINT]
    copy_rows(rows, work)
    for j in range(LANES):
        work[L.INFO.state_contraction][j] = true_position(rows, j)
        position = sense(
            seen_position(rows, j), fixed, counts, R.POSITION_NOISE, L.NOISE_X, step[j], j
        )
        pressure = sense(
            seen_pressure(rows, j), fixed, counts, R.PRESSURE_NOISE, L.NOISE_P, step[j], j
        )
        work[L.INFO.sensor_contraction][j] = work[L.SIGNALS][j] = position
        work[L.INFO.sensor_pressure][j] = work[L.SIGNALS + 1][j] = pressure
        work[L.SIGNALS + 2][j] = set_point[j]
        work[L.SIGNALS + 3][j] = rows[R.TOLD_LOAD][j]
    write_references(counts, ahead, choices, work, L.SIGNALS + L.FIXED_SIGNALS)
    judge(rows, fixed, counts, settings[0], work)


@kernel
def judge(rows: Any, fixed: Any, counts: Any, config: Any, work: Any) -> None:
    """Write time, output, rewards, costs, margins and efforts of a tile into ``work``."""
    pressure, set_point, older = rows[R.PRESSURE], rows[R.SET_POINT], rows[R.OLD_SET_POINT]
    reference = work[L.SIGNALS + L.FIXED_SIGNALS]
    for j in range(LANES):
        output = work[L.INFO.state_contraction][j]
        work[L.INFO.time][j] = counts[R.STEP][j] * config[PERIOD]
        work[L.INFO.output][j] = output
        work[L.INFO.reference][j] = reference[j]
        work[L.INFO.reward_tracking][j] = error_reward(
            output - reference[j], config[L.CONFIG.error_scale], config[L.CONFIG.tracking_weight]
        )
        work[L.INFO.reward_effort][j] = effort_reward(
            set_point[j] - older[j], fixed[R.MAX_PRESSURE][j], config[L.CONFIG.effort_weight]
        )
        work[L.INFO.cost_contraction][j] = excess(output, config[L.CONFIG.soft_contraction])
        work[L.INFO.cost_pressure][j] = excess(pressure[j], config[L.CONFIG.soft_pressure])
        margin = min(
            config[L.CONFIG.highest_contraction] - output,
            output - config[L.CONFIG.lowest_contraction],
        )
        work[L.INFO.margin_contraction][j] = margin
        work[L.ENDED][j] = 1.0 if margin < 0.0 else 0.0
        work[L.INFO.margin_pressure][j] = config[L.CONFIG.soft_pressure] - pressure[j]
        air = air_in_muscle(rows, fixed, j)
        work[L.INFO.effort_pressure_travel][j] = abs(pressure[j] - rows[R.OLD_PRESSURE][j])
        work[L.INFO.effort_air][j] = max(0.0, air - rows[R.OLD_AIR][j])
        rows[R.OLD_PRESSURE][j] = pressure[j]
        rows[R.OLD_AIR][j] = air


@routine
def begin_muscle(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any, member: int, j: int,
) -> None:  # fmt: skip
    """Bring lane ``j`` to rest under a drawn load and pressure history, and draw its reference."""
    key_a, key_b, config = counts[R.KEY_A][j], counts[R.KEY_B][j], settings[0]
    counts[R.MEMBER][j] = member
    number = choices[L.CHOICE.loads]
    load = settings[choices[CHOICE.at_own]][int(uniform(key_a, key_b, L.START, 0) * number)]
    change = config[L.CONFIG.load_change]
    rows[R.TOLD_LOAD][j] = load
    rows[R.LOAD][j] = load
    when = 0.3 + 0.4 * uniform(key_a, key_b, L.START, 1)
    rows[R.CHANGE_TIME][j] = config[EPISODE_SECONDS] * when
    rows[R.CHANGE][j] = change
    if uniform(key_a, key_b, L.START, 2) < 0.5:
        rows[R.CHANGE][j] = max(-load, -change)
    _clear_hysteresis(rows, counts, j)
    share = config[L.CONFIG.start_share]
    peak = share * fixed[R.MAX_PRESSURE][j] * uniform(key_a, key_b, L.START, 3)
    begin = peak * uniform(key_a, key_b, L.START, 4)
    rows[R.REST][j] = rest_contraction(fixed, j, 0.0, load)
    elements = choices[CHOICE.elements]
    for pressure in (0.0, peak, begin):
        rows[R.PRESSURE][j] = pressure
        remember(rows, fixed, counts, tables, L.HYSTERESIS, j, j + 1, elements, work)
    for k in range(N_HISTORY):
        rows[R.HISTORY + k][j] = begin
    rows[R.SET_POINT][j] = begin
    rows[R.OLD_SET_POINT][j] = begin
    rows[R.CONTRACTION][j] = rest_contraction(fixed, j, rows[R.DRIVE][j], load)
    rows[R.VELOCITY][j] = 0.0
    rows[R.OLD_PRESSURE][j] = begin
    rows[R.OLD_AIR][j] = air_in_muscle(rows, fixed, j)
    begin_effects(rows, fixed, j)
    family = choices[CHOICE.reference]
    if family != SAMPLES:
        low, high = config[L.CONFIG.reference_low], config[L.CONFIG.reference_high]
        draw_reference(rows, L.REFERENCE, j, key_a, key_b, family, low, high)


@routine
def _clear_hysteresis(rows: Any, counts: Any, j: int) -> None:
    """Set the hysteresis to its state before the first pressure."""
    for k in range(len(rows) - L.HYSTERESIS):
        rows[L.HYSTERESIS + k][j] = 0.0
    counts[R.STACK_COUNT][j] = 1


@lru_cache(maxsize=8)
def kernels_for(kind: str, extended: bool = False) -> Kernels:
    """Return the kernels for a hysteresis model, plain or with effects."""
    rows = L.HYSTERESIS + state_rows(kind)
    effects = replacements(kind, rows) if extended else {}
    return Kernels(
        f"positioning_{kind}" + ("_extended" if extended else ""),
        kernels_for,
        (kind, extended),
        L.REPORT,
        apply=change_load,
        advance=advance_plant,
        reference=trajectory_at,
        evaluate=evaluate,
        begin=begin_muscle,
        config=L.CONFIG,
        choices=L.CHOICE,
        placeholders={
            "FIRST_HYSTERESIS": L.HYSTERESIS,
            "FIRST_REFERENCE": L.REFERENCE,
            **hysteresis_kernels(kind),
            **effects,
            "plant_advance": effects.get("advance", advance),
        },
        rows=rows + (R.N_EFFECTS if extended else 0),
        parameters=R.N_PARAMETERS,
        counts=R.N_COUNTS,
        signals=L.FIXED_SIGNALS,
        set_points=R.SET_POINT,
        old_set_points=R.OLD_SET_POINT,
    )
