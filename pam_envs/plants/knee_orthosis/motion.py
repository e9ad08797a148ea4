"""Motion of the brace: held in a rig, free without a leg, or carried along by a walking leg.

Of the leg: the wearer's stride at one phase, with path, ground force, demand on the knee, muscles.

Each motion is four functions: ``begin_period`` reads the gait, ``move`` advances a tile by one
sub-step, ``rest`` puts a lane at rest, ``report`` writes signals at the end of the period. A
sub-step is exact for the torque linearised about the predicted middle, with the stiffness of the
muscle and the wearer's path going straight from their old to their new values: second order, and
no stability limit from a stiff spring.
"""

from typing import Any

from pam_envs.constants import ATMOSPHERE, DENSITY_PER_PRESSURE, GRAVITY
from pam_envs.hysteresis.slip import LIMIT
from pam_envs.kernels.arithmetic import count_on, decay, sine_and_cosine
from pam_envs.kernels.build import LANES, kernel, routine, scratch
from pam_envs.kernels.motion import damped_motion
from pam_envs.kernels.random import uniform
from pam_envs.mechanics.guide import turn
from pam_envs.mechanics.knee_lever import assistive_torque, muscle_length
from pam_envs.mechanics.leg import (
    centre_of_pressure,
    gravity_stiffness,
    ground_torque,
    knee_acceleration,
    shank_torque,
)
from pam_envs.muscle.emg import activation, excitation, left_of_gap
from pam_envs.muscle.gas_spring import gas_volume, spring_tension, stretch_of
from pam_envs.parameters import named_rows
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.hysteresis import REFERENCE_PRESSURE
from pam_envs.references.gait import (
    ANKLE,
    COP,
    GROUND_X,
    KNEE,
    NATURAL_STRIDE,
    SHANK,
    curve,
    curve_and_rates,
    fraction_of_turn,
    vertical_load,
)
from pam_envs.sensing.shoe import estimated_torque, heel_load


@kernel
def varied(fixed: Any, counts: Any, parameter: int, stream: int, stride: int, j: int) -> float:
    """Return the deviation of one stride, of standard deviation ``fixed[parameter]``."""
    spread = fixed[parameter][j]
    if spread == 0.0:
        return 0.0
    drawn = uniform(counts[K.KEY_A][j], counts[K.KEY_B][j], stream, stride)
    return SPREAD * spread * (2.0 * drawn - 1.0)


@kernel
def turns_at(rows: Any, fixed: Any, j: int, time: float) -> float:
    """Return the number of strides since the phase 0 before the start, at a time [s]."""
    return rows[K.START_PHASE][j] + time / fixed[K.STRIDE_TIME][j]  # type: ignore[no-any-return]


@routine
def draw_stride(rows: Any, fixed: Any, counts: Any, j: int, time: float) -> None:
    """Draw the stride of lane ``j`` at a time [s]: how early it begins and its load."""
    number = int(turns_at(rows, fixed, j, time))
    rows[K.STRIDE_NUMBER][j] = number
    rows[K.EARLY][j] = HALF_ROOT * varied(
        fixed, counts, K.STRIDE_VARIABILITY, STRIDE_STREAM, number, j
    )
    rows[K.NEXT_EARLY][j] = HALF_ROOT * varied(
        fixed, counts, K.STRIDE_VARIABILITY, STRIDE_STREAM, number + 1, j
    )
    rows[K.HEAVY][j] = varied(
        fixed, counts, K.STRIDE_LOAD_VARIABILITY, STRIDE_STREAM + 1, number, j
    )
    rows[K.NEXT_HEAVY][j] = varied(
        fixed, counts, K.STRIDE_LOAD_VARIABILITY, STRIDE_STREAM + 1, number + 1, j
    )


@kernel
def draw_strides(
    rows: Any, fixed: Any, counts: Any, per_period: float, offset: float, h: float
) -> None:
    """Draw the strides that a tile has begun, ``offset`` parts of ``h`` seconds into a period."""
    begun = 0
    for j in range(LANES):
        time = (counts[K.STEP][j] * per_period + offset) * h
        number = int(turns_at(rows, fixed, j, time))
        begun = begun + (0 if rows[K.STRIDE_NUMBER][j] == number else 1)
    for j in range(LANES if begun > 0 else 0):
        time = (counts[K.STEP][j] * per_period + offset) * h
        if rows[K.STRIDE_NUMBER][j] != int(turns_at(rows, fixed, j, time)):
            draw_stride(rows, fixed, counts, j, time)


