"""One control period of the elbow orthosis, for one environment or a tile of them.

    setpoints or pulses -> air -> bundles on their pulley -> forearm of a wearer

A sub-step is exact for the torque linearised about the predicted middle, with pressures and the
wearer's drive going straight from their old to their new values: of second order, and without a
stability limit. The hysteresis passes through the middles of the sub-steps, where it is evaluated,
and the angle at the end of a period.
"""

from typing import Any

from pam_envs.hysteresis import protocol
from pam_envs.hysteresis.slip import LIMIT, STATE_ROWS
from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.mechanics.guide import turn
from pam_envs.mechanics.pulley import stop_torque
from pam_envs.muscle.effects import yield_spring
from pam_envs.plants.core.muscle_path import DELAYED, begin_delay
from pam_envs.plants.core.sensors import begin_sensors, read_sensors
from pam_envs.plants.elbow_orthosis import rows as K
from pam_envs.plants.elbow_orthosis.bundles import (
    AIR,
    DRIVE_WAS,
    GIVES_A,
    MIDDLE,
    NOW_A,
    WAS_A,
    air_at,
    contraction_at,
    factors_of,
    friction_of,
    shape_of,
    travel_at,
    weight_of,
)
from pam_envs.plants.elbow_orthosis.effects import bundle_kernels, spring_at_pressure
from pam_envs.plants.elbow_orthosis.hysteresis import REFERENCE_PRESSURE

SOFTEST = 0.1
"""Least stiffness [N m/rad] that a sub-step reckons with."""

# placeholders, filled in for each hysteresis and each kind of valves
hysteresis_lag: Any = None
begin_period: Any = None
exchange_air: Any = None
settle: Any = None
start_air: Any = None
pulled: Any = None
set_limits: Any = None
MODEL_STATE, OPERATORS = 0, 1
EFFECTIVE, SENSED_ANGLE, SENSED_PRESSURE = K.PRESSURE_A, K.ANGLE, K.PRESSURE_A
"""Rows of effective pressures and readings; those of the extended plant replace them."""


@kernel
def begin_muscles(rows: Any, fixed: Any, j: int) -> None:
    """Begin the effects of the bundles: a plain plant has none."""


@kernel
def begin_enclosed(rows: Any, fixed: Any, j: int) -> None:
    """Begin the enclosed air of the bundles: a plain plant has regulators, or counts its air."""


@kernel
def begin_yield(rows: Any, j: int) -> None:
    """Begin the yielding friction of the bundles of one lane: a plain plant has none."""


@kernel
def move_yield(rows: Any, fixed: Any, first: int, last: int) -> None:
    """Move the yielding friction of the bundles to their travels: a plain plant has none."""


@kernel
def rub_of(rows: Any, fixed: Any, j: int, side: int, pressure: float) -> float:
    """Return the yielding friction [N] against the contraction of a bundle at a pressure [Pa]."""
    return 0.0


@kernel
def stick_of(rows: Any, j: int, side: int) -> float:
    """Return the derivative [N/m] of :func:`rub_of` by contraction."""
    return 0.0


@kernel
def correct_motion(rows: Any, fixed: Any, work: Any) -> None:
    """Write the correction of the law in a sub-step of a tile: a plain plant has none."""


@kernel
def correct_report(rows: Any, fixed: Any) -> None:
    """Write the correction of the law at the angles of a tile: a plain plant has none."""


@kernel
def correct_at(rows: Any, fixed: Any, j: int, angle: float) -> None:
    """Write the correction of the law at an angle [rad] of one lane: a plain plant has none."""


@kernel
def more_of(rows: Any, j: int, side: int) -> tuple[float, float, float]:
    """Return the forces [N] of the law's correction of a bundle before and after a sub-step.

    Then their derivative by contraction [N/m].
    """
    return 0.0, 0.0, 0.0


@kernel
def drag_of(fixed: Any, j: int, side: int, speed: float, pressure: float, force: float) -> float:
    """Return the damping [N s/m] of a bundle by viscosity: a plain plant has none."""
    return 0.0


@kernel
def lag_of(rows: Any, j: int, side: int) -> float:
    """Return the hysteresis lag [m] of the travel that a bundle has."""
    return rows[K.LAG_A + side * (OPERATORS - 1)][j]  # type: ignore[no-any-return]


