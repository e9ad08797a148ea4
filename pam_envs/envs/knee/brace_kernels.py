"""What sets ``PAM/KneeTension-v0`` and ``PAM/KneeStiffness-v0`` apart in a step.

The step itself stands in :mod:`pam_envs.envs.core.step`.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.step import (
    AT_OWN,
    FIRST_CHOICE,
    FIRST_CONFIG,
    MOST_PREVIEW,
    PERIOD,
    SUBSTEPS,
    nothing_happens,
    write_references,
)
from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.random import normal, uniform
from pam_envs.mechanics.knee_lever import half_angle, muscle_length
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.step import (
    N_WORK,
    advance,
    begin_lane,
    replacements,
)
from pam_envs.references.trajectory import (
    KNOT,
    KNOTS,
    RAMP,
    RATE,
    SAMPLES,
    SINE,
    SINES,
    draw_reference,
    reference_value,
)
from pam_envs.references.trajectory import ROWS as REFERENCE_ROWS
from pam_envs.sensing.sensor import read_sensor
from pam_envs.tasks.tracking import effort_reward, excess, tracking_reward

REFERENCE = K.END
HYSTERESIS = K.END + REFERENCE_ROWS
"""First row of the hysteresis's state."""

INFO = (
    "time",
    "reference",
    "output",
    "reward/tracking",
    "reward/effort",
    "cost/pressure",
    "margin/tension",
    "margin/pressure",
    "effort/pressure_travel",
    "effort/air",
    "state/tension",
    "state/stiffness",
    "state/angle",
    "state/velocity",
    "state/length",
    "state/pressure",
    "sensor/tension",
    "sensor/stiffness",
    "sensor/angle",
    "sensor/pressure",
    "saturated",
)
(
    TIME,
    REF,
    OUTPUT,
    R_TRACKING,
    R_EFFORT,
    C_PRESSURE,
    M_TENSION,
    M_PRESSURE,
    E_TRAVEL,
    E_AIR,
    S_TENSION,
    S_STIFFNESS,
    S_ANGLE,
    S_VELOCITY,
    S_LENGTH,
    S_PRESSURE,
    SENSOR_T,
    SENSOR_S,
    SENSOR_A,
    SENSOR_P,
    SATURATED,
) = range(N_WORK, N_WORK + len(INFO))
ENDED = N_WORK + len(INFO)
SIGNALS = ENDED + 1
"""First work row of the observation, in SI."""
FIXED_SIGNALS = 5

CONFIG = (
    "tracking_weight",
    "error_scale",
    "effort_weight",
    "soft_pressure",
    "highest_tension",
    "reference_low",
    "reference_high",
    "frequency",
    "start_low",
    "start_high",
)
(
    TRACKING_WEIGHT,
    ERROR_SCALE,
    EFFORT_WEIGHT,
    SOFT_PRESSURE,
    HIGHEST_TENSION,
    REFERENCE_LOW,
    REFERENCE_HIGH,
    FREQUENCY,
    START_LOW,
    START_HIGH,
) = range(FIRST_CONFIG, FIRST_CONFIG + len(CONFIG))
CHOICES = ("elements", "family", "sines", "quantity")
N_ELEMENTS, FAMILY, N_SINES, QUANTITY = range(FIRST_CHOICE, FIRST_CHOICE + len(CHOICES))
TENSION, STIFFNESS = 0, 1
"""What is tracked."""

PAPER = SAMPLES + 1
"""Family number of the paper's sine: it begins at its lowest value."""
NOISE_T, NOISE_A, NOISE_P, START = 8, 9, 10, 15
"""Random streams."""


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
    """Return the reference of one lane at a control period."""
    if choices[FAMILY] == SAMPLES:
        return samples[0][min(step, len(samples[0]) - 1)]  # type: ignore[no-any-return]
    return reference_value(rows, REFERENCE, lane, step * settings[0][PERIOD], choices[N_SINES])


@kernel
def advance_brace(
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
        settings[choices[AT_OWN] :],
        HYSTERESIS,
        choices[N_ELEMENTS],
        choices[SUBSTEPS],
        settings[0][PERIOD],
        work,
    )


@kernel
def read_brace(rows: Any, fixed: Any, counts: Any, work: Any, j: int) -> None:
    """Write what the sensors of the brace give for lane ``j``."""
    step, key_a, key_b = counts[K.STEP][j], counts[K.KEY_A][j], counts[K.KEY_B][j]
    tension = read_sensor(
        rows[K.TENSION][j],
        fixed[K.TENSION_NOISE][j],
        fixed[K.TENSION_RESOLUTION][j],
        fixed[K.TENSION_BIAS][j],
        normal(key_a, key_b, NOISE_T, step),
    )
    angle = read_sensor(
        rows[K.ANGLE][j],
        fixed[K.ANGLE_NOISE][j],
        fixed[K.ANGLE_RESOLUTION][j],
        fixed[K.ANGLE_BIAS][j],
        normal(key_a, key_b, NOISE_A, step),
    )
    sine, _ = half_angle(angle)
    length = muscle_length(sine, fixed[K.LEVER_ARM][j], fixed[K.LEVER_FITTINGS][j])
    work[SENSOR_T][j] = tension
    work[SENSOR_A][j] = angle
    work[SENSOR_S][j] = tension / max(1e-3, length - fixed[K.SHORTEST_LENGTH][j])
    work[SENSOR_P][j] = read_sensor(
        rows[K.PRESSURE][j],
        fixed[K.PRESSURE_NOISE][j],
        fixed[K.PRESSURE_RESOLUTION][j],
        fixed[K.PRESSURE_BIAS][j],
        normal(key_a, key_b, NOISE_P, step),
    )