@kernel
def stride_at(rows: Any, fixed: Any, j: int, time: float) -> tuple[float, float, float, float]:
    """Return the phase, 0 to 1, its rates [1/s, 1/s2] and the factor on the load at a time [s].

    Strides begin early or late by random shares of a stride, and go smoothly from one to the next.
    They are drawn before (:func:`draw_strides`).
    """
    pace = 1.0 / fixed[K.STRIDE_TIME][j]
    turns = turns_at(rows, fixed, j, time)
    number = int(turns)
    early, heavy = rows[K.EARLY][j], rows[K.HEAVY][j]
    gain, growth = rows[K.NEXT_EARLY][j] - early, rows[K.NEXT_HEAVY][j] - heavy
    u = turns - float(number)
    v, area = 1.0 - u, u * (1.0 - u)
    step = u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
    return (
        fraction_of_turn(turns + early + gain * step),
        pace * (1.0 + 30.0 * gain * area * area),
        60.0 * pace * pace * gain * area * (v - u),
        1.0 + heavy + growth * step,
    )


READ = named_rows(
    *("phase", "pace", "hurry", "heavy", "knee", "knee_turn", "knee_bend", "lean", "lean_turn"),
    *("lean_bend", "ankle", "loaded", "leaning", "cop"),
)
"""Rows of what :func:`read_gait` reads."""
N_READ = len(READ)


@kernel
def read_gait(rows: Any, fixed: Any, gait: Any, j: int, time: float, read: Any) -> None:
    """Write phase and curves of one lane's stride at a time [s] to the scratch ``read``."""
    phase, pace, hurry, heavy = stride_at(rows, fixed, j, time)
    read[READ.phase][j], read[READ.pace][j] = phase, pace
    read[READ.hurry][j], read[READ.heavy][j] = hurry, heavy
    knee = curve_and_rates(gait, KNEE, phase)
    read[READ.knee][j], read[READ.knee_turn][j], read[READ.knee_bend][j] = knee
    lean = curve_and_rates(gait, SHANK, phase)
    read[READ.lean][j], read[READ.lean_turn][j], read[READ.lean_bend][j] = lean
    read[READ.ankle][j] = curve(gait, ANKLE, phase)
    read[READ.loaded][j] = vertical_load(gait, phase, NATURAL_STRIDE / fixed[K.STRIDE_TIME][j])
    read[READ.leaning][j], read[READ.cop][j] = curve(gait, GROUND_X, phase), curve(gait, COP, phase)


@kernel
def gait_at(rows: Any, fixed: Any, j: int, read: Any) -> None:
    """Write the stride of one lane from its curves (:class:`READ`): path, ground, demand, hold."""
    phase, pace, hurry = read[READ.phase][j], read[READ.pace][j], read[READ.hurry][j]
    knee, knee_turn, knee_bend = (
        read[READ.knee][j],
        read[READ.knee_turn][j],
        read[READ.knee_bend][j],
    )
    lean, lean_turn, lean_bend = (
        read[READ.lean][j],
        read[READ.lean_turn][j],
        read[READ.lean_bend][j],
    )
    weight = fixed[K.LEG_BODY_MASS][j] * GRAVITY * read[READ.heavy][j]
    quick = NATURAL_STRIDE / fixed[K.STRIDE_TIME][j]
    loaded, leaning = read[READ.loaded][j], read[READ.leaning][j]
    knee_bend = knee_bend * pace * pace + knee_turn * hurry
    lean_bend = lean_bend * pace * pace + lean_turn * hurry
    rows[K.PHASE][j] = phase
    rows[K.KNEE][j] = knee
    rows[K.KNEE_RATE][j] = knee_turn * pace
    rows[K.KNEE_ACCELERATION][j] = knee_bend
    rows[K.SHANK][j] = lean
    rows[K.ANKLE][j] = read[READ.ankle][j]
    rows[K.GROUND_Z][j] = weight * loaded
    rows[K.GROUND_X][j] = weight * leaning * quick * quick
    rows[K.COP][j] = centre_of_pressure(
        read[READ.cop][j],
        leaning,
        loaded,
        quick,
        fixed[K.LEG_AIM_HEIGHT][j],
        fixed[K.SHOE_HEEL][j],
        fixed[K.SHOE_TIP][j],
    )
    ahead, up = knee_acceleration(
        knee - lean,
        (knee_turn - lean_turn) * pace,
        knee_bend - lean_bend,
        fixed[K.LEG_THIGH][j],
    )
    sine, cosine = sine_and_cosine(lean)
    balance(rows, fixed, j, sine, cosine, ahead, up, lean_bend)
    restoring = gravity_stiffness(
        sine, cosine, ahead, up, fixed[K.LEG_MASS][j], fixed[K.LEG_CENTRE][j]
    )
    hold(rows, fixed, j, loaded, restoring)


