"""One control period of the elbow orthosis, for one environment or a tile of them.

    set-points or pulses -> air -> bundles on their pulley -> forearm of a wearer

A sub-step is exact for the torque linearised about the predicted middle, with pressures and the
wearer's drive going straight from their old to their new values: of second order, and without a
stability limit. The hysteresis is led over the middles of the sub-steps, where it is asked, and to
the angle that a period ends with. Between periods the wearer's drive goes straight.
"""

from __future__ import annotations

from typing import Any

from pam_envs.hysteresis import protocol
from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.mechanics.guide import turn
from pam_envs.mechanics.pulley import stop_torque
from pam_envs.plants.core.sensors import read_sensors
from pam_envs.plants.elbow_orthosis import rows as K
from pam_envs.plants.elbow_orthosis.air import (
    AIR,
    DRIVE_WAS,
    GIVES_A,
    MIDDLE,
    N_WORK,
    NOW_A,
    WAS_A,
    air_at,
)
from pam_envs.plants.elbow_orthosis.bundles import (
    contraction_at,
    factors_of,
    friction_of,
    shape_of,
    travel_at,
    weight_of,
)
from pam_envs.plants.elbow_orthosis.effects import effect_kernels
from pam_envs.plants.elbow_orthosis.rows import (
    AIR_A,
    ANGLE,
    AT,
    COMMAND_A,
    DISTURBANCE,
    DRIVE,
    GRAVITY,
    HIGHEST,
    INTENT,
    INTENT_ACCELERATION,
    INTENT_RATE,
    LAG,
    LINK_CENTRE,
    LINK_DAMPING,
    LINK_INERTIA,
    LINK_MASS,
    LOWEST,
    MEMBER,
    MODEL,
    PRESSURE_A,
    RADIUS,
    STACK_COUNT,
    STOP_STIFFNESS,
    VELOCITY,
    WEARER_CENTRE,
    WEARER_DAMPING,
    WEARER_INERTIA,
    WEARER_MASS,
    WEARER_STIFFNESS,
)

__all__ = [
    "N_WORK",
    "advance",
    "begin_lane",
    "replacements",
    "start_hysteresis",
    "weight_of",
]

SOFTEST = 0.1
"""Least stiffness [N m/rad] that a sub-step reckons with."""

# placeholders, filled in for each hysteresis and each make of valves
hysteresis_lag: Any = None
begin_period: Any = None
breathe: Any = None
settle: Any = None
start_air: Any = None
MODEL_STATE = 0
EFFECTIVE_A, SENSED_ANGLE, SENSED_PRESSURE = PRESSURE_A, ANGLE, PRESSURE_A
"""Rows of effective pressures and readings; those of the extended plant replace them."""


@kernel
def begin_muscles(rows: Any, fixed: Any, j: int) -> None:
    """Begin the effects of the bundles: a plain plant has none."""


@kernel
def pulled(
    fixed: Any, j: int, side: int, angle: float, lag: float, pressure: float
) -> tuple[float, float, float]:
    """Return the force of a bundle [N], and its growth with contraction [N/m] and pressure [m2].

    The growth with contraction is the law's, at a held pressure; a slack bundle has none of all.
    """
    shape, slope = shape_of(fixed, j, side, contraction_at(fixed, j, side, angle))
    passive, pressed = factors_of(fixed, j, side)
    factor = passive + pressed * pressure
    felt = shape - friction_of(fixed, j, side, lag)
    tight = 1.0 if factor * felt > 0.0 else 0.0
    return tight * factor * felt, tight * factor * slope, tight * pressed * felt