@kernel
def pulled_by_length(
    fixed: Any, j: int, side: int, angle: float, lag: float, rub: float, pressure: float
) -> tuple[float, float, float]:
    """Return :func:`pulled` with friction of constant stiffness, whose limit has the pressure."""
    shape, slope = shape_of(fixed, j, side, contraction_at(fixed, j, side, angle))
    passive, pressed = factors_of(fixed, j, side)
    factor = passive + pressed * pressure
    stiff = passive + pressed * REFERENCE_PRESSURE
    force = factor * shape - stiff * friction_of(fixed, j, side, lag) - rub
    tight = 1.0 if force > 0.0 else 0.0
    return tight * force, tight * factor * slope, tight * pressed * shape


@kernel
def leave_limits(rows: Any, fixed: Any, hysteresis: int, first: int, last: int) -> None:
    """Do nothing: the friction's stiffness depends on pressure, its limits do not."""


@kernel
def write_limits(rows: Any, fixed: Any, hysteresis: int, first: int, last: int) -> None:
    """Write the limits of the friction of both bundles, in proportion to their stiffness."""
    for side in range(2):
        limit, pressure = rows[hysteresis + side * STATE_ROWS + LIMIT], rows[EFFECTIVE + side]
        for j in range(first, last):
            passive, pressed = factors_of(fixed, j, side)
            limit[j] = (passive + pressed * pressure[j]) / (passive + pressed * REFERENCE_PRESSURE)


@kernel
def slide(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, first: int,
    last: int,
) -> None:  # fmt: skip
    """Move the hysteresis of some lanes to their travels and write the lags."""
    set_limits(rows, fixed, hysteresis, first, last)
    for j in range(first, last):
        rows[K.AT_A + 1][j] = rows[K.AT_A][j]
    hysteresis_lag(
        rows, fixed, counts, table, hysteresis, elements, K.AT_A, K.LAG_A, OPERATORS, K.MODEL,
        K.STACK_COUNT, K.MEMBER, first, last,
    )  # fmt: skip
    move_yield(rows, fixed, first, last)


@kernel
def pulled_at_pressure(
    fixed: Any, j: int, side: int, angle: float, lag: float, rub: float, pressure: float
) -> tuple[float, float, float]:
    """Return the force of a bundle [N], and its growth with contraction [N/m] and pressure [m2].

    ``rub`` is the yielding friction [N], less the correction of the law. The growth with
    contraction is that of the law without either, at a held pressure; all are 0 for a slack bundle.
    """
    shape, slope = shape_of(fixed, j, side, contraction_at(fixed, j, side, angle))
    passive, pressed = factors_of(fixed, j, side)
    factor = passive + pressed * pressure
    felt = shape - friction_of(fixed, j, side, lag)
    force = factor * felt - rub
    tight = 1.0 if force > 0.0 else 0.0
    return tight * force, tight * factor * slope, tight * pressed * felt


@kernel
def passive_torque(fixed: Any, j: int, angle: float) -> tuple[float, float]:
    """Return the torque [N m] of weights and stops and minus its slope [N m/rad]."""
    moment = fixed[K.LINK_MASS][j] * fixed[K.LINK_CENTRE][j]
    moment = moment + fixed[K.WEARER_MASS][j] * fixed[K.WEARER_CENTRE][j]
    weight = moment * fixed[K.LINK_GRAVITY][j]
    stop, stiffness = stop_torque(
        angle,
        fixed[K.PULLEY_LOWEST][j],
        fixed[K.PULLEY_HIGHEST][j],
        fixed[K.PULLEY_STOP_STIFFNESS][j],
    )
    sine, cosine = sine_and_cosine(angle)
    return stop - weight * sine, weight * cosine + stiffness


