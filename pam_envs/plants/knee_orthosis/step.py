"""One control period of the knee orthosis, for one environment or a tile of them.

    setpoint -> regulator -> pressure -> hysteresis -> stiffness -> tension -> brace (and leg)

The regulator is exact at the end of a sub-step, and the hysteresis then too, where the pressure
goes one way within a sub-step; the motion is of second order (see ``motion``).
"""

from typing import Any

from pam_envs.hysteresis import protocol
from pam_envs.kernels.arithmetic import decay
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.plants.core.muscle_path import begin_delay, follow_set_point
from pam_envs.plants.core.sensors import begin_sensors, read_sensors
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.effects import muscle_kernels
from pam_envs.plants.knee_orthosis.motion import (
    MOTIONS,
    WAS,
    friction_kernels,
    move_length,
)
from pam_envs.pneumatics.measured_dynamics import MODES, REAL_MODES, pair_factor, turned

PAIR = K.MODE_TABLE + 2 * REAL_MODES
"""First row of the parameters of the slow pair: decay, frequency, two gains."""

# placeholders, filled in for each hysteresis, mounting and regulator
write_stiffness: Any = None
hysteresis_begin: Any = None
regulate: Any = None
settle: Any = None
begin_period: Any = None
move: Any = None
feel: Any = None
slide: Any = None
start_friction: Any = None
settle_friction: Any = None
rest: Any = None
report: Any = None
report_tile: Any = None
SENSED = (K.TENSION, K.ANGLE, K.PRESSURE, K.HEEL, K.GROUND_Z, K.COP, K.ANKLE)
"""Rows of undisturbed readings, in the order of ``SENSORS``; effects replace them."""
EFFECTIVE = K.PRESSURE
"""Row of the effective pressure; that of the extended plant replaces it."""
hysteresis_scaled: Any = None


@kernel
def stiffness_of_line(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, first: int, last: int,
    elements: int,
) -> None:  # fmt: skip
    """Write the stiffness without hysteresis, proportional to the pressure."""
    pressure, stiffness = rows[EFFECTIVE], rows[K.STIFFNESS]
    for j in range(first, last):
        stiffness[j] = fixed[K.MUSCLE_GAIN][j] * fixed[K.MUSCLE_STIFFNESS_RATIO][j] * pressure[j]


@kernel
def stiffness_of_model(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, first: int, last: int,
    elements: int,
) -> None:  # fmt: skip
    """Write the stiffness by a hysteresis model of the pressure."""
    stiffness = rows[K.STIFFNESS]
    hysteresis_scaled(
        rows[EFFECTIVE], stiffness, fixed[K.HYSTERESIS_WIDTH], rows, fixed, counts, table, elements,
        hysteresis, K.MODEL, K.STACK_COUNT, K.MEMBER, first, last,
    )  # fmt: skip
    for j in range(first, last):
        stiffness[j] = fixed[K.MUSCLE_GAIN][j] * stiffness[j]


def hysteresis_kernels(kind: str) -> dict[str, Any]:
    """Return the kernels of a kind by the plant's placeholders."""
    model = protocol.model_of(kind)
    by_length = model.drive == "length"
    plain = model.identity or by_length
    return (
        protocol.kernels(kind)
        | friction_kernels(by_length)
        | {
            "write_stiffness": stiffness_of_line if plain else stiffness_of_model,
            "start_friction": start_free if by_length else start_without,
            "settle_friction": settle_length if by_length else settle_without,
        }
    )


@kernel
def start_without(
    rows: Any, fixed: Any, counts: Any, table: Any, gait: Any, hysteresis: int, elements: int,
    j: int,
) -> None:  # fmt: skip
    """Do nothing: the pressure has the hysteresis."""


@kernel
def start_free(
    rows: Any, fixed: Any, counts: Any, table: Any, gait: Any, hysteresis: int, elements: int,
    j: int,
) -> None:  # fmt: skip
    """Put the sliders of one lane at the length of rest without pressure, free of force."""
    rows[K.RUB][j] = 0.0
    rest(rows, fixed, counts, table, gait, hysteresis, elements, j)
    rows[K.RUB][j] = fixed[K.HYSTERESIS_FRICTION][j]
    for k in range(elements):
        rows[hysteresis + k][j] = rows[K.AT][j]


@kernel
def settle_without(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int
) -> None:
    """Do nothing: the pressure has the hysteresis."""


@kernel
def settle_length(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int
) -> None:
    """Move the friction of one lane to the length at which it came to rest."""
    move_length(rows, fixed, counts, table, hysteresis, elements, j, j + 1)


@kernel
def begin_muscle(rows: Any, fixed: Any, j: int) -> None:
    """Begin the effects of the muscle: a plain plant has none."""


@kernel
def stiffen_beyond(rows: Any, fixed: Any) -> None:
    """Add nothing: a plain plant's pressures stay within the regulator's range."""


@kernel
def settle_air(rows: Any, fixed: Any, h: float, work: Any) -> None:
    """Move the enclosed air of a tile with the motion: a plain plant has a regulator."""


@kernel
def begin_enclosed(rows: Any, fixed: Any, j: int) -> None:
    """Begin the enclosed air of the muscle of lane ``j``: a plain plant has a regulator."""


@kernel
def leaked_air(rows: Any, fixed: Any, j: int) -> float:
    """Return the air [kg] that leaked in this control period: a plain plant has no leak."""
    return 0.0