@kernel
def passive_torque(fixed: Any, j: int, angle: float) -> tuple[float, float]:
    """Return the torque [N m] of weights and stops and minus its slope [N m/rad]."""
    moment = fixed[LINK_MASS][j] * fixed[LINK_CENTRE][j]
    moment = moment + fixed[WEARER_MASS][j] * fixed[WEARER_CENTRE][j]
    weight = moment * fixed[GRAVITY][j]
    stop, stiffness = stop_torque(
        angle, fixed[LOWEST][j], fixed[HIGHEST][j], fixed[STOP_STIFFNESS][j]
    )
    sine, cosine = sine_and_cosine(angle)
    return stop - weight * sine, weight * cosine + stiffness


@kernel
def drive_of(rows: Any, fixed: Any, j: int) -> float:
    """Return the torque [N m] with which the wearer's intended motion drives his forearm."""
    angle = rows[INTENT][j]
    weight = fixed[WEARER_MASS][j] * fixed[WEARER_CENTRE][j] * fixed[GRAVITY][j]
    sine, _ = sine_and_cosine(angle)
    carried = weight * sine + fixed[WEARER_INERTIA][j] * rows[INTENT_ACCELERATION][j]
    held = fixed[WEARER_STIFFNESS][j] * angle + fixed[WEARER_DAMPING][j] * rows[INTENT_RATE][j]
    return carried + held


@kernel
def middle_torque(rows: Any, fixed: Any, j: int, work: Any) -> tuple[float, float, float]:
    """Return the torque [N m] at the middle before and after, and minus its slope [N m/rad]."""
    angle, lag, radius = work[MIDDLE][j], rows[LAG][j], fixed[RADIUS][j]
    old, slope = passive_torque(fixed, j, angle)
    new = old
    for side in range(2):
        sign = 2.0 * side - 1.0
        was, soft, _ = pulled(fixed, j, side, angle, lag, work[WAS_A + side][j])
        now, hard, swell = pulled(fixed, j, side, angle, lag, work[NOW_A + side][j])
        old, new = old + sign * radius * was, new + sign * radius * now
        growth = 0.5 * (soft + hard) - swell * work[GIVES_A + side][j]
        slope = slope - radius * radius * growth
    return old, new, slope


@kernel
def swing(rows: Any, fixed: Any, i: int, substeps: int, h: float, work: Any) -> None:
    """Move the forearms of a tile through sub-step ``i``."""
    angle, velocity, share = rows[ANGLE], rows[VELOCITY], 1.0 / substeps
    for j in range(LANES):
        old, new, slope = middle_torque(rows, fixed, j, work)
        climb = (rows[DRIVE][j] - work[DRIVE_WAS][j]) * share
        driven = work[DRIVE_WAS][j] + i * climb + rows[DISTURBANCE][j]
        ahead, hold = 0.5 * h * velocity[j], fixed[WEARER_STIFFNESS][j]
        stiffness = max(SOFTEST, slope + hold)
        total = old + driven - hold * work[MIDDLE][j] + stiffness * ahead
        per_inertia = 1.0 / (fixed[LINK_INERTIA][j] + fixed[WEARER_INERTIA][j])
        drag = (fixed[LINK_DAMPING][j] + fixed[WEARER_DAMPING][j]) * per_inertia
        du, velocity[j] = turn(
            rows, fixed, j, velocity[j], total * per_inertia,
            (new - old + climb) * per_inertia / h, stiffness * per_inertia, drag, per_inertia, h,
        )  # fmt: skip
        angle[j] = angle[j] + du


