"""Kernels of ``PAM/MusclePositioning-v0``: load change, report, reward, start."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from pam_envs.constants import ATMOSPHERE, DENSITY_PER_PRESSURE
from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.kernels import (
    change_of,
    change_payload,
    report_pressure,
    report_tracking,
    sense,
)
from pam_envs.envs.core.step import CHOICE, EPISODE_SECONDS, PERIOD
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
from pam_envs.tasks.rewards import excess

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
    change_payload(rows, counts[R.STEP], settings[0][PERIOD], R.TOLD_LOAD, R.LOAD)


@kernel
def evaluate(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Write readings, rewards, costs, margins and efforts of a tile into ``work``."""
    step, config, reference = counts[R.STEP], settings[0], work[L.SIGNALS + choices[CHOICE.fixed]]
    for j in range(LANES):
        output, pressure = true_position(rows, j), rows[R.PRESSURE][j]
        seen = sense(seen_position(rows, j), fixed, counts, R.POSITION_NOISE, L.NOISE_X, step[j], j)
        work[L.INFO.sensor_contraction][j] = work[L.SIGNALS][j] = seen
        seen = sense(seen_pressure(rows, j), fixed, counts, R.PRESSURE_NOISE, L.NOISE_P, step[j], j)
        work[L.INFO.sensor_pressure][j] = work[L.SIGNALS + 1][j] = seen
        work[L.INFO.state_contraction][j] = output
        report_tracking(work, config, L.INFO, L.CONFIG, reference[j], output, j)
        moved = rows[R.SET_POINT][j] - rows[R.OLD_SET_POINT][j]
        full = fixed[R.MAX_PRESSURE][j]
        report_pressure(work, config, L.INFO, L.CONFIG, pressure, moved, full, j)
        work[L.INFO.cost_contraction][j] = excess(output, config[L.CONFIG.soft_contraction])
        margin = min(
            config[L.CONFIG.highest_contraction] - output,
            output - config[L.CONFIG.lowest_contraction],
        )
        work[L.INFO.margin_contraction][j] = margin
        work[L.ENDED][j] = 1.0 if margin < 0.0 else 0.0
        travel = change_of(rows, R.PRESSURE, R.OLD_PRESSURE, j)
        air = air_in_muscle(rows, fixed, j)
        work[L.INFO.effort_pressure_travel][j] = abs(travel)
        work[L.INFO.effort_air][j] = max(0.0, air - rows[R.OLD_AIR][j])
        rows[R.OLD_AIR][j] = air


@routine
def begin_muscle(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any, member: int, j: int,
) -> None:  # fmt: skip
    """Bring lane ``j`` to rest under a drawn load and pressure history, and draw its reference."""
    key_a, key_b, config = counts[R.KEY_A][j], counts[R.KEY_B][j], settings[0]
    counts[R.MEMBER][j] = member
    drawn = int(uniform(key_a, key_b, L.START, 0) * choices[L.CHOICE.loads])
    load, change = settings[choices[CHOICE.at_own]][drawn], config[L.CONFIG.load_change]
    rows[R.TOLD_LOAD][j] = rows[R.LOAD][j] = load
    when = 0.3 + 0.4 * uniform(key_a, key_b, L.START, 1)
    rows[R.CHANGE_TIME][j] = config[EPISODE_SECONDS] * when
    rows[R.CHANGE][j] = change
    if uniform(key_a, key_b, L.START, 2) < 0.5:
        rows[R.CHANGE][j] = max(-load, -change)
    for k in range(len(rows) - L.HYSTERESIS):
        rows[L.HYSTERESIS + k][j] = 0.0
    counts[R.STACK_COUNT][j] = 1
    full = config[L.CONFIG.start_share] * fixed[R.MAX_PRESSURE][j]
    peak = full * uniform(key_a, key_b, L.START, 3)
    begin = peak * uniform(key_a, key_b, L.START, 4)
    rows[R.REST][j] = rest_contraction(fixed, j, 0.0, load)
    elements = choices[CHOICE.elements]
    for pressure in (0.0, peak, begin):
        rows[R.PRESSURE][j] = pressure
        remember(rows, fixed, counts, tables, L.HYSTERESIS, j, j + 1, elements, work)
    for k in range(N_HISTORY):
        rows[R.HISTORY + k][j] = begin
    rows[R.SET_POINT][j] = rows[R.OLD_SET_POINT][j] = rows[R.OLD_PRESSURE][j] = begin
    rows[R.CONTRACTION][j] = rest_contraction(fixed, j, rows[R.DRIVE][j], load)
    rows[R.VELOCITY][j] = 0.0
    rows[R.OLD_AIR][j] = air_in_muscle(rows, fixed, j)
    begin_effects(rows, fixed, j)
    family = choices[CHOICE.reference]
    if family != SAMPLES:
        low, high = config[L.CONFIG.reference_low], config[L.CONFIG.reference_high]
        draw_reference(rows, L.REFERENCE, j, key_a, key_b, family, low, high)


@lru_cache(maxsize=8)
def kernels_for(kind: str, extended: bool = False) -> Kernels:
    """Return the kernels for a hysteresis model, plain or with effects."""
    rows = L.HYSTERESIS + state_rows(kind)
    effects = replacements(kind, rows) if extended else {}
    return Kernels(
        "positioning",
        kernels_for,
        (kind, extended),
        L.REPORT,
        evaluate,
        begin_muscle,
        rows=rows + (R.N_EFFECTS if extended else 0),
        parameters=R.N_PARAMETERS,
        counts=R.N_COUNTS,
        set_points=R.SET_POINT,
        old_set_points=R.OLD_SET_POINT,
        config=L.CONFIG,
        choices=L.CHOICE,
        apply=change_load,
        placeholders={
            "FIRST_HYSTERESIS": L.HYSTERESIS,
            "FIRST_REFERENCE": L.REFERENCE,
            **hysteresis_kernels(kind),
            **effects,
            "plant_advance": effects.get("advance", advance),
        },
    )