@kernel
def drive_of(rows: Any, fixed: Any, j: int) -> float:
    """Return the torque [N m] with which the wearer's intended motion drives his forearm."""
    angle = rows[K.INTENT][j]
    weight = fixed[K.WEARER_MASS][j] * fixed[K.WEARER_CENTRE][j] * fixed[K.LINK_GRAVITY][j]
    sine, _ = sine_and_cosine(angle)
    carried = weight * sine + fixed[K.WEARER_INERTIA][j] * rows[K.INTENT_ACCELERATION][j]
    held = (
        fixed[K.WEARER_STIFFNESS][j] * angle + fixed[K.WEARER_DAMPING][j] * rows[K.INTENT_RATE][j]
    )
    return carried + held


@kernel
def middle_torque(rows: Any, fixed: Any, j: int, work: Any) -> tuple[float, float, float, float]:
    """Return the torque [N m] at the middle before and after, without viscosity.

    Then minus its slope [N m/rad], and the damping by viscosity [N m s/rad].
    """
    angle, radius = work[MIDDLE][j], fixed[K.PULLEY_RADIUS][j]
    old, slope = passive_torque(fixed, j, angle)
    new, viscous = old, 0.0
    for side in range(2):
        sign, lag = 2.0 * side - 1.0, lag_of(rows, j, side)
        before, after = work[WAS_A + side][j], work[NOW_A + side][j]
        rub, rubs = rub_of(rows, fixed, j, side, before), rub_of(rows, fixed, j, side, after)
        more, next_more, steeper = more_of(rows, j, side)
        was, soft, _ = pulled(fixed, j, side, angle, lag, rub - more, before)
        now, hard, swell = pulled(fixed, j, side, angle, lag, rubs - next_more, after)
        old, new = old + sign * radius * was, new + sign * radius * now
        growth = 0.5 * (soft + hard) - swell * work[GIVES_A + side][j] - stick_of(rows, j, side)
        force, speed = 0.5 * (was + now), sign * radius * rows[K.VELOCITY][j]
        growth = growth + (steeper if force > 0.0 else 0.0)
        slope = slope - radius * radius * growth
        drag = drag_of(fixed, j, side, speed, 0.5 * (before + after), force)
        viscous = viscous + radius * radius * drag
    return old, new, slope, viscous


@kernel
def swing(rows: Any, fixed: Any, i: int, substeps: int, h: float, work: Any) -> None:
    """Move the forearms of a tile through sub-step ``i``."""
    angle, velocity, share = rows[K.ANGLE], rows[K.VELOCITY], 1.0 / substeps
    for j in range(LANES):
        old, new, slope, viscous = middle_torque(rows, fixed, j, work)
        climb = (rows[K.DRIVE][j] - work[DRIVE_WAS][j]) * share
        driven = work[DRIVE_WAS][j] + i * climb + rows[K.DISTURBANCE][j]
        ahead, hold = 0.5 * h * velocity[j], fixed[K.WEARER_STIFFNESS][j]
        stiffness = max(SOFTEST, slope + hold)
        total = old + driven - hold * work[MIDDLE][j] + stiffness * ahead
        per_inertia = 1.0 / (fixed[K.LINK_INERTIA][j] + fixed[K.WEARER_INERTIA][j])
        drag = fixed[K.LINK_DAMPING][j] + fixed[K.WEARER_DAMPING][j] + viscous
        drag = drag * per_inertia
        du, velocity[j] = turn(
            rows, fixed, j, velocity[j], total * per_inertia, (new - old + climb) * per_inertia / h,
            stiffness * per_inertia, drag, per_inertia, h,
        )  # fmt: skip
        angle[j] = angle[j] + du


@kernel
def advance(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, substeps: int,
    period: float, work: Any,
) -> None:  # fmt: skip
    """Advance a tile by one control period, towards its setpoints [Pa] or pulses.

    The caller writes these, intent and disturbance. ``hysteresis`` is the first row of the
    hysteresis state; ``work`` are ``N_WORK`` rows of scratch.
    """
    h = period / substeps
    for j in range(LANES):
        begin_period(rows, fixed, j, period)
        work[DRIVE_WAS][j] = rows[K.DRIVE][j]
        rows[K.DRIVE][j] = drive_of(rows, fixed, j)
    for i in range(substeps):
        for j in range(LANES):
            work[MIDDLE][j] = rows[K.ANGLE][j] + 0.5 * h * rows[K.VELOCITY][j]
            rows[K.AT_A][j] = travel_at(fixed, j, work[MIDDLE][j])
        slide(rows, fixed, counts, table, hysteresis, elements, 0, LANES)
        exchange_air(rows, fixed, counts, i, substeps, period, work)
        correct_motion(rows, fixed, work)
        swing(rows, fixed, i, substeps, h, work)
        settle(rows, fixed, h, work)
    for j in range(LANES):
        rows[K.AT_A][j] = travel_at(fixed, j, rows[K.ANGLE][j])
    slide(rows, fixed, counts, table, hysteresis, elements, 0, LANES)
    correct_report(rows, fixed)
    for j in range(LANES):
        report(rows, fixed, j)
    read_sensors(rows, fixed, counts[K.STEP], period)