@kernel
def balance(
    rows: Any, fixed: Any, j: int, sine: float, cosine: float, ahead: float, up: float,
    angular: float,
) -> None:  # fmt: skip
    """Write the load torque of the knee, its estimate by Eq. (1), and the load on the heel."""
    vertical, cop = rows[K.GROUND_Z][j], rows[K.COP][j]
    shank = fixed[K.LEG_SHANK][j]
    ground = ground_torque(
        vertical, rows[K.GROUND_X][j], cop, sine, cosine, shank, fixed[K.LEG_ANKLE_HEIGHT][j]
    )
    rows[K.DEMAND][j] = ground + shank_torque(
        sine, cosine, ahead, up, angular, fixed[K.LEG_MASS][j], fixed[K.LEG_CENTRE][j],
        fixed[K.LEG_INERTIA][j],
    )  # fmt: skip
    flat = fixed[K.SHOE_FLAT_FOOT][j]
    inclination = (1.0 - flat) * rows[K.SHANK][j] + flat * rows[K.ANKLE][j]
    seen, _ = sine_and_cosine(inclination)
    rows[K.ESTIMATE][j] = estimated_torque(vertical, cop, seen, shank)
    heel = heel_load(vertical, cop, fixed[K.SHOE_HEEL][j], fixed[K.SHOE_TIP][j])
    rows[K.HEEL][j] = heel
    rows[K.STANCE][j] = 1.0 if heel > fixed[K.SHOE_THRESHOLD][j] else 0.0


@kernel
def hold(rows: Any, fixed: Any, j: int, loaded: float, restoring: float) -> None:
    """Write stiffness [N m/rad] and damping [N m s/rad] with which the wearer holds his path."""
    passive, free = fixed[K.LEG_STIFFNESS][j], fixed[K.LEG_HOLD_STIFFNESS][j]
    rows[K.HOLD][j] = passive + free + restoring + fixed[K.LEG_STANCE_STIFFNESS][j] * loaded
    passive, free = fixed[K.LEG_DAMPING][j], fixed[K.LEG_HOLD_DAMPING][j]
    rows[K.HOLD_RATE][j] = passive + free + fixed[K.LEG_STANCE_DAMPING][j] * loaded


@kernel
def excite(fixed: Any, j: int, torque: float) -> float:
    """Return the excitation of muscles that bear a torque [N m]."""
    return excitation(torque, fixed[K.ACTIVATION_LARGEST_TORQUE][j], fixed[K.ACTIVATION_FLOOR][j])


@kernel
def start_muscles(rows: Any, fixed: Any, j: int) -> None:
    """Set the activity of the wearer's muscles to that without the orthosis."""
    demand = rows[K.DEMAND][j]
    rows[K.QUADS][j] = rows[K.QUADS_FREE][j] = excite(fixed, j, demand)
    rows[K.FLEXORS][j] = rows[K.FLEXORS_FREE][j] = excite(fixed, j, -demand)


@kernel
def torque_expected(rows: Any, fixed: Any, j: int, phase: float) -> float:
    """Return the assistance [N m] that an adaptive wearer expects at a phase."""
    if fixed[K.LEG_ADAPTATION][j] == 0.0:
        return 0.0
    place = phase * BINS + (BINS - 0.5)
    k = int(place)
    share = place - float(k)
    first, second = rows[K.EXPECTED + k % BINS][j], rows[K.EXPECTED + (k + 1) % BINS][j]
    return first + share * (second - first)  # type: ignore[no-any-return]


@kernel
def learn(rows: Any, fixed: Any, j: int, period: float) -> None:
    """Advance reflex and expectation of an adaptive wearer by a control period.

    In each part of the stride, the expected assistance moves towards the mean that was delivered
    there, and is forgotten at a rate, once a stride.
    """
    rate, k = fixed[K.LEG_ADAPTATION][j], int(rows[K.PHASE][j] * BINS)
    if rate == 0.0:
        return
    left = left_of_gap(period, REFLEX_LAG)
    aim = fixed[K.LEG_REFLEX][j] * rows[K.DEVIATION][j]
    rows[K.REFLEX][j] = aim + (rows[K.REFLEX][j] - aim) * left
    was = int(rows[K.FELT_PART][j])
    if k != was:
        if rows[K.FELT_COUNT][j] > 0.0:
            mean, old = rows[K.FELT][j] / rows[K.FELT_COUNT][j], rows[K.EXPECTED + was][j]
            gap = rate * (mean - old) - fixed[K.LEG_FORGETTING][j] * old
            rows[K.EXPECTED + was][j] = old + gap
        rows[K.FELT_PART][j], rows[K.FELT][j], rows[K.FELT_COUNT][j] = k, 0.0, 0.0
    rows[K.FELT][j] = rows[K.FELT][j] + rows[K.TORQUE][j]
    rows[K.FELT_COUNT][j] = rows[K.FELT_COUNT][j] + 1.0


@kernel
def unsaved(rows: Any, j: int) -> tuple[float, float]:
    """Return the torques [N m] that extensors and flexors bear where the wearer does not adapt."""
    demand, torque = rows[K.DEMAND][j], rows[K.TORQUE][j]
    return demand - torque, torque - demand


