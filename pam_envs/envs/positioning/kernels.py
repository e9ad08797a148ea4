"""Kernels of ``PAM/MusclePositioning-v0``: load change, report, reward, start."""

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
from pam_envs.envs.core.layout import Report, computed, copied, indices
from pam_envs.envs.core.step import CHOICE, EPISODE_SECONDS, FIRST_CHOICE, FIRST_CONFIG, PERIOD
from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.motion import fill_ring
from pam_envs.kernels.random import uniform
from pam_envs.muscle.effective_area import volume
from pam_envs.parameters import declarations
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.effects import replacements
from pam_envs.plants.single_muscle.hysteresis_kernels import hysteresis_kernels
from pam_envs.plants.single_muscle.step import (
    N_WORK,
    advance,
    begin_effects,
    begin_rest,
    lost_pressure,
    rest_contraction,
    seen_position,
    seen_pressure,
    slide_to_rest,
    true_position,
)
from pam_envs.references import trajectory as T
from pam_envs.references.trajectory import draw_reference
from pam_envs.tasks.rewards import excess
from pam_envs.tasks.tracking import Tracking

REFERENCE = R.END
HYSTERESIS = R.END + T.ROWS
"""First row of the state of the hysteresis."""

REPORT = Report(
    {
        **computed("reward", "tracking", "effort"),
        **computed("cost", "contraction", "pressure"),
        **computed("margin", "contraction", "pressure"),
        **computed("effort", "pressure_travel", "air"),
        **computed("state", "contraction"),
        **copied("state", R, "velocity", "pressure", "drive", "load"),
        **computed("sensor", "contraction", "pressure"),
    },
    N_WORK,
    observed=(None, None, R.SET_POINT, R.DECLARED_LOAD),
)
INFO, ENDED, SIGNALS = REPORT.rows, REPORT.ended, REPORT.signals

CONFIG = indices(
    (*declarations(Tracking), "reference_low", "reference_high", "start_share", "load_change"),
    FIRST_CONFIG,
)
OWN = indices(("loads",), FIRST_CHOICE)
"""The own row of the settings holds the loads [kg] to draw from."""

NOISE_X, NOISE_P, START = 1, 2, 3
"""Random streams."""
write_drive: Any = None  # a placeholder, replaced for each hysteresis


@kernel
def air_in_muscle(rows: Any, fixed: Any, j: int) -> tuple[float, float]:
    """Return the mass of air [kg] in the muscle of lane ``j``, and what leaked in this period."""
    length = fixed[R.MUSCLE_REST_LENGTH][j]
    space = volume(
        rows[R.CONTRACTION][j] / length, length, fixed[R.MUSCLE_DIAMETER][j],
        fixed[R.MUSCLE_AREA][j], fixed[R.MUSCLE_AREA_TAPER][j], fixed[R.MUSCLE_AREA_CURVE][j],
    )  # fmt: skip
    inside = DENSITY_PER_PRESSURE * (rows[R.PRESSURE][j] + ATMOSPHERE) * space
    return inside, DENSITY_PER_PRESSURE * lost_pressure(rows, j) * space