@kernel
def advance(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, substeps: int,
    period: float, work: Any,
) -> None:  # fmt: skip
    """Advance a tile by one control period, towards its set-points or by its pulses.

    Parameters
    ----------
    rows, fixed, counts : rows
        State, parameters and whole numbers (``elbow_orthosis_rows``). ``COMMAND_A``, ``_B``
        (set-points [Pa]; pulse widths [s], filling above 0), the intended motion at the end of the
        period, ``INTENT`` [rad], ``INTENT_RATE``, ``INTENT_ACCELERATION``, and ``DISTURBANCE``
        [N m] are the caller's to write.
    table : array
        Of the hysteresis: ``ElbowOrthosis.hysteresis_tables()``.
    hysteresis, elements : int
        First row of the hysteresis state, and ``ElbowOrthosis.elements``.
    substeps, period : int, float
        Sub-steps and duration [s] of the period.
    work : rows
        ``N_WORK`` rows of scratch.
    """
    h = period / substeps
    for j in range(LANES):
        begin_period(rows, fixed, j, period)
        work[DRIVE_WAS][j] = rows[DRIVE][j]
        rows[DRIVE][j] = drive_of(rows, fixed, j)
    for i in range(substeps):
        for j in range(LANES):
            work[MIDDLE][j] = rows[ANGLE][j] + 0.5 * h * rows[VELOCITY][j]
            rows[AT][j] = travel_at(fixed, j, work[MIDDLE][j])
        hysteresis_lag(
            rows, fixed, counts, table, hysteresis, elements, AT, LAG, 1, MODEL, STACK_COUNT,
            MEMBER,
            0, LANES,
        )  # fmt: skip
        breathe(rows, fixed, counts, i, substeps, period, work)
        swing(rows, fixed, i, substeps, h, work)
        settle(rows, fixed, work)
    for j in range(LANES):
        rows[AT][j] = travel_at(fixed, j, rows[ANGLE][j])
    hysteresis_lag(
        rows, fixed, counts, table, hysteresis, elements, AT, LAG, 1, MODEL, STACK_COUNT, MEMBER,
        0, LANES,
    )  # fmt: skip
    for j in range(LANES):
        report(rows, fixed, j)
        read_sensors(rows, fixed, j, counts[K.STEP][j] + 1, period)


@kernel
def report(rows: Any, fixed: Any, j: int) -> None:
    """Write what can be seen of one lane."""
    angle, velocity, radius = rows[ANGLE][j], rows[VELOCITY][j], fixed[RADIUS][j]
    torque, stiffness, slack = 0.0, 0.0, 0.0
    for side in range(2):
        effective = rows[EFFECTIVE_A + side][j]
        force, growth, _ = pulled(fixed, j, side, angle, rows[LAG][j], effective)
        rows[K.CONTRACTION_A + side][j] = contraction_at(fixed, j, side, angle)
        rows[K.FORCE_A + side][j] = force
        torque = torque + (2.0 * side - 1.0) * radius * force
        stiffness = stiffness - radius * radius * growth
        slack = slack + (0.0 if force > 0.0 else 1.0)
    rows[K.TORQUE][j], rows[K.STIFFNESS][j], rows[K.SLACK][j] = torque, stiffness, slack
    held = fixed[WEARER_STIFFNESS][j] * (rows[INTENT][j] - angle)
    held = held + fixed[WEARER_DAMPING][j] * (rows[INTENT_RATE][j] - velocity)
    rows[K.WEARER][j] = held
    rows[K.FELT][j] = felt_torque(rows, fixed, j, torque)


@kernel
def felt_torque(rows: Any, fixed: Any, j: int, torque: float) -> float:
    """Return what reaches the wearer [N m] of the bundles' torque.

    The rest bears the orthosis itself and moves it, against its inertia and friction.
    """
    angle, velocity = rows[ANGLE][j], rows[VELOCITY][j]
    passive, _ = passive_torque(fixed, j, angle)
    held = fixed[WEARER_STIFFNESS][j] * angle + fixed[WEARER_DAMPING][j] * velocity
    drag = fixed[LINK_DAMPING][j] * velocity
    total = torque + passive + rows[DRIVE][j] + rows[DISTURBANCE][j] - held - drag
    inertia = fixed[LINK_INERTIA][j]
    bent = total / (inertia + fixed[WEARER_INERTIA][j])
    stop, _ = stop_torque(angle, fixed[LOWEST][j], fixed[HIGHEST][j], fixed[STOP_STIFFNESS][j])
    return torque + stop - weight_of(fixed, j, angle) - drag - inertia * bent


