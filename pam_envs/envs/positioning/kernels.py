"""What sets ``PAM/MusclePositioning-v0`` apart in a step: reference, report, reward, start.

The step itself stands in :mod:`pam_envs.envs.core.step`.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from pam_envs.constants import ATMOSPHERE, DENSITY_PER_PRESSURE
from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.step import (
    AT_OWN,
    EPISODE_SECONDS,
    FIRST_CHOICE,
    FIRST_CONFIG,
    MOST_PREVIEW,
    PERIOD,
    SUBSTEPS,
    write_references,
)
from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.history import N_HISTORY
from pam_envs.kernels.random import normal, uniform
from pam_envs.muscle.effective_area import volume
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.effects import replacements
from pam_envs.plants.single_muscle.hysteresis_kernels import hysteresis_kernels
from pam_envs.plants.single_muscle.step import (
    N_WORK,
    advance,
    begin_effects,
    rest_contraction,
    seen_position,
    seen_pressure,
    true_position,
)
from pam_envs.references.trajectory import ROWS as REFERENCE_ROWS
from pam_envs.references.trajectory import SAMPLES, draw_reference, reference_value
from pam_envs.sensing.sensor import read_sensor
from pam_envs.tasks.tracking import effort_reward, excess, tracking_reward

REFERENCE = R.END
HYSTERESIS = R.END + REFERENCE_ROWS
"""First row of the hysteresis's state."""

INFO = (
    "time",
    "reference",
    "output",
    "reward/tracking",
    "reward/effort",
    "cost/contraction",
    "cost/pressure",
    "margin/contraction",
    "margin/pressure",
    "effort/pressure_travel",
    "effort/air",
    "state/contraction",
    "state/velocity",
    "state/pressure",
    "state/drive",
    "state/load",
    "sensor/contraction",
    "sensor/pressure",
    "saturated",
)
(
    TIME,
    REF,
    OUTPUT,
    R_TRACKING,
    R_EFFORT,
    C_CONTRACTION,
    C_PRESSURE,
    M_CONTRACTION,
    M_PRESSURE,
    E_TRAVEL,
    E_AIR,
    S_CONTRACTION,
    S_VELOCITY,
    S_PRESSURE,
    S_DRIVE,
    S_LOAD,
    SENSOR_X,
    SENSOR_P,
    SATURATED,
) = range(N_WORK, N_WORK + len(INFO))
ENDED = N_WORK + len(INFO)
SIGNALS = ENDED + 1
"""First work row of the observation, in SI: contraction, pressure, set-point, load, references."""
FIXED_SIGNALS = 4

# numbers of the configuration, after those that all families share
CONFIG = (
    "tracking_weight",
    "error_scale",
    "effort_weight",
    "soft_contraction",
    "soft_pressure",
    "lowest_contraction",
    "highest_contraction",
    "reference_low",
    "reference_high",
    "start_share",
    "load_change",
)
(
    TRACKING_WEIGHT,
    ERROR_SCALE,
    EFFORT_WEIGHT,
    SOFT_CONTRACTION,
    SOFT_PRESSURE,
    LOWEST,
    HIGHEST,
    REFERENCE_LOW,
    REFERENCE_HIGH,
    START_SHARE,
    LOAD_CHANGE,
) = range(FIRST_CONFIG, FIRST_CONFIG + len(CONFIG))
CHOICES = ("elements", "family", "sines", "loads")
N_ELEMENTS, FAMILY, SINES, N_LOADS = range(FIRST_CHOICE, FIRST_CHOICE + len(CHOICES))
"""Whole numbers of the configuration, after those that all families share. The one own row of the
settings holds the loads [kg] to draw from."""


NOISE_X, NOISE_P, START = 1, 2, 3
"""Random streams."""

remember: Any = None  # a placeholder, filled in for each hysteresis


@kernel
def air_in_muscle(rows: Any, fixed: Any, j: int) -> float:
    """Return the mass of air [kg] in the muscle of lane ``j``."""
    length = fixed[R.REST_LENGTH][j]
    space = volume(rows[R.CONTRACTION][j] / length, length, fixed[R.TALL][j], fixed[R.COSINE][j])
    return DENSITY_PER_PRESSURE * (rows[R.PRESSURE][j] + ATMOSPHERE) * space