@kernel
def change_load(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Change the load at its time."""
    change_payload(rows, counts[R.STEP], settings[0][PERIOD], R.DECLARED_LOAD, R.LOAD)


@kernel
def evaluate(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Write readings, rewards, costs, margins and efforts of a tile into ``work``."""
    step, config, reference = counts[R.STEP], settings[0], work[SIGNALS + choices[CHOICE.fixed]]
    for j in range(LANES):
        work[INFO.state_contraction][j] = true_position(rows, j)
        seen = sense(seen_position(rows, j), fixed, counts, R.POSITION_NOISE, NOISE_X, step[j], j)
        work[INFO.sensor_contraction][j] = work[SIGNALS][j] = seen
        seen = sense(seen_pressure(rows, j), fixed, counts, R.PRESSURE_NOISE, NOISE_P, step[j], j)
        work[INFO.sensor_pressure][j] = work[SIGNALS + 1][j] = seen
    for j in range(LANES):
        output, pressure = work[INFO.state_contraction][j], rows[R.PRESSURE][j]
        report_tracking(work, config, INFO, CONFIG, reference[j], output, j)
        moved = rows[R.SET_POINT][j] - rows[R.OLD_SET_POINT][j]
        full = fixed[R.REGULATOR_MAX_PRESSURE][j]
        report_pressure(work, config, INFO, CONFIG, pressure, moved, full, j)
        work[INFO.cost_contraction][j] = excess(output, config[CONFIG.soft_contraction])
        margin = min(
            config[CONFIG.highest_contraction] - output,
            output - config[CONFIG.lowest_contraction],
        )
        work[INFO.margin_contraction][j] = margin
        work[ENDED][j] = 1.0 if margin < 0.0 else 0.0
        travel = change_of(rows, R.PRESSURE, R.OLD_PRESSURE, j)
        air, leaked = air_in_muscle(rows, fixed, j)
        work[INFO.effort_pressure_travel][j] = abs(travel)
        work[INFO.effort_air][j] = max(0.0, air - rows[R.OLD_AIR][j] + leaked)
        rows[R.OLD_AIR][j] = air


@routine
def begin_muscle(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any, j: int,
) -> None:  # fmt: skip
    """Bring lane ``j`` to rest under a drawn load and pressure history, and draw its reference."""
    key_a, key_b, config = counts[R.KEY_A][j], counts[R.KEY_B][j], settings[0]
    drawn = int(uniform(key_a, key_b, START, 0) * choices[OWN.loads])
    load, change = settings[choices[CHOICE.at_own]][drawn], config[CONFIG.load_change]
    rows[R.DECLARED_LOAD][j] = rows[R.LOAD][j] = load
    when = 0.3 + 0.4 * uniform(key_a, key_b, START, 1)
    rows[R.CHANGE_TIME][j] = config[EPISODE_SECONDS] * when
    rows[R.CHANGE][j] = change
    if uniform(key_a, key_b, START, 2) < 0.5:
        rows[R.CHANGE][j] = max(-load, -change)
    for k in range(len(rows) - HYSTERESIS):
        rows[HYSTERESIS + k][j] = 0.0
    counts[R.STACK_COUNT][j] = 1
    full = config[CONFIG.start_share] * fixed[R.REGULATOR_MAX_PRESSURE][j]
    peak = full * uniform(key_a, key_b, START, 3)
    begin = peak * uniform(key_a, key_b, START, 4)
    rows[R.REST][j] = rest_contraction(fixed, j, 0.0, load)
    elements = choices[CHOICE.elements]
    begin_rest(rows, fixed, counts, tables, HYSTERESIS, elements, j)
    for pressure in (0.0, peak, begin):
        rows[R.PRESSURE][j] = pressure
        write_drive(rows, fixed, counts, tables, HYSTERESIS, j, j + 1, elements, work)
        slide_to_rest(rows, fixed, counts, tables, HYSTERESIS, elements, j)
    fill_ring(rows, R.HISTORY, j, begin)
    rows[R.SET_POINT][j] = rows[R.OLD_SET_POINT][j] = rows[R.OLD_PRESSURE][j] = begin
    rows[R.OLD_AIR][j], _ = air_in_muscle(rows, fixed, j)
    begin_effects(rows, fixed, j)
    family = choices[CHOICE.reference]
    if family != T.SAMPLES:
        low, high = config[CONFIG.reference_low], config[CONFIG.reference_high]
        draw_reference(rows, REFERENCE, j, key_a, key_b, family, low, high)


@lru_cache(maxsize=8)
def kernels_for(kind: str, extended: bool = False) -> Kernels:
    """Return the kernels for a hysteresis model, plain or with effects."""
    rows = HYSTERESIS + state_rows(kind)
    effects = replacements(kind, rows) if extended else {}
    return Kernels(
        "positioning",
        kernels_for,
        (kind, extended),
        REPORT,
        evaluate,
        begin_muscle,
        rows=rows + (R.STATE.end if extended else 0),
        parameters=R.N_PARAMETERS,
        counts=R.N_COUNTS,
        set_points=R.SET_POINT,
        old_set_points=R.OLD_SET_POINT,
        config=CONFIG,
        choices=OWN,
        apply=change_load,
        placeholders={
            "FIRST_HYSTERESIS": HYSTERESIS,
            "FIRST_REFERENCE": REFERENCE,
            **hysteresis_kernels(kind),
            **effects,
            "plant_advance": effects.get("advance", advance),
        },
    )