@kernel
def start_hysteresis(rows: Any, counts: Any, hysteresis: int, j: int) -> None:
    """Put the hysteresis of one lane into its virgin state."""
    for k in range(MODEL_STATE):
        rows[hysteresis + k][j] = 0.0
    counts[STACK_COUNT][j] = 1


@kernel
def resting_torque(rows: Any, fixed: Any, j: int, angle: float) -> float:
    """Return the torque at rest [N m] at an angle, with the hysteresis lag of that angle."""
    torque, _ = passive_torque(fixed, j, angle)
    for side in range(2):
        effective = rows[EFFECTIVE_A + side][j]
        force, _, _ = pulled(fixed, j, side, angle, rows[LAG][j], effective)
        torque = torque + (2.0 * side - 1.0) * fixed[RADIUS][j] * force
    return torque + rows[DRIVE][j] + rows[DISTURBANCE][j] - fixed[WEARER_STIFFNESS][j] * angle


@routine
def begin_lane(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int,
    pressure_a: float, pressure_b: float,
) -> None:  # fmt: skip
    """Bring one lane to rest at two pressures [Pa], held by a wearer who intends an angle.

    The hysteresis is virgin at the middle of the range and comes from there. ``INTENT``,
    ``DISTURBANCE`` and ``counts[MEMBER]`` are set before.
    """
    rows[PRESSURE_A][j], rows[PRESSURE_A + 1][j] = pressure_a, pressure_b
    begin_muscles(rows, fixed, j)
    rows[INTENT_RATE][j] = rows[INTENT_ACCELERATION][j] = 0.0
    rows[VELOCITY][j] = rows[LAG][j] = rows[K.USED][j] = 0.0
    rows[DRIVE][j] = drive_of(rows, fixed, j)
    low, high = fixed[LOWEST][j] - 0.5, fixed[HIGHEST][j] + 0.5
    for _ in range(54):
        angle = 0.5 * (low + high)
        start_hysteresis(rows, counts, hysteresis, j)
        rows[AT][j] = travel_at(fixed, j, angle)
        hysteresis_lag(
            rows, fixed, counts, table, hysteresis, elements, AT, LAG, 1, MODEL, STACK_COUNT,
            MEMBER,
            j, j + 1,
        )  # fmt: skip
        if resting_torque(rows, fixed, j, angle) > 0.0:
            low = angle
        else:
            high = angle
    rows[ANGLE][j] = angle
    start_air(rows, fixed, j)
    for side in range(2):
        rows[AIR_A + side][j] = air_at(rows, fixed, j, side)
    report(rows, fixed, j)
    read_sensors(rows, fixed, j, 0, 0.0)


@kernel
def start_regulated(rows: Any, fixed: Any, j: int) -> None:
    """Let the set-points of one lane be its pressures."""
    rows[COMMAND_A][j], rows[COMMAND_A + 1][j] = rows[PRESSURE_A][j], rows[PRESSURE_A + 1][j]


@kernel
def start_pulsed(rows: Any, fixed: Any, j: int) -> None:
    """Close the valves of one lane at the start of a cycle."""
    rows[COMMAND_A][j] = rows[COMMAND_A + 1][j] = 0.0
    rows[K.CLOCK][j] = rows[K.SWITCHES][j] = 0.0
    for k in range(3 * K.VALVES):
        rows[K.LEFT + k][j] = 0.0


STARTS = {"proportional": start_regulated, "on_off": start_pulsed}


def replacements(kind: str, valves: str, effects: int | None = None) -> dict[str, Any]:
    """Return the kernels that a plant of this make puts in the place of the placeholders.

    ``effects`` is the first row of the state of the effects; None for a plain plant.
    """
    kernels = protocol.kernels(kind) | {"start_air": STARTS[valves]}
    extended = {} if effects is None else effect_kernels(valves, effects)
    return kernels | AIR[valves] | extended
