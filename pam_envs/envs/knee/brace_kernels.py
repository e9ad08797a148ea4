"""Kernels of ``PAM/KneeTension-v0`` and ``PAM/KneeStiffness-v0``: sensors, report, start."""

from functools import lru_cache
from typing import Any

from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.kernels import change_of, report_pressure, report_tracking, sense
from pam_envs.envs.core.layout import Report, computed, copied, indices
from pam_envs.envs.core.step import CHOICE, FIRST_CHOICE, FIRST_CONFIG, PERIOD
from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.random import uniform
from pam_envs.mechanics.knee_lever import muscle_length
from pam_envs.parameters import declarations
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.motion import N_WORK
from pam_envs.plants.knee_orthosis.step import (
    SENSED,
    advance,
    begin_lane,
    leaked_air,
    replacements,
)
from pam_envs.references import trajectory as T
from pam_envs.references.trajectory import draw_reference
from pam_envs.tasks.gait_assistance import BraceTracking

REFERENCE = K.END
HYSTERESIS = K.END + T.ROWS
"""First row of the state of the hysteresis."""

REPORT = Report(
    {
        **computed("reward", "tracking", "effort"),
        **computed("cost", "pressure"),
        **computed("margin", "tension", "pressure"),
        **computed("effort", "pressure_travel", "air"),
        **copied("state", K, "tension", "stiffness", "angle", "velocity", "length", "pressure"),
        **computed("sensor", "tension", "stiffness", "angle", "pressure"),
    },
    N_WORK,
    observed=(None, None, None, None, K.SET_POINT),
)
INFO, ENDED, SIGNALS = REPORT.rows, REPORT.ended, REPORT.signals

CONFIG = indices(
    (
        *declarations(BraceTracking),
        *("reference_low", "reference_high", "frequency", "start_low", "start_high"),
    ),
    FIRST_CONFIG,
)
OWN = indices(("quantity",), FIRST_CHOICE)
QUANTITIES = ("tension", "stiffness")
TENSION, STIFFNESS = range(len(QUANTITIES))
"""Tracked quantities."""

PAPER = T.SAMPLES + 1
"""Number of the reference of yeh2010: a sine that begins at its lowest value."""
NOISE_T, NOISE_A, NOISE_P, START = 8, 9, 10, 15
"""Random streams."""
FIRST_HYSTERESIS = 0  # a placeholder: first row of the state of the hysteresis


@kernel
def advance_knee(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any,
) -> None:  # fmt: skip
    """Advance the plant by a control period."""
    gait = settings[choices[CHOICE.at_own] :]
    advance(
        rows, fixed, counts, tables, gait, FIRST_HYSTERESIS, choices[CHOICE.elements],
        choices[CHOICE.substeps], settings[0][PERIOD], work,
    )  # fmt: skip


@kernel
def read_brace(rows: Any, fixed: Any, counts: Any, work: Any, j: int) -> None:
    """Write the readings of lane ``j``."""
    step = counts[K.STEP][j]
    tension = sense(rows[SENSED[0]][j], fixed, counts, K.TENSION_NOISE, NOISE_T, step, j)
    angle = sense(rows[SENSED[1]][j], fixed, counts, K.ANGLE_NOISE, NOISE_A, step, j)
    pressure = sense(rows[SENSED[2]][j], fixed, counts, K.PRESSURE_NOISE, NOISE_P, step, j)
    sine, _ = sine_and_cosine(0.5 * angle)
    length = muscle_length(sine, fixed[K.LEVER_ARM][j], fixed[K.LEVER_FITTINGS][j])
    stiffness = tension / max(1e-3, length - fixed[K.MUSCLE_SHORTEST_LENGTH][j])
    work[INFO.sensor_tension][j] = work[SIGNALS][j] = tension
    work[INFO.sensor_stiffness][j] = work[SIGNALS + 1][j] = stiffness
    work[INFO.sensor_angle][j] = work[SIGNALS + 2][j] = angle
    work[INFO.sensor_pressure][j] = work[SIGNALS + 3][j] = pressure