@kernel
def reference_at(
    rows: Any,
    fixed: Any,
    samples: Any,
    settings: Any,
    choices: Any,
    step: int,
    lane: int,
    channel: int,
) -> float:
    """Return the reference [m] of one lane at a control period."""
    if choices[FAMILY] == SAMPLES:
        return samples[0][min(step, len(samples[0]) - 1)]  # type: ignore[no-any-return]
    return reference_value(rows, REFERENCE, lane, step * settings[0][PERIOD], choices[SINES])


@kernel
def change_load(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Let the load change at its time."""
    step, load, period = counts[R.STEP], rows[R.LOAD], settings[0][PERIOD]
    told, when, change = rows[R.TOLD_LOAD], rows[R.CHANGE_TIME], rows[R.CHANGE]
    for j in range(LANES):
        load[j] = told[j] + (change[j] if step[j] * period >= when[j] else 0.0)


@kernel
def advance_muscle(
    rows: Any,
    fixed: Any,
    counts: Any,
    tables: Any,
    samples: Any,
    settings: Any,
    choices: Any,
    work: Any,
) -> None:
    """Advance the plant by a control period."""
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


@kernel
def evaluate(
    rows: Any,
    fixed: Any,
    counts: Any,
    ahead: Any,
    settings: Any,
    choices: Any,
    work: Any,
) -> None:
    """Write what can be observed and reported of a tile into ``work``."""
    step, key_a, key_b = counts[R.STEP], counts[R.KEY_A], counts[R.KEY_B]
    velocity, pressure = rows[R.VELOCITY], rows[R.PRESSURE]
    set_point, older = rows[R.SET_POINT], rows[R.OLD_SET_POINT]
    config = settings[0]
    period = config[PERIOD]
    for j in range(LANES):
        work[TIME][j] = step[j] * period
        contraction = true_position(rows, j)
        work[OUTPUT][j] = contraction
        work[S_CONTRACTION][j] = contraction
        work[S_VELOCITY][j] = velocity[j]
        work[S_PRESSURE][j] = pressure[j]
        work[S_DRIVE][j] = rows[R.DRIVE][j]
        work[S_LOAD][j] = rows[R.LOAD][j]
        work[SENSOR_X][j] = read_sensor(
            seen_position(rows, j),
            fixed[R.POSITION_NOISE][j],
            fixed[R.POSITION_RESOLUTION][j],
            fixed[R.POSITION_BIAS][j],
            normal(key_a[j], key_b[j], NOISE_X, step[j]),
        )
        work[SENSOR_P][j] = read_sensor(
            seen_pressure(rows, j),
            fixed[R.PRESSURE_NOISE][j],
            fixed[R.PRESSURE_RESOLUTION][j],
            fixed[R.PRESSURE_BIAS][j],
            normal(key_a[j], key_b[j], NOISE_P, step[j]),
        )
        work[SIGNALS][j] = work[SENSOR_X][j]
        work[SIGNALS + 1][j] = work[SENSOR_P][j]
        work[SIGNALS + 2][j] = set_point[j]
        work[SIGNALS + 3][j] = rows[R.TOLD_LOAD][j]
    write_references(counts, ahead, choices, work, SIGNALS + FIXED_SIGNALS)
    now = work[SIGNALS + FIXED_SIGNALS]
    for j in range(LANES):
        output = work[OUTPUT][j]
        work[REF][j] = now[j]
        work[R_TRACKING][j] = tracking_reward(
            output - now[j], config[ERROR_SCALE], config[TRACKING_WEIGHT]
        )
        work[R_EFFORT][j] = effort_reward(
            set_point[j] - older[j], fixed[R.MAX_PRESSURE][j], config[EFFORT_WEIGHT]
        )
        work[C_CONTRACTION][j] = excess(output, config[SOFT_CONTRACTION])
        work[C_PRESSURE][j] = excess(pressure[j], config[SOFT_PRESSURE])
        work[M_CONTRACTION][j] = min(config[HIGHEST] - output, output - config[LOWEST])
        work[ENDED][j] = 1.0 if work[M_CONTRACTION][j] < 0.0 else 0.0
        work[M_PRESSURE][j] = config[SOFT_PRESSURE] - pressure[j]
        air = air_in_muscle(rows, fixed, j)
        work[E_TRAVEL][j] = abs(pressure[j] - rows[R.OLD_PRESSURE][j])
        work[E_AIR][j] = max(0.0, air - rows[R.OLD_AIR][j])
        rows[R.OLD_PRESSURE][j] = pressure[j]
        rows[R.OLD_AIR][j] = air


@routine
def begin_muscle(
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
    """Bring lane ``j`` to rest under a load and a history that are drawn, and its reference."""
    key_a, key_b, config = counts[R.KEY_A][j], counts[R.KEY_B][j], settings[0]
    counts[R.MEMBER][j] = member
    load = settings[choices[AT_OWN]][int(uniform(key_a, key_b, START, 0) * choices[N_LOADS])]
    rows[R.TOLD_LOAD][j] = load
    rows[R.LOAD][j] = load
    rows[R.CHANGE_TIME][j] = config[EPISODE_SECONDS] * (0.3 + 0.4 * uniform(key_a, key_b, START, 1))
    rows[R.CHANGE][j] = config[LOAD_CHANGE]
    if uniform(key_a, key_b, START, 2) < 0.5:
        rows[R.CHANGE][j] = max(-load, -config[LOAD_CHANGE])
    _start_hysteresis(rows, counts, j)
    peak = config[START_SHARE] * fixed[R.MAX_PRESSURE][j] * uniform(key_a, key_b, START, 3)
    begin = peak * uniform(key_a, key_b, START, 4)
    rows[R.REST][j] = rest_contraction(fixed, j, 0.0, load)
    for pressure in (0.0, peak, begin):
        rows[R.PRESSURE][j] = pressure
        remember(rows, fixed, counts, tables, HYSTERESIS, j, j + 1, choices[N_ELEMENTS], work)
    for k in range(N_HISTORY):
        rows[R.HISTORY + k][j] = begin
    rows[R.SET_POINT][j] = begin
    rows[R.OLD_SET_POINT][j] = begin
    rows[R.CONTRACTION][j] = rest_contraction(fixed, j, rows[R.DRIVE][j], load)
    rows[R.VELOCITY][j] = 0.0
    rows[R.OLD_PRESSURE][j] = begin
    rows[R.OLD_AIR][j] = air_in_muscle(rows, fixed, j)
    begin_effects(rows, fixed, j)
    if choices[FAMILY] != SAMPLES:
        draw_reference(
            rows,
            REFERENCE,
            j,
            key_a,
            key_b,
            choices[FAMILY],
            config[REFERENCE_LOW],
            config[REFERENCE_HIGH],
        )


@routine
def _start_hysteresis(rows: Any, counts: Any, j: int) -> None:
    """Forget everything: the muscle as it rests before its first pressure."""
    for k in range(len(rows) - HYSTERESIS):
        rows[HYSTERESIS + k][j] = 0.0
    counts[R.STACK_COUNT][j] = 1


@lru_cache(maxsize=8)
def kernels_for(kind: str, extended: bool = False) -> Kernels:
    """Return the kernels for a kind of hysteresis, plain or with effects."""
    rows = HYSTERESIS + state_rows(kind)
    functions = {
        "env_apply": change_load,
        "env_advance": advance_muscle,
        "env_reference": reference_at,
        "env_evaluate": evaluate,
        "env_begin": begin_muscle,
        **hysteresis_kernels(kind),
    }
    if extended:
        functions |= replacements(kind, rows)
    return Kernels(
        f"positioning_{kind}" + ("_extended" if extended else ""),
        kernels_for,
        (kind, extended),
        functions,
        info=INFO,
        rows=rows + (R.N_EFFECTS if extended else 0),
        parameters=R.N_PARAMETERS,
        counts=R.N_COUNTS,
        scratch=N_WORK,
        signals=FIXED_SIGNALS + 1 + MOST_PREVIEW,
        set_points=R.SET_POINT,
        old_set_points=R.OLD_SET_POINT,
    )