@kernel
def lag(rows: Any, fixed: Any, counts: Any, i: int, substeps: int, period: float) -> None:
    """Advance the pressure behind dead time, rate limit and first-order lag."""
    follow_set_point(
        rows, fixed, K.DELAY, K.REGULATOR_MAX_PRESSURE, rows[K.PRESSURE], rows[K.SET_POINT],
        counts[K.STEP], i, substeps, period,
    )  # fmt: skip


@kernel
def settle_lag(rows: Any, fixed: Any, j: int) -> None:
    """Put the lag of one lane at rest at its pressure, which is also its setpoint."""
    begin_delay(rows, j, K.DELAY, rows[K.PRESSURE][j])


@kernel
def measured(rows: Any, fixed: Any, counts: Any, i: int, substeps: int, period: float) -> None:
    """Advance the modes of the published frequency response."""
    h = period / substeps
    set_point = rows[K.SET_POINT]
    for j in range(LANES):
        u = max(0.0, min(fixed[K.REGULATOR_MAX_PRESSURE][j], set_point[j]))
        c, s = pair_factor(fixed[PAIR][j], fixed[PAIR + 1][j], h)
        real, imaginary = turned(
            u, rows[K.MODE + REAL_MODES][j], rows[K.MODE + REAL_MODES + 1][j], c, s
        )
        rows[K.MODE + REAL_MODES][j], rows[K.MODE + REAL_MODES + 1][j] = real, imaginary
        total = fixed[PAIR + 2][j] * real - fixed[PAIR + 3][j] * imaginary
        for k in range(REAL_MODES):
            x = u + (rows[K.MODE + k][j] - u) * decay(fixed[K.MODE_TABLE + k][j] * h)
            rows[K.MODE + k][j] = x
            total = total + fixed[K.MODE_TABLE + REAL_MODES + k][j] * x
        rows[K.PRESSURE][j] = total


@kernel
def settle_measured(rows: Any, fixed: Any, j: int) -> None:
    """Put the modes of one lane at rest at its pressure."""
    for k in range(MODES - 1):
        rows[K.MODE + k][j] = rows[K.PRESSURE][j]
    rows[K.MODE + MODES - 1][j] = 0.0


@kernel
def advance(
    rows: Any, fixed: Any, counts: Any, table: Any, gait: Any, hysteresis: int, elements: int,
    substeps: int, period: float, work: Any,
) -> None:  # fmt: skip
    """Advance a tile by control period ``counts[STEP]``, towards its setpoints [Pa].

    ``gait`` is ``KneeOrthosis.gait_table()``, ``hysteresis`` the first row of the hysteresis state;
    ``work`` are ``N_WORK`` rows of scratch.
    """
    h = period / substeps
    begin_period(rows, fixed, counts, gait, period, work)
    for i in range(substeps):
        regulate(rows, fixed, counts, i, substeps, period)
        for j in range(LANES):
            work[WAS][j] = rows[K.STIFFNESS][j]
        write_stiffness(rows, fixed, counts, table, hysteresis, 0, LANES, elements)
        stiffen_beyond(rows, fixed)
        feel(rows, fixed, counts, table, hysteresis, elements, 0.5 * h, work)
        move(rows, fixed, counts, gait, i, substeps, h, work)
        settle_air(rows, fixed, h, work)
        slide(rows, fixed, counts, table, hysteresis, elements, 0.0, work)
    report_tile(rows, fixed, period)
    read_sensors(rows, fixed, counts[K.STEP], period)


@routine
def begin_lane(
    rows: Any, fixed: Any, counts: Any, table: Any, gait: Any, hysteresis: int, elements: int,
    j: int, start_phase: float, pressure: float,
) -> None:  # fmt: skip
    """Bring one lane to rest at a pressure [Pa] after inflation from none, at a phase in turns.

    ``counts[MEMBER][j]`` is set before.
    """
    hysteresis_begin(
        rows, fixed, counts, table, elements, hysteresis, K.MODEL, K.STACK_COUNT, K.MEMBER, j
    )
    rows[K.PRESSURE][j] = 0.0
    begin_muscle(rows, fixed, j)
    write_stiffness(rows, fixed, counts, table, hysteresis, j, j + 1, elements)
    rows[K.START_PHASE][j] = start_phase
    start_friction(rows, fixed, counts, table, gait, hysteresis, elements, j)
    rows[K.PRESSURE][j] = pressure
    begin_muscle(rows, fixed, j)
    write_stiffness(rows, fixed, counts, table, hysteresis, j, j + 1, elements)
    settle(rows, fixed, j)
    rows[K.SET_POINT][j] = rows[K.OLD_SET_POINT][j] = rows[K.OLD_PRESSURE][j] = pressure
    rest(rows, fixed, counts, table, gait, hysteresis, elements, j)
    settle_friction(rows, fixed, counts, table, hysteresis, elements, j)
    report(rows, fixed, j, 0.0)
    begin_enclosed(rows, fixed, j)
    begin_sensors(rows, fixed, j)
    rows[K.OLD_AIR][j] = rows[K.AIR][j]


REGULATORS: dict[str, dict[str, Any]] = {
    "lag": {"regulate": lag, "settle": settle_lag},
    "measured": {"regulate": measured, "settle": settle_measured},
}


def replacements(
    kind: str, mounting: str, dynamics: str, effects: int | None = None
) -> dict[str, Any]:
    """Return the kernels of a variant; ``effects``: first row of their state, None if plain."""
    kernels = hysteresis_kernels(kind) | MOTIONS[mounting] | REGULATORS[dynamics]
    if effects is None:
        return kernels
    return kernels | muscle_kernels(dynamics, kernels["regulate"], effects)