@kernel
def evaluate(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Write readings, rewards, costs, margins and efforts of a tile into ``work``."""
    config, reference = settings[0], work[SIGNALS + choices[CHOICE.fixed]]
    tracked = K.STIFFNESS if choices[OWN.quantity] == STIFFNESS else K.TENSION
    for j in range(LANES):
        read_brace(rows, fixed, counts, work, j)
    for j in range(LANES):
        report_tracking(work, config, INFO, CONFIG, reference[j], rows[tracked][j], j)
        report_brace(rows, fixed, config, work, INFO, CONFIG, j)
        margin = config[CONFIG.highest_tension] - rows[K.TENSION][j]
        work[INFO.margin_tension][j] = margin
        work[ENDED][j] = 1.0 if margin < 0.0 else 0.0
        work[INFO.effort_air][j] = air_drawn(rows, fixed, j)


@kernel
def air_drawn(rows: Any, fixed: Any, j: int) -> float:
    """Return the air [kg] that the muscle of lane ``j`` has drawn since the last call."""
    return max(0.0, change_of(rows, K.AIR, K.OLD_AIR, j) + leaked_air(rows, fixed, j))


@kernel
def report_brace(rows: Any, fixed: Any, config: Any, work: Any, info: Any, at: Any, j: int) -> None:
    """Write costs, margins and efforts of the muscle's pressure."""
    full = fixed[K.REGULATOR_MAX_PRESSURE][j]
    moved = rows[K.SET_POINT][j] - rows[K.OLD_SET_POINT][j]
    report_pressure(work, config, info, at, rows[K.PRESSURE][j], moved, full, j)
    travel = change_of(rows, K.PRESSURE, K.OLD_PRESSURE, j)
    work[info.effort_pressure_travel][j] = abs(travel)


@routine
def begin_brace(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any, j: int,
) -> None:  # fmt: skip
    """Bring lane ``j`` to rest under a drawn pressure, and draw its reference."""
    key_a, key_b, config = counts[K.KEY_A][j], counts[K.KEY_B][j], settings[0]
    span = config[CONFIG.start_high] - config[CONFIG.start_low]
    pressure = config[CONFIG.start_low] + span * uniform(key_a, key_b, START, 0)
    gait, elements = settings[choices[CHOICE.at_own] :], choices[CHOICE.elements]
    begin_lane(rows, fixed, counts, tables, gait, HYSTERESIS, elements, j, 0.0, pressure)
    low, high = config[CONFIG.reference_low], config[CONFIG.reference_high]
    family = choices[CHOICE.reference]
    if family == PAPER:
        draw_paper(rows, j, low, high, config[CONFIG.frequency])
    elif family != T.SAMPLES:
        draw_reference(rows, REFERENCE, j, key_a, key_b, family, low, high)


@routine
def draw_paper(rows: Any, j: int, low: float, high: float, frequency: float) -> None:
    """Set the reference of lane ``j`` to a sine between ``low`` and ``high``, from ``low`` on."""
    rows[REFERENCE + T.RATE][j] = 1.0
    rows[REFERENCE + T.RAMP][j] = 0.0
    for k in range(T.KNOTS):
        rows[REFERENCE + T.KNOT + k][j] = 0.5 * (low + high)
    for k in range(3 * T.SINES):
        rows[REFERENCE + T.SINE + k][j] = 0.0
    rows[REFERENCE + T.SINE][j] = 0.5 * (high - low)
    rows[REFERENCE + T.SINE + 1][j] = frequency
    rows[REFERENCE + T.SINE + 2][j] = -0.25


@lru_cache(maxsize=16)
def kernels_for(kind: str, mounting: str, dynamics: str, extended: bool = False) -> Kernels:
    """Return the kernels for a hysteresis model, mounting and dynamics, plain or with effects."""
    rows = HYSTERESIS + state_rows(kind)
    return Kernels(
        "brace",
        kernels_for,
        (kind, mounting, dynamics, extended),
        REPORT,
        evaluate,
        begin_brace,
        rows=rows + (K.STATE.end if extended else 0),
        parameters=K.N_PARAMETERS,
        counts=K.N_COUNTS,
        set_points=K.SET_POINT,
        old_set_points=K.OLD_SET_POINT,
        config=CONFIG,
        choices=OWN,
        advance=advance_knee,
        placeholders={
            "FIRST_HYSTERESIS": HYSTERESIS,
            "FIRST_REFERENCE": REFERENCE,
            **replacements(kind, mounting, dynamics, rows if extended else None),
        },
    )