@kernel
def report(rows: Any, fixed: Any, j: int) -> None:
    """Write the signals of one lane."""
    angle, velocity, radius = rows[K.ANGLE][j], rows[K.VELOCITY][j], fixed[K.PULLEY_RADIUS][j]
    torque, stiffness, slack = 0.0, 0.0, 0.0
    for side in range(2):
        effective = rows[EFFECTIVE + side][j]
        lag, rub = lag_of(rows, j, side), rub_of(rows, fixed, j, side, effective)
        more, _, steeper = more_of(rows, j, side)
        force, growth, _ = pulled(fixed, j, side, angle, lag, rub - more, effective)
        growth = growth + (steeper if force > 0.0 else 0.0)
        speed = (2.0 * side - 1.0) * radius * velocity
        drag = drag_of(fixed, j, side, speed, effective, force)
        force = max(0.0, force - drag * speed) if drag > 0.0 else force
        rows[K.CONTRACTION_A + side][j] = contraction_at(fixed, j, side, angle)
        rows[K.FORCE_A + side][j] = force
        torque = torque + (2.0 * side - 1.0) * radius * force
        stiffness = stiffness - radius * radius * growth
        slack = slack + (0.0 if force > 0.0 else 1.0)
    rows[K.TORQUE][j], rows[K.STIFFNESS][j], rows[K.SLACK][j] = torque, stiffness, slack
    held = fixed[K.WEARER_STIFFNESS][j] * (rows[K.INTENT][j] - angle)
    held = held + fixed[K.WEARER_DAMPING][j] * (rows[K.INTENT_RATE][j] - velocity)
    rows[K.WEARER][j] = held
    rows[K.FELT][j] = felt_torque(rows, fixed, j, torque)


@kernel
def felt_torque(rows: Any, fixed: Any, j: int, torque: float) -> float:
    """Return the part of the bundles' torque [N m] that reaches the wearer.

    The rest supports the orthosis itself and moves it against its inertia and friction.
    """
    angle, velocity = rows[K.ANGLE][j], rows[K.VELOCITY][j]
    passive, _ = passive_torque(fixed, j, angle)
    held = fixed[K.WEARER_STIFFNESS][j] * angle + fixed[K.WEARER_DAMPING][j] * velocity
    drag = fixed[K.LINK_DAMPING][j] * velocity
    total = torque + passive + rows[K.DRIVE][j] + rows[K.DISTURBANCE][j] - held - drag
    inertia = fixed[K.LINK_INERTIA][j]
    bent = total / (inertia + fixed[K.WEARER_INERTIA][j])
    stop, _ = stop_torque(
        angle,
        fixed[K.PULLEY_LOWEST][j],
        fixed[K.PULLEY_HIGHEST][j],
        fixed[K.PULLEY_STOP_STIFFNESS][j],
    )
    return torque + stop - weight_of(fixed, j, angle) - drag - inertia * bent


@kernel
def start_hysteresis(rows: Any, counts: Any, hysteresis: int, j: int) -> None:
    """Put the hysteresis of one lane into its virgin state."""
    for k in range(OPERATORS * MODEL_STATE):
        rows[hysteresis + k][j] = 0.0
    counts[K.STACK_COUNT][j] = counts[K.STACK_COUNT + 1][j] = 1