@kernel
def borne(rows: Any, fixed: Any, j: int) -> tuple[float, float]:
    """Return the torques [N m] that extensors and flexors bear.

    What an adaptive wearer expects is saved by the muscles that would bear it. What is unexpected
    meets both groups, which hold the knee together: one is relieved of half of it, the other bears
    the other half.
    """
    demand, torque = rows[K.DEMAND][j], rows[K.TORQUE][j]
    if fixed[K.LEG_ADAPTATION][j] == 0.0:
        return unsaved(rows, j)
    expected = torque_expected(rows, fixed, j, rows[K.PHASE][j])
    planned, half = demand - expected, 0.5 * (torque - expected)
    extend, flex = max(0.0, planned) - half, max(0.0, -planned) + half
    return extend - min(0.0, flex), flex - min(0.0, extend)


@kernel
def share_muscles(rows: Any, fixed: Any, j: int, period: float, extend: float, flex: float) -> None:
    """Advance the activations, with the orthosis' torque as delivered and without it.

    ``extend`` and ``flex`` [N m] are the torques that extensors and flexors bear with it.
    """
    risen = left_of_gap(period, fixed[K.ACTIVATION_RISE_TIME][j])
    fallen = left_of_gap(period, fixed[K.ACTIVATION_FALL_TIME][j])
    demand = rows[K.DEMAND][j]
    rows[K.QUADS][j] = activation(rows[K.QUADS][j], excite(fixed, j, extend), risen, fallen)
    rows[K.FLEXORS][j] = activation(rows[K.FLEXORS][j], excite(fixed, j, flex), risen, fallen)
    free = excite(fixed, j, demand)
    rows[K.QUADS_FREE][j] = activation(rows[K.QUADS_FREE][j], free, risen, fallen)
    free = excite(fixed, j, -demand)
    rows[K.FLEXORS_FREE][j] = activation(rows[K.FLEXORS_FREE][j], free, risen, fallen)


BINS = K.PARTS
"""Parts of a stride in which an adaptive wearer learns apart."""
REFLEX_LAG = 0.05
"""Lag [s] of the stretch reflex of the knee."""
SPREAD = 1.7320508075688772
"""Half-width of an even distribution over its standard deviation."""
HALF_ROOT = 0.7071067811865476
"""Deviation of a stride's begin over that of its duration, which has two such ends."""
STRIDE_STREAM = 20
"""Random stream of the strides' begins; the next one is that of their loads."""
WAS, HELD, HELD_RATE, KNEE_WAS, RATE_WAS, FORCE_WAS, KNEE_NOW, RATE_NOW, FORCE_NOW, EXPECTS = range(
    10
)
"""Rows of scratch: stiffness before the sub-step, the wearer's hold, his path before and after the
sub-step, and the assistance that he expects."""
N_WORK = 10


# placeholders, filled in for each hysteresis and mounting
hysteresis_lag: Any = None
hysteresis_peek: Any = None
feel_at: Any = None
angle_ahead: Any = None
report: Any = None
EFFECTIVE = K.PRESSURE
"""Row of the effective pressure; that of the extended plant replaces it."""


@kernel
def set_length(rows: Any, fixed: Any, hysteresis: int, j: int, angle: float) -> None:
    """Write the length of the muscle of one lane at an angle, and the limit of its friction."""
    sine, _ = sine_and_cosine(0.5 * angle)
    rows[K.AT][j] = muscle_length(sine, fixed[K.LEVER_ARM][j], fixed[K.LEVER_FITTINGS][j])
    empty = fixed[K.HYSTERESIS_EMPTY][j]
    grown = (1.0 - empty) * rows[EFFECTIVE][j] / REFERENCE_PRESSURE
    rows[hysteresis + LIMIT][j] = max(0.0, empty + grown)


@kernel
def peek_length(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, first: int,
    last: int,
) -> None:  # fmt: skip
    """Write lag and sticking share of the friction at the lengths written; it does not move."""
    hysteresis_peek(
        rows, fixed, counts, table, hysteresis, elements, K.AT, K.LAG, K.STICK, 1, K.MODEL,
        K.STACK_COUNT, K.MEMBER, first, last,
    )  # fmt: skip


@kernel
def move_length(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, first: int,
    last: int,
) -> None:  # fmt: skip
    """Move the friction to the lengths written."""
    hysteresis_lag(
        rows, fixed, counts, table, hysteresis, elements, K.AT, K.LAG, 1, K.MODEL, K.STACK_COUNT,
        K.MEMBER, first, last,
    )  # fmt: skip


@kernel
def more_tension(rows: Any, fixed: Any, j: int, length: float) -> float:
    """Return the tension [N] of the law's correction at a length [m]: a plain plant has none."""
    return 0.0


@kernel
def more_stiffness(rows: Any, fixed: Any, j: int, length: float) -> float:
    """Return the derivative of :func:`more_tension` by length [N/m]."""
    return 0.0


@kernel
def brace_drag(rows: Any, fixed: Any, j: int, angle: float, rate: float, stiffness: float) -> float:
    """Return the damping [N m s/rad] by the muscle's viscosity: a plain plant has none."""
    return 0.0


@kernel
def report_drag(rows: Any, fixed: Any, j: int) -> None:
    """Add the muscle's viscous force to tension and torque of a lane: a plain plant has none."""