@kernel
def evaluate(
    rows: Any, fixed: Any, counts: Any, ahead: Any, settings: Any, choices: Any, work: Any
) -> None:
    """Write what can be observed and reported of a tile into ``work``."""
    step, config = counts[K.STEP], settings[0]
    pressure, set_point, older = rows[K.PRESSURE], rows[K.SET_POINT], rows[K.OLD_SET_POINT]
    stiffness = choices[QUANTITY] == STIFFNESS
    for j in range(LANES):
        read_brace(rows, fixed, counts, work, j)
        work[TIME][j] = step[j] * config[PERIOD]
        work[S_TENSION][j] = rows[K.TENSION][j]
        work[S_STIFFNESS][j] = rows[K.STIFFNESS][j]
        work[S_ANGLE][j] = rows[K.ANGLE][j]
        work[S_VELOCITY][j] = rows[K.VELOCITY][j]
        work[S_LENGTH][j] = rows[K.LENGTH][j]
        work[S_PRESSURE][j] = pressure[j]
        work[OUTPUT][j] = rows[K.STIFFNESS][j] if stiffness else rows[K.TENSION][j]
        work[SIGNALS][j] = work[SENSOR_T][j]
        work[SIGNALS + 1][j] = work[SENSOR_S][j]
        work[SIGNALS + 2][j] = work[SENSOR_A][j]
        work[SIGNALS + 3][j] = work[SENSOR_P][j]
        work[SIGNALS + 4][j] = set_point[j]
    write_references(counts, ahead, choices, work, SIGNALS + FIXED_SIGNALS)
    now, scale = work[SIGNALS + FIXED_SIGNALS], config[ERROR_SCALE]
    for j in range(LANES):
        work[REF][j] = now[j]
        work[R_TRACKING][j] = tracking_reward(
            work[OUTPUT][j] - now[j], scale, config[TRACKING_WEIGHT]
        )
        work[R_EFFORT][j] = effort_reward(
            set_point[j] - older[j], fixed[K.MAX_PRESSURE][j], config[EFFORT_WEIGHT]
        )
        work[C_PRESSURE][j] = excess(pressure[j], config[SOFT_PRESSURE])
        work[M_TENSION][j] = config[HIGHEST_TENSION] - rows[K.TENSION][j]
        work[M_PRESSURE][j] = config[SOFT_PRESSURE] - pressure[j]
        work[ENDED][j] = 1.0 if work[M_TENSION][j] < 0.0 else 0.0
        work[E_TRAVEL][j] = abs(pressure[j] - rows[K.OLD_PRESSURE][j])
        work[E_AIR][j] = max(0.0, rows[K.AIR][j] - rows[K.OLD_AIR][j])
        rows[K.OLD_PRESSURE][j] = pressure[j]
        rows[K.OLD_AIR][j] = rows[K.AIR][j]


@routine
def begin_brace(
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
    """Bring lane ``j`` to rest under a drawn pressure, and draw its reference."""
    key_a, key_b, config = counts[K.KEY_A][j], counts[K.KEY_B][j], settings[0]
    counts[K.MEMBER][j] = member
    span = config[START_HIGH] - config[START_LOW]
    pressure = config[START_LOW] + span * uniform(key_a, key_b, START, 0)
    gait = settings[choices[AT_OWN] :]
    begin_lane(rows, fixed, counts, tables, gait, HYSTERESIS, choices[N_ELEMENTS], j, 0.0, pressure)
    low, high = config[REFERENCE_LOW], config[REFERENCE_HIGH]
    if choices[FAMILY] == PAPER:
        draw_paper(rows, j, low, high, config[FREQUENCY])
    elif choices[FAMILY] != SAMPLES:
        draw_reference(rows, REFERENCE, j, key_a, key_b, choices[FAMILY], low, high)


@routine
def draw_paper(rows: Any, j: int, low: float, high: float, frequency: float) -> None:
    """Make lane ``j``'s reference a sine between ``low`` and ``high`` that begins at ``low``."""
    rows[REFERENCE + RATE][j] = 1.0
    rows[REFERENCE + RAMP][j] = 0.0
    for k in range(KNOTS):
        rows[REFERENCE + KNOT + k][j] = 0.5 * (low + high)
    for k in range(3 * SINES):
        rows[REFERENCE + SINE + k][j] = 0.0
    rows[REFERENCE + SINE][j] = 0.5 * (high - low)
    rows[REFERENCE + SINE + 1][j] = frequency
    rows[REFERENCE + SINE + 2][j] = -0.25


@lru_cache(maxsize=16)
def kernels_for(kind: str, mounting: str, dynamics: str) -> Kernels:
    """Return the kernels for a kind of hysteresis, a mounting and the dynamics of the pressure."""
    functions = {
        "env_apply": nothing_happens,
        "env_advance": advance_brace,
        "env_reference": reference_at,
        "env_evaluate": evaluate,
        "env_begin": begin_brace,
        **replacements(kind, mounting, dynamics),
    }
    return Kernels(
        f"brace_{kind}_{mounting}_{dynamics}",
        kernels_for,
        (kind, mounting, dynamics),
        functions,
        info=INFO,
        rows=HYSTERESIS + state_rows(kind),
        parameters=K.N_PARAMETERS,
        counts=K.N_COUNTS,
        scratch=N_WORK,
        signals=FIXED_SIGNALS + 1 + MOST_PREVIEW,
        set_points=K.SET_POINT,
        old_set_points=K.OLD_SET_POINT,
    )