@kernel
def resting_torque(rows: Any, fixed: Any, j: int, angle: float) -> float:
    """Return the torque at rest [N m] at an angle, with the hysteresis lag of that angle."""
    torque, _ = passive_torque(fixed, j, angle)
    correct_at(rows, fixed, j, angle)
    for side in range(2):
        effective = rows[EFFECTIVE + side][j]
        lag, rub = lag_of(rows, j, side), rub_of(rows, fixed, j, side, effective)
        more, _, _ = more_of(rows, j, side)
        force, _, _ = pulled(fixed, j, side, angle, lag, rub - more, effective)
        torque = torque + (2.0 * side - 1.0) * fixed[K.PULLEY_RADIUS][j] * force
    return torque + rows[K.DRIVE][j] + rows[K.DISTURBANCE][j] - fixed[K.WEARER_STIFFNESS][j] * angle


@routine
def begin_lane(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int,
    pressure_a: float, pressure_b: float,
) -> None:  # fmt: skip
    """Bring one lane to rest at two pressures [Pa], held by a wearer who intends an angle.

    The hysteresis is virgin at the middle of the range and comes from there; intent, disturbance
    and member are set before.
    """
    rows[K.PRESSURE_A][j], rows[K.PRESSURE_A + 1][j] = pressure_a, pressure_b
    begin_muscles(rows, fixed, j)
    rows[K.INTENT_RATE][j] = rows[K.INTENT_ACCELERATION][j] = 0.0
    rows[K.VELOCITY][j] = rows[K.LAG_A][j] = rows[K.USED][j] = 0.0
    rows[K.DRIVE][j] = drive_of(rows, fixed, j)
    low, high = fixed[K.PULLEY_LOWEST][j] - 0.5, fixed[K.PULLEY_HIGHEST][j] + 0.5
    for _ in range(54):
        angle = 0.5 * (low + high)
        start_hysteresis(rows, counts, hysteresis, j)
        begin_yield(rows, j)
        rows[K.AT_A][j] = travel_at(fixed, j, angle)
        slide(rows, fixed, counts, table, hysteresis, elements, j, j + 1)
        if resting_torque(rows, fixed, j, angle) > 0.0:
            low = angle
        else:
            high = angle
    rows[K.ANGLE][j] = angle
    start_air(rows, fixed, j)
    for side in range(2):
        rows[K.AIR_A + side][j] = air_at(rows, fixed, j, side)
    begin_enclosed(rows, fixed, j)
    report(rows, fixed, j)
    begin_sensors(rows, fixed, j)


@kernel
def start_regulated(rows: Any, fixed: Any, j: int) -> None:
    """Let the setpoints of one lane be its pressures."""
    rows[K.COMMAND_A][j], rows[K.COMMAND_A + 1][j] = (
        rows[K.PRESSURE_A][j],
        rows[K.PRESSURE_A + 1][j],
    )
    for side in range(2):
        begin_delay(rows, j, K.DELAY + side * DELAYED.end, rows[K.PRESSURE_A + side][j])


@kernel
def start_pulsed(rows: Any, fixed: Any, j: int) -> None:
    """Close the valves of one lane at the start of a cycle."""
    rows[K.COMMAND_A][j] = rows[K.COMMAND_A + 1][j] = 0.0
    rows[K.CLOCK][j] = rows[K.SWITCHES][j] = 0.0
    for k in range(3 * K.VALVES):
        rows[K.LEFT + k][j] = 0.0


def operators(kind: str) -> int:
    """Return the number of hysteresis operators of a kind: one a bundle if driven by length."""
    return 2 if protocol.model_of(kind).drive == "length" else 1


STARTS = {"proportional": start_regulated, "on_off": start_pulsed}


def replacements(kind: str, valves: str, effects: int | None = None) -> dict[str, Any]:
    """Return the kernels of a variant; ``effects``: first row of their state, None if plain."""
    kernels = protocol.kernels(kind) | {"start_air": STARTS[valves], "OPERATORS": operators(kind)}
    if operators(kind) == 2:
        kernels |= {"pulled": pulled_by_length, "set_limits": write_limits}
        kernels |= {"spring_of": yield_spring}
    else:
        kernels |= {"pulled": pulled_at_pressure, "set_limits": leave_limits}
        kernels |= {"spring_of": spring_at_pressure}
    extended = {} if effects is None else bundle_kernels(valves, effects)
    return kernels | AIR[valves] | extended