@kernel
def tension_of(rows: Any, fixed: Any, j: int, length: float, stiffness: float) -> float:
    """Return the tension [N] at a length [m] and a stiffness [N/m], without viscosity."""
    stretch = stretch_of(length, fixed[K.MUSCLE_SHORTEST_LENGTH][j])
    pull = spring_tension(stiffness, stretch) + more_tension(rows, fixed, j, length)
    return max(0.0, pull + rows[K.RUB][j] * rows[K.LAG][j])


@kernel
def torque_and_slope(
    rows: Any, fixed: Any, j: int, angle: float, stiffness: float
) -> tuple[float, float]:
    """Return the assistive torque [N m] at an angle [rad] and its slope [N m/rad]."""
    sine, cosine = sine_and_cosine(0.5 * angle)
    arm, spring = fixed[K.LEVER_ARM][j], fixed[K.LEVER_STIFFNESS][j]
    length = muscle_length(sine, arm, fixed[K.LEVER_FITTINGS][j])
    stretch = stretch_of(length, fixed[K.MUSCLE_SHORTEST_LENGTH][j])
    tension = tension_of(rows, fixed, j, length, stiffness)
    torque = assistive_torque(tension, cosine, angle, arm, spring, fixed[K.LEVER_RELAXED_ANGLE][j])
    pulls = max(0.0, stiffness) if stretch > 0.0 else 0.0
    pulls = pulls + more_stiffness(rows, fixed, j, length) + rows[K.RUB][j] * rows[K.STICK][j]
    lever = arm * cosine
    return torque, spring + pulls * lever * lever - 0.5 * tension * arm * sine


@kernel
def enclosed_stiffness(rows: Any, j: int) -> float:
    """Return the stiffness [N m/rad] of the air in the muscle of lane ``j``: none if plain."""
    return 0.0


@kernel
def feel_nothing(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int,
    angle: float,
) -> None:  # fmt: skip
    """Do nothing: the pressure has the hysteresis."""


@kernel
def feel_length(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int,
    angle: float,
) -> None:  # fmt: skip
    """Write the friction of one lane at an angle; it does not move."""
    set_length(rows, fixed, hysteresis, j, angle)
    peek_length(rows, fixed, counts, table, hysteresis, elements, j, j + 1)


@kernel
def slide_nothing(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, ahead: float,
    work: Any,
) -> None:  # fmt: skip
    """Do nothing: the pressure has the hysteresis."""


@kernel
def feel_ahead(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, ahead: float,
    work: Any,
) -> None:  # fmt: skip
    """Write the friction of a tile at the angles ``ahead`` seconds from now; it does not move."""
    for j in range(LANES):
        set_length(rows, fixed, hysteresis, j, angle_ahead(rows, fixed, j, ahead, work))
    peek_length(rows, fixed, counts, table, hysteresis, elements, 0, LANES)


@kernel
def slide_ahead(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, ahead: float,
    work: Any,
) -> None:  # fmt: skip
    """Move the friction of a tile to the angles ``ahead`` seconds from now."""
    for j in range(LANES):
        set_length(rows, fixed, hysteresis, j, angle_ahead(rows, fixed, j, ahead, work))
    move_length(rows, fixed, counts, table, hysteresis, elements, 0, LANES)


@kernel
def brace_ahead(rows: Any, fixed: Any, j: int, ahead: float, work: Any) -> float:
    """Return the predicted angle [rad] of a brace without a leg."""
    return rows[K.ANGLE][j] + ahead * rows[K.VELOCITY][j]  # type: ignore[no-any-return]


@kernel
def leg_ahead(rows: Any, fixed: Any, j: int, ahead: float, work: Any) -> float:
    """Return the predicted angle [rad] of a brace on a leg."""
    path = fixed[K.LEVER_MOUNT_ANGLE][j] + work[KNEE_WAS][j] + ahead * work[RATE_WAS][j]
    return path + rows[K.DEVIATION][j] + ahead * rows[K.DEVIATION_RATE][j]  # type: ignore[no-any-return]


def friction_kernels(by_length: bool) -> dict[str, Any]:
    """Return the kernels of the friction by their placeholders."""
    if not by_length:
        return {"feel": slide_nothing, "slide": slide_nothing, "feel_at": feel_nothing}
    return {"feel": feel_ahead, "slide": slide_ahead, "feel_at": feel_length}


@kernel
def begin_period_alone(
    rows: Any, fixed: Any, counts: Any, gait: Any, period: float, work: Any
) -> None:
    """Do nothing: without a leg there is no gait."""


@kernel
def stay(
    rows: Any, fixed: Any, counts: Any, gait: Any, i: int, per_substep: float, h: float, work: Any
) -> None:
    """Hold the muscle at its length."""


@kernel
def swing_free(
    rows: Any, fixed: Any, counts: Any, gait: Any, i: int, per_substep: float, h: float, work: Any
) -> None:
    """Move the brace alone."""
    angle, velocity, stiffness, was = rows[K.ANGLE], rows[K.VELOCITY], rows[K.STIFFNESS], work[WAS]
    for j in range(LANES):
        ahead = 0.5 * h * velocity[j]
        per_inertia = 1.0 / fixed[K.LEVER_INERTIA][j]
        rubs = brace_drag(rows, fixed, j, angle[j] + ahead, velocity[j], stiffness[j])
        drag = (fixed[K.LEVER_DAMPING][j] + rubs) * per_inertia
        old, slope_old = torque_and_slope(rows, fixed, j, angle[j] + ahead, was[j])
        new, slope_new = torque_and_slope(rows, fixed, j, angle[j] + ahead, stiffness[j])
        slope = max(1.0, 0.5 * (slope_old + slope_new) + enclosed_stiffness(rows, j))
        du, velocity[j] = turn(
            rows, fixed, j, velocity[j], (slope * ahead - old) * per_inertia,
            (old - new) * per_inertia / h, slope * per_inertia, drag, per_inertia, h,
        )  # fmt: skip
        angle[j] = angle[j] + du


@kernel
def begin_period_leg(
    rows: Any, fixed: Any, counts: Any, gait: Any, period: float, work: Any
) -> None:
    """Read the wearer's path at the end of the period and the stiffness with which he holds it."""
    draw_strides(rows, fixed, counts, 1, 1, period)
    read = scratch(N_READ, LANES)
    for j in range(LANES):
        read_gait(rows, fixed, gait, j, (counts[K.STEP][j] + 1) * period, read)
    for j in range(LANES):
        stiffness, damping = rows[K.HOLD][j], rows[K.HOLD_RATE][j]
        work[KNEE_WAS][j], work[RATE_WAS][j] = rows[K.KNEE][j], rows[K.KNEE_RATE][j]
        work[FORCE_WAS][j] = rows[K.KNEE_ACCELERATION][j]
        gait_at(rows, fixed, j, read)
        work[HELD][j] = 0.5 * (stiffness + rows[K.HOLD][j])
        work[HELD_RATE][j] = 0.5 * (damping + rows[K.HOLD_RATE][j])


@kernel
def follow_leg(
    rows: Any, fixed: Any, counts: Any, gait: Any, i: int, per_substep: float, h: float, work: Any
) -> None:
    """Move the knee off the wearer's path, with the brace on it."""
    off, rate, stiffness, was = (
        rows[K.DEVIATION],
        rows[K.DEVIATION_RATE],
        rows[K.STIFFNESS],
        work[WAS],
    )
    held, held_rate, mount = work[HELD], work[HELD_RATE], fixed[K.LEVER_MOUNT_ANGLE]
    draw_strides(rows, fixed, counts, per_substep, i + 1, h)
    adapts = count_on(fixed[K.LEG_ADAPTATION], 0.0)
    for j in range(LANES):  # a loop of its own: it reads the curves and writes scratch alone
        time = (counts[K.STEP][j] * per_substep + (i + 1)) * h
        phase, pace, hurry, _ = stride_at(rows, fixed, j, time)
        knee, turn, bend = curve_and_rates(gait, KNEE, phase)
        work[KNEE_NOW][j], work[RATE_NOW][j] = knee, turn * pace
        work[FORCE_NOW][j] = bend * pace * pace + turn * hurry
        work[EXPECTS][j] = phase
    for j in range(LANES):
        expected = torque_expected(rows, fixed, j, work[EXPECTS][j]) if adapts > 0 else 0.0
        work[EXPECTS][j] = expected
    for j in range(LANES):
        knee, turn, bend = work[KNEE_NOW][j], work[RATE_NOW][j], work[FORCE_NOW][j]
        ahead, per_inertia = (
            0.5 * h * rate[j],
            1.0 / (fixed[K.LEG_INERTIA][j] + fixed[K.LEVER_INERTIA][j]),
        )
        middle = mount[j] + off[j] + ahead
        rubs = brace_drag(rows, fixed, j, middle + knee, rate[j] + turn, stiffness[j])
        drag = (held_rate[j] + fixed[K.LEVER_DAMPING][j] + rubs) * per_inertia
        old, slope_old = torque_and_slope(rows, fixed, j, middle + work[KNEE_WAS][j], was[j])
        new, slope_new = torque_and_slope(rows, fixed, j, middle + knee, stiffness[j])
        old = old + along_path(fixed, j, work[RATE_WAS][j], work[FORCE_WAS][j])
        old = old - habituated(fixed, j, work[KNEE_WAS][j])
        new = new + along_path(fixed, j, turn, bend) - habituated(fixed, j, knee)
        own = rows[K.REFLEX][j] - work[EXPECTS][j]
        old, new = old + own + rubs * work[RATE_WAS][j], new + own + rubs * turn
        slope = 0.5 * (slope_old + slope_new) + enclosed_stiffness(rows, j)
        du, rate[j] = damped_motion(
            rate[j],
            (slope * ahead - old - held[j] * off[j]) * per_inertia,
            (old - new) * per_inertia / h,
            max(1.0, slope + held[j]) * per_inertia,
            drag,
            decay(0.5 * drag * h),
            h,
        )
        off[j] = off[j] + du
        work[KNEE_WAS][j], work[RATE_WAS][j], work[FORCE_WAS][j] = knee, turn, bend


@kernel
def along_path(fixed: Any, j: int, rate: float, acceleration: float) -> float:
    """Return the torque [N m] that carries the brace along the wearer's path."""
    return fixed[K.LEVER_DAMPING][j] * rate + fixed[K.LEVER_INERTIA][j] * acceleration


@kernel
def habituated(fixed: Any, j: int, knee: float) -> float:
    """Return the extending torque [N m] of the wire that the wearer bears beforehand."""
    past = fixed[K.LEVER_MOUNT_ANGLE][j] + knee - fixed[K.LEVER_RELAXED_ANGLE][j]
    return fixed[K.LEG_HABITUATION][j] * fixed[K.LEVER_STIFFNESS][j] * max(0.0, past)


@kernel
def report_muscle(rows: Any, fixed: Any, j: int, length: float) -> None:
    """Write length, tension and air of one lane."""
    rows[K.LENGTH][j] = length
    rows[K.TENSION][j] = tension_of(rows, fixed, j, length, rows[K.STIFFNESS][j])
    space = gas_volume(
        length,
        fixed[K.MUSCLE_SHORTEST_LENGTH][j],
        fixed[K.MUSCLE_STIFFNESS_RATIO][j],
        fixed[K.MUSCLE_FULL_VOLUME][j],
    )
    rows[K.AIR][j] = DENSITY_PER_PRESSURE * (max(0.0, rows[K.PRESSURE][j]) + ATMOSPHERE) * space


@kernel
def report_alone(rows: Any, fixed: Any, j: int, period: float) -> None:
    """Write the signals of a brace without a leg."""
    sine, _ = sine_and_cosine(0.5 * rows[K.ANGLE][j])
    report_muscle(
        rows, fixed, j, muscle_length(sine, fixed[K.LEVER_ARM][j], fixed[K.LEVER_FITTINGS][j])
    )
    rows[K.TORQUE][j], _ = torque_and_slope(rows, fixed, j, rows[K.ANGLE][j], rows[K.STIFFNESS][j])
    report_drag(rows, fixed, j)


@kernel
def report_each(rows: Any, fixed: Any, period: float) -> None:
    """Write the signals of a tile."""
    for j in range(LANES):
        report(rows, fixed, j, period)


@kernel
def report_rig(rows: Any, fixed: Any, j: int, period: float) -> None:
    """Write the signals of a muscle held at its length."""
    report_muscle(rows, fixed, j, fixed[K.FIXTURE_LENGTH][j])
    rows[K.TORQUE][j], _ = torque_and_slope(rows, fixed, j, rows[K.ANGLE][j], rows[K.STIFFNESS][j])


@kernel
def report_leg(rows: Any, fixed: Any, j: int, period: float) -> None:
    """Write the signals of the brace on the leg, and the wearer's muscle activity."""
    place_leg(rows, fixed, j, period)
    expected = torque_expected(rows, fixed, j, rows[K.PHASE][j])
    rows[K.TORQUE][j] = delivered(rows, fixed, j, rows[K.TORQUE][j], expected)
    learn(rows, fixed, j, period)
    extend, flex = borne(rows, fixed, j)
    share_muscles(rows, fixed, j, period, extend, flex)


@kernel
def report_legs(rows: Any, fixed: Any, period: float) -> None:
    """Write the signals of a tile; where no wearer adapts, the same by fewer operations."""
    if count_on(fixed[K.LEG_ADAPTATION], 0.0) > 0:
        for j in range(LANES):
            report_leg(rows, fixed, j, period)
        return
    for j in range(LANES):
        place_leg(rows, fixed, j, period)
        rows[K.TORQUE][j] = delivered(rows, fixed, j, rows[K.TORQUE][j], 0.0)
        extend, flex = unsaved(rows, j)
        share_muscles(rows, fixed, j, period, extend, flex)


@kernel
def place_leg(rows: Any, fixed: Any, j: int, period: float) -> None:
    """Write angle, velocity, length, tension and torque of the brace on the leg."""
    rate = rows[K.KNEE_RATE][j] + rows[K.DEVIATION_RATE][j]
    angle = fixed[K.LEVER_MOUNT_ANGLE][j] + rows[K.KNEE][j] + rows[K.DEVIATION][j]
    rows[K.ANGLE][j], rows[K.VELOCITY][j] = angle, rate
    report_alone(rows, fixed, j, period)


@kernel
def delivered(rows: Any, fixed: Any, j: int, torque: float, expected: float) -> float:
    """Return the part of the torque of spring and muscle [N m] that reaches the leg.

    The rest moves the brace itself, against its inertia and friction. ``expected`` [N m] is what
    an adaptive wearer expects.
    """
    path = along_path(fixed, j, rows[K.KNEE_RATE][j], rows[K.KNEE_ACCELERATION][j])
    off, rate = rows[K.DEVIATION][j], rows[K.DEVIATION_RATE][j]
    drag = (rows[K.HOLD_RATE][j] + fixed[K.LEVER_DAMPING][j]) * rate
    own = rows[K.REFLEX][j] - expected
    pull = torque + path - habituated(fixed, j, rows[K.KNEE][j]) + rows[K.HOLD][j] * off + drag
    pull = pull + own
    sway = -pull / (fixed[K.LEG_INERTIA][j] + fixed[K.LEVER_INERTIA][j])
    return torque + path + fixed[K.LEVER_DAMPING][j] * rate + fixed[K.LEVER_INERTIA][j] * sway


@routine
def rest_rig(
    rows: Any, fixed: Any, counts: Any, table: Any, gait: Any, hysteresis: int, elements: int,
    j: int,
) -> None:  # fmt: skip
    """Put the muscle at its length in the rig."""
    low, high = 0.0, 3.141592653589793
    for _ in range(60):
        angle = 0.5 * (low + high)
        sine, _ = sine_and_cosine(0.5 * angle)
        if (
            muscle_length(sine, fixed[K.LEVER_ARM][j], fixed[K.LEVER_FITTINGS][j])
            < fixed[K.FIXTURE_LENGTH][j]
        ):
            low = angle
        else:
            high = angle
    rows[K.ANGLE][j], rows[K.VELOCITY][j] = 0.5 * (low + high), 0.0


@routine
def rest_alone(
    rows: Any, fixed: Any, counts: Any, table: Any, gait: Any, hysteresis: int, elements: int,
    j: int,
) -> None:  # fmt: skip
    """Put the brace where spring and muscle balance."""
    low, high = 0.0, 3.141592653589793
    for _ in range(60):
        angle = 0.5 * (low + high)
        feel_at(rows, fixed, counts, table, hysteresis, elements, j, angle)
        torque, _ = torque_and_slope(rows, fixed, j, angle, rows[K.STIFFNESS][j])
        if torque < 0.0:
            low = angle
        else:
            high = angle
    rows[K.ANGLE][j], rows[K.VELOCITY][j] = 0.5 * (low + high), 0.0


@routine
def rest_leg(
    rows: Any, fixed: Any, counts: Any, table: Any, gait: Any, hysteresis: int, elements: int,
    j: int,
) -> None:  # fmt: skip
    """Put the knee where the wearer's hold balances the brace, moving along the path."""
    rows[K.REFLEX][j] = 0.0
    rows[K.FELT][j], rows[K.FELT_COUNT][j], rows[K.FELT_PART][j] = 0.0, 0.0, 0.0
    for k in range(BINS):
        rows[K.EXPECTED + k][j] = 0.0
    draw_stride(rows, fixed, counts, j, 0.0)
    read = scratch(N_READ, LANES)
    read_gait(rows, fixed, gait, j, 0.0, read)
    gait_at(rows, fixed, j, read)
    load = along_path(fixed, j, rows[K.KNEE_RATE][j], rows[K.KNEE_ACCELERATION][j])
    load = load - habituated(fixed, j, rows[K.KNEE][j])
    angle = fixed[K.LEVER_MOUNT_ANGLE][j] + rows[K.KNEE][j]
    low, high = -1.0, 1.0
    for _ in range(60):
        off = 0.5 * (low + high)
        feel_at(rows, fixed, counts, table, hysteresis, elements, j, angle + off)
        torque, _ = torque_and_slope(rows, fixed, j, angle + off, rows[K.STIFFNESS][j])
        rate = rows[K.KNEE_RATE][j]
        rubs = brace_drag(rows, fixed, j, angle + off, rate, rows[K.STIFFNESS][j])
        torque = torque + rubs * rate
        if torque + load + rows[K.HOLD][j] * off < 0.0:
            low = off
        else:
            high = off
    rows[K.DEVIATION][j], rows[K.DEVIATION_RATE][j] = 0.5 * (low + high), 0.0
    start_muscles(rows, fixed, j)


MOTIONS: dict[str, dict[str, Any]] = {
    "rig": {
        "begin_period": begin_period_alone,
        "move": stay,
        "rest": rest_rig,
        "angle_ahead": brace_ahead,
        "report": report_rig,
        "report_tile": report_each,
    },
    "no_load": {
        "begin_period": begin_period_alone,
        "move": swing_free,
        "rest": rest_alone,
        "angle_ahead": brace_ahead,
        "report": report_alone,
        "report_tile": report_each,
    },
    "leg": {
        "begin_period": begin_period_leg,
        "move": follow_leg,
        "rest": rest_leg,
        "angle_ahead": leg_ahead,
        "report": report_leg,
        "report_tile": report_legs,
    },
}
