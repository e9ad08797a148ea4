"""One control period of the single muscle with every effect of its components.

The plain plant is :mod:`pam_envs.plants.single_muscle.step`; this is the same step composed of the
extended steps of the components. With all effects neutral the motion is that of the plain step; a
plant uses the extended step when an effect is not neutral. The order is that of the signal::

    setpoint -> dead time -> regulator, supply, leak -> line -> threshold, hysteresis, friction
    -> first cycles -> yielding -> creep -> temperature -> law, load, viscosity, strands, yielding
    -> support, guide -> length creep -> mount -> sensors

A setpoint below zero means that the valve is shut: the muscle keeps its air except for the leak;
with ``regulator.flow`` motion then compresses it.
"""

from typing import Any

from pam_envs.constants import GRAVITY
from pam_envs.hysteresis.friction_effects import (
    begin_creep,
    creep_left,
    creep_step,
    creeps_on,
    friction_with_effects,
    newness,
    yield_step,
)
from pam_envs.kernels.arithmetic import count_on, decay
from pam_envs.kernels.build import LANES, kernel, routine, scratch
from pam_envs.kernels.motion import damped_motion
from pam_envs.mechanics.guide import stick_slip_step
from pam_envs.mechanics.hanging_mass import MOUNT_STATE, load_fraction, mount_step
from pam_envs.muscle.effective_area import law_and_slope, tension, tension_slope, volume
from pam_envs.muscle.effects import (
    BREAKS,
    STRANDS,
    map_force,
    map_on,
    map_slopes,
    slip_limit,
    slip_strands,
    stiffening,
    strand_forces,
    strands_on,
    temperature_factor,
    viscous_damping,
    yield_deflections,
    yield_forces,
    yield_spring,
)
from pam_envs.plants.core.sensors import begin_with_effects, effect_kernels, read_with_effects
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.hysteresis_kernels import (
    friction_per_load,
    hysteresis_kernels,
)
from pam_envs.plants.single_muscle.rows import STATE as S
from pam_envs.pneumatics.enclosed_air import (
    AHEAD,
    REACHED,
    air_stiffness,
    enclose,
    flow_step,
    flows_on,
    squeeze,
    without_flow,
)
from pam_envs.pneumatics.regulator import (
    AIR,
    AIR_STATE,
    air_step,
    begin_air,
    begin_leak,
    delay_commands,
    interval_of,
    late_shares,
    line_effects_on,
    stage_widths,
    switch_substeps,
    valve_effects_on,
)

EFFECTS_AT = 0  # placeholder: the row after the hysteresis state
# placeholders, see hysteresis_kernels
plain_hysteresis: Any = None
hysteresis_ahead: Any = None
hysteresis_moved: Any = None
STAGED = 1  # 0 where the hysteresis has no memory of pressures within a sub-step

FULL_STRAIN = 0.15
"""Full scale of the position sensor, over the rest length."""
FASTEST_DECAY, FASTEST_TURN = 1.0 / 24.0, 1.0 / 200.0
"""Over the sub-step: mass over damping, and mass over stiffness and the sub-step again."""
NO_SUPPORT = -1e9
"""Position of a load without support [m]."""
FINE_PARTS = 4
"""Parts of a sub-step where a guide sticks, or a loss depends on speed."""


@kernel
def first_share(rows: Any, fixed: Any, j: int) -> float:
    """Return the share of the first state that is left after the travel of lane ``j``."""
    return newness(rows[EFFECTS_AT + S.travel][j], fixed[R.HYSTERESIS_FIRST_TRAVEL][j])  # type: ignore[no-any-return]


@kernel
def friction_factor(rows: Any, fixed: Any, j: int) -> float:
    """Return the factor on the friction of strands and that yields: of load and first travel."""
    wide = friction_per_load(fixed[R.HYSTERESIS_WIDTH_PER_LOAD][j], rows[R.LOAD][j])
    return (1.0 + fixed[R.HYSTERESIS_FIRST_WIDTH][j] * first_share(rows, fixed, j)) * wide  # type: ignore[no-any-return]


@kernel
def yield_to_pressure(rows: Any, fixed: Any, first: int, last: int, own: Any) -> None:
    """Move the yielding friction of the pressure to the pressure reached."""
    above = own[0]
    for j in range(first, last):
        above[j] = max(0.0, rows[R.PRESSURE][j] - fixed[R.HYSTERESIS_THRESHOLD][j])
    yield_step(rows, fixed, EFFECTS_AT + S.yielding, R.HYSTERESIS_YIELD_WIDTH, first, last, above)


@kernel
def effective_pressure(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, first: int, last: int,
    elements: int, work: Any, left: Any, own: Any, creeps: int, worn: int, yields: int,
) -> None:  # fmt: skip
    """Compute the effective pressure from the pressure; ``left`` is that of the creep's step."""
    if yields > 0:
        yield_to_pressure(rows, fixed, first, last, own)
    pressure, drive = rows[R.PRESSURE], rows[R.DRIVE]
    true, friction, most = own[0], rows[EFFECTS_AT + S.friction], own[2]
    if STAGED > 0:
        for j in range(first, last):
            true[j] = pressure[j]
            pressure[j] = max(0.0, pressure[j] - fixed[R.HYSTERESIS_THRESHOLD][j])
        plain_hysteresis(rows, fixed, counts, table, hysteresis, first, last, elements, work)
        for j in range(first, last):
            above = pressure[j]
            pressure[j] = true[j]
            friction[j] = above - drive[j]
            drive[j] = above - friction[j]
            true[j] = above
            most[j] = 0.0
    else:
        for j in range(first, last):
            true[j] = drive[j] = max(0.0, pressure[j] - fixed[R.HYSTERESIS_THRESHOLD][j])
            friction[j] = most[j] = 0.0
    for k in range(elements if worn > 0 else 0):
        for j in range(first, last):
            most[j] = most[j] + fixed[R.WEIGHT + k][j] * fixed[R.THRESHOLD + k][j]
    for j in range(first, last if worn > 0 else first):
        new = first_share(rows, fixed, j)
        friction[j] = friction_with_effects(
            friction[j],
            most[j],
            pressure[j] / fixed[R.REGULATOR_MAX_PRESSURE][j],
            fixed[R.HYSTERESIS_SHAPE][j],
            fixed[R.HYSTERESIS_PRESSURE_SLOPE][j],
            fixed[R.HYSTERESIS_PRESSURE_BEND][j],
        )
        drive[j] = true[j] - (1.0 + fixed[R.HYSTERESIS_FIRST_WIDTH][j] * new) * friction[j]
    for j in range(first, last if yields > 0 else first):
        width = fixed[R.HYSTERESIS_YIELD_WIDTH][j] * friction_factor(rows, fixed, j)
        drive[j] = drive[j] - width * rows[EFFECTS_AT + S.yielding][j]
    if creeps > 0:
        for j in range(first, last):
            most[j] = 0.0
        creep_step(
            rows, fixed, EFFECTS_AT + S.creep, R.HYSTERESIS_CREEP_1, first, last, drive, left, most
        )
        for j in range(first, last):
            drive[j] = drive[j] + most[j]
    for j in range(first, last if worn > 0 else first):
        new = first_share(rows, fixed, j)
        gained = temperature_factor(
            rows[EFFECTS_AT + S.kelvin][j], fixed[R.MUSCLE_TEMPERATURE_GAIN][j]
        )
        drive[j] = drive[j] * gained * (1.0 - fixed[R.HYSTERESIS_FIRST_LOSS][j] * new)


@kernel
def enclose_air(rows: Any, fixed: Any, j: int, ahead: float) -> None:
    """Write the volume of the muscle of lane ``j``, and its change with the contraction [m2].

    ``ahead`` is the predicted displacement [m].
    """
    length, taper = fixed[R.MUSCLE_REST_LENGTH][j], fixed[R.MUSCLE_AREA_TAPER][j]
    area, curve = fixed[R.MUSCLE_AREA][j], fixed[R.MUSCLE_AREA_CURVE][j]
    e = rows[R.CONTRACTION][j] / length
    space = volume(e, length, fixed[R.MUSCLE_DIAMETER][j], area, taper, curve)
    enclose(rows, j, EFFECTS_AT + S.air, space, area * (1.0 - (taper + curve * e) * e), ahead)


@kernel
def squeeze_muscle(rows: Any, fixed: Any, share: float, own: Any) -> None:
    """Move the enclosed air of a tile with the motion; write the change of effective pressures.

    They change with the pressures as without hysteresis. ``own`` is a row of scratch.
    """
    drive = rows[R.DRIVE]
    squeeze(rows, fixed, EFFECTS_AT + S.air, R.EFFECT.regulator, rows[R.PRESSURE], own, share)
    for j in range(LANES):
        drive[j] = drive[j] + own[j]


@kernel
def settled(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, first: int, last: int,
    elements: int, work: Any,
) -> None:  # fmt: skip
    """Compute the effective pressure of a pressure that has been held for long."""
    own, left = scratch(3, LANES), scratch(4, LANES)
    for j in range(first, last):
        own[1][j] = 1e9
        rows[EFFECTS_AT + S.kelvin][j] = fixed[R.MUSCLE_TEMPERATURE][j]
    creep_left(fixed, R.HYSTERESIS_CREEP_1, R.HYSTERESIS_CREEP_TIME_1, first, last, own[1], left)
    effective_pressure(
        rows, fixed, counts, table, hysteresis, first, last, elements, work, left, own, 1, 1, 1
    )


@kernel
def carried(fixed: Any, j: int, load: float) -> tuple[float, float, float, float]:
    """Return the mass [kg] of a load, its weight [N], the stiffness factor and the shift [Pa]."""
    mass = load + (fixed[R.MASS_LOAD_ERROR][j] if load > 0.0 else 0.0)
    weight = mass * GRAVITY
    stiffer = stiffening(
        weight,
        fixed[R.MUSCLE_LOAD_STIFFENING][j],
        fixed[R.MUSCLE_LOAD_STIFFENING_2][j],
        fixed[R.MUSCLE_LOAD_STIFFENING_ROOT][j],
    )
    return mass, weight, stiffer, fixed[R.MUSCLE_LOAD_CURVE][j] * weight * weight


@kernel
def law_of(
    fixed: Any, j: int, drive: float, middle: float, e: float, stiffer: float
) -> tuple[float, float]:
    """Return the force [N] of the static law with its finer terms, at an effective pressure [Pa].

    Then minus its derivative by the contraction [N], at another one.
    """
    return law_and_slope(
        drive,
        middle,
        e,
        stiffer,
        fixed[R.MUSCLE_AREA][j],
        fixed[R.MUSCLE_AREA_TAPER][j],
        fixed[R.MUSCLE_BRAID_FORCE][j],
        fixed[R.MUSCLE_BRAID_STRAIN][j],
        fixed[R.MUSCLE_STIFFNESS][j],
        fixed[R.MUSCLE_HARDENING][j],
        fixed[R.MUSCLE_AREA_CURVE][j],
        fixed[R.MUSCLE_SOFTENING][j],
        fixed[R.MUSCLE_STIFFENING][j],
    )


@kernel
def pull_at_rest(fixed: Any, j: int, drive: float, e: float, stiffer: float) -> float:
    """Return the force [N] of the static law and its map at an effective pressure [Pa]."""
    pull, _ = law_of(fixed, j, drive, drive, e, stiffer)
    return pull + map_force(fixed, j, R.MUSCLE_MAP_05, drive, e)


@kernel
def hanging_share(fixed: Any, j: int, x: float, hangs: float) -> tuple[float, float]:
    """Return the share of a load that hangs on the muscle at a contraction [m], and its slope."""
    return load_fraction(  # type: ignore[no-any-return]
        x,
        hangs,
        fixed[R.MASS_SLACK][j],
        fixed[R.MASS_SLACK_FREE][j],
        fixed[R.MASS_SLACK_SAG][j],
    )


@routine
def balance(fixed: Any, lane: int, drive: float, load: float, hangs: float) -> float:
    """Return the position [m] at rest of one lane, by bisection."""
    length = fixed[R.MUSCLE_REST_LENGTH][lane]
    _, weight, stiffer, shift = carried(fixed, lane, load)
    low, high = -0.3, 0.6
    for _ in range(56):
        e = 0.5 * (low + high)
        pull = pull_at_rest(fixed, lane, drive - shift, e, stiffer)
        if pull > weight * hanging_share(fixed, lane, e * length, hangs)[0]:
            low = e
        else:
            high = e
    return 0.5 * (low + high) * length


@routine
def rest_extended(fixed: Any, lane: int, drive: float, load: float) -> float:
    """Return the position [m] at rest under an effective pressure [Pa] and a load [kg]."""
    hangs = balance(fixed, lane, 0.0, load, NO_SUPPORT)
    return balance(fixed, lane, drive, load, hangs)


@kernel
def first_stiffening(rows: Any, fixed: Any, j: int) -> float:
    """Return the passive force over strain [N] that lane ``j`` has in its first travel alone."""
    return fixed[R.HYSTERESIS_FIRST_STIFFNESS][j] * first_share(rows, fixed, j)  # type: ignore[no-any-return]


@kernel
def excess_pull(rows: Any, fixed: Any, j: int, e: float) -> float:
    """Return the force [N] of one lane at a strain beyond what hangs of the load."""
    x, drive = e * fixed[R.MUSCLE_REST_LENGTH][j], rows[R.DRIVE][j]
    _, weight, stiffer, shift = carried(fixed, j, rows[R.LOAD][j])
    pull = pull_at_rest(fixed, j, drive - shift, e, stiffer)
    pull = pull - first_stiffening(rows, fixed, j) * e
    hangs, _ = hanging_share(fixed, j, x, rows[EFFECTS_AT + S.hangs][j])
    return pull - weight * hangs


@kernel
def hang_load(rows: Any, fixed: Any, j: int) -> None:
    """Write the position at which the load of one lane hangs freely without pressure."""
    rows[EFFECTS_AT + S.hangs][j] = balance(fixed, j, 0.0, rows[R.LOAD][j], NO_SUPPORT)


@kernel
def begin_effects(rows: Any, fixed: Any, j: int) -> None:
    """Begin the effects of lane ``j`` at rest at its position and pressure."""
    x = rows[R.CONTRACTION][j]
    begin_air(rows, j, EFFECTS_AT + S.air, rows[R.PRESSURE][j])
    enclose_air(rows, fixed, j, 0.0)
    rows[EFFECTS_AT + S.travel][j] = 0.0
    rows[EFFECTS_AT + S.stuck][j] = 1.0
    rows[EFFECTS_AT + S.deflection][j] = 0.0
    for k in range(4):
        rows[EFFECTS_AT + S.strands + k][j] = x / fixed[R.MUSCLE_REST_LENGTH][j]
    rows[EFFECTS_AT + S.kelvin][j] = fixed[R.MUSCLE_TEMPERATURE][j]
    begin_creep(rows, fixed, j, EFFECTS_AT + S.stretch, R.MUSCLE_CREEP_1, x)
    crept = 0.0
    for k in range(4):
        crept = crept + fixed[R.MUSCLE_CREEP_1 + k][j]
    rows[EFFECTS_AT + S.shown][j] = x * (1.0 + crept)
    rows[EFFECTS_AT + S.mount + MOUNT_STATE.position][j] = x * (1.0 + crept)
    rows[EFFECTS_AT + S.mount + MOUNT_STATE.rate][j] = 0.0
    rows[R.REST][j] = rows[R.REST][j] * (1.0 + crept)
    rows[EFFECTS_AT + S.hung][j] = rows[R.LOAD][j]
    rows[EFFECTS_AT + S.hangs][j] = balance(fixed, j, 0.0, rows[R.LOAD][j], NO_SUPPORT)
    position = x * (1.0 + crept) - rows[R.REST][j]
    rows[EFFECTS_AT + S.position][j] = position
    begin_with_effects(rows, fixed, j)


@kernel
def begin_plays(rows: Any, fixed: Any, state: int, elements: int, j: int) -> None:
    """Begin the friction of the pressure of lane ``j`` at no pressure, with the share at the start.

    ``state`` is the first row of the plays.
    """
    share = fixed[R.HYSTERESIS_START][j]
    rows[EFFECTS_AT + S.yielding][j] = share
    for k in range(elements if STAGED > 0 else 0):
        rows[state + k][j] = -share * fixed[R.THRESHOLD + k][j]


@kernel
def begin_friction_of_length(rows: Any, fixed: Any, j: int) -> None:
    """Put lane ``j`` at rest with the share of its strands' and yielding friction at the start."""
    share, drive = fixed[R.HYSTERESIS_START][j], rows[R.DRIVE][j]
    wide = friction_factor(rows, fixed, j)
    strands = slip_limit(fixed, j, R.MUSCLE_STRAND_BREAK + 1, drive)
    stiff, limit = yield_spring(fixed, j, R.MUSCLE_YIELD_FORCE, drive)
    most = stiff * limit
    for k in range(STRANDS):
        most = most + fixed[R.MUSCLE_STRAND_1 + k][j] * strands
    length = fixed[R.MUSCLE_REST_LENGTH][j]
    low, high = -0.3, 0.6
    for _ in range(56 if share != 0.0 else 0):
        e = 0.5 * (low + high)
        if excess_pull(rows, fixed, j, e) > share * most * wide:
            low = e
        else:
            high = e
    if share != 0.0:
        rows[R.CONTRACTION][j] = 0.5 * (low + high) * length
    begin_effects(rows, fixed, j)
    rows[EFFECTS_AT + S.deflection][j] = share * limit
    for k in range(STRANDS):
        span = BREAKS[k] * fixed[R.MUSCLE_STRAND_BREAK][j] * strands
        rows[EFFECTS_AT + S.strands + k][j] = rows[R.CONTRACTION][j] / length - share * span


@kernel
def full_scale(fixed: Any, k: int, j: int) -> float:
    """Return the full scale of the sensors of position [m] and pressure [Pa]."""
    if k == 0:
        return FULL_STRAIN * fixed[R.MUSCLE_REST_LENGTH][j]  # type: ignore[no-any-return]
    return fixed[R.REGULATOR_MAX_PRESSURE][j]  # type: ignore[no-any-return]


@kernel
def true_position(rows: Any, j: int) -> float:
    """Return the position [m] of the load of lane ``j``, from its rest position."""
    return rows[EFFECTS_AT + S.position][j]  # type: ignore[no-any-return]


@kernel
def seen_position(rows: Any, j: int) -> float:
    """Return the undisturbed reading of the position sensor [m]."""
    return rows[EFFECTS_AT + S.sensors][j]  # type: ignore[no-any-return]


@kernel
def seen_pressure(rows: Any, j: int) -> float:
    """Return the undisturbed reading of the pressure sensor [Pa]."""
    return rows[EFFECTS_AT + S.sensors + 1][j]  # type: ignore[no-any-return]


@kernel
def lost_pressure(rows: Any, j: int) -> float:
    """Return the pressure [Pa] that leaked in this control period."""
    return rows[EFFECTS_AT + S.air + AIR_STATE.lost][j]  # type: ignore[no-any-return]


@kernel
def finer_terms_on(fixed: Any) -> int:
    """Return the number of lanes and terms of law, load and loss that a plain plant has not."""
    return (  # type: ignore[no-any-return]
        count_on(fixed[R.MUSCLE_AREA_CURVE], 0.0)
        + count_on(fixed[R.MUSCLE_SOFTENING], 0.0)
        + count_on(fixed[R.MUSCLE_STIFFENING], 0.0)
        + count_on(fixed[R.MUSCLE_LOAD_CURVE], 0.0)
        + count_on(fixed[R.MUSCLE_LOAD_STIFFENING], 0.0)
        + count_on(fixed[R.MUSCLE_LOAD_STIFFENING_2], 0.0)
        + count_on(fixed[R.MUSCLE_LOAD_STIFFENING_ROOT], 0.0)
        + count_on(fixed[R.HYSTERESIS_FIRST_STIFFNESS], 0.0)
        + count_on(fixed[R.MUSCLE_VISCOSITY], 0.0)
        + count_on(fixed[R.MUSCLE_VISCOSITY_PER_PRESSURE], 0.0)
        + count_on(fixed[R.MASS_LOAD_ERROR], 0.0)
        + count_on(fixed[R.MASS_SLACK], 0.0)
    )


@kernel
def plain_pull(
    rows: Any, fixed: Any, j: int, was: float, x: float, own: Any
) -> tuple[float, float, float, float, float, float, float]:
    """Return :func:`finer_pull` where no finer term is on: the same bits by fewer operations.

    Rows 8 and 9 of ``own`` are 1 / rest length [1/m] and braid force / strain [N].
    """
    e = x * own[8][j]
    slack, load = decay(e / fixed[R.MUSCLE_BRAID_STRAIN][j]), rows[R.LOAD][j]
    area, taper = fixed[R.MUSCLE_AREA][j], fixed[R.MUSCLE_AREA_TAPER][j]
    force, k1, k3 = (
        fixed[R.MUSCLE_BRAID_FORCE][j],
        fixed[R.MUSCLE_STIFFNESS][j],
        fixed[R.MUSCLE_HARDENING][j],
    )
    middle = 0.5 * (was + rows[R.DRIVE][j])
    pull = tension(was, e, slack, area, taper, force, k1, k3)
    slope = tension_slope(middle, e, slack, area, taper, own[9][j], k1, k3)
    damping, grown = fixed[R.MASS_DAMPING][j], area * (1.0 - taper * e)
    return pull, slope, load, load * GRAVITY, 0.0, damping, grown


@kernel
def finer_pull(
    rows: Any, fixed: Any, j: int, was: float, x: float
) -> tuple[float, float, float, float, float, float, float]:
    """Return force [N] and slope [N] of the law at a predicted contraction [m], with all terms.

    Then the mass of the load [kg], its weight that hangs [N] and that weight's slope [N], the
    damping [N s/m], and the growth of the force with the effective pressure [m2]. The pressure goes
    from ``was`` to the present one.
    """
    length = fixed[R.MUSCLE_REST_LENGTH][j]
    mass, weight, stiffer, shift = carried(fixed, j, rows[R.LOAD][j])
    e = x * (1.0 / length)
    middle = 0.5 * (was + rows[R.DRIVE][j]) - shift
    pull, slope = law_of(fixed, j, was - shift, middle, e, stiffer)
    first = first_stiffening(rows, fixed, j)
    pull, slope = pull - first * e, slope + first
    hangs, rising = hanging_share(fixed, j, x, rows[EFFECTS_AT + S.hangs][j])
    eased = weight * length * rising
    loss = fixed[R.MASS_DAMPING][j] + viscous_damping(
        fixed[R.MUSCLE_VISCOSITY][j],
        fixed[R.MUSCLE_VISCOSITY_SPEED][j],
        fixed[R.MUSCLE_VISCOSITY_PER_PRESSURE][j],
        fixed[R.MUSCLE_VISCOSITY_RELAXING][j],
        rows[R.VELOCITY][j],
        middle,
    )
    taper = fixed[R.MUSCLE_AREA_TAPER][j] + fixed[R.MUSCLE_AREA_CURVE][j] * e
    area = fixed[R.MUSCLE_AREA][j] * (1.0 - taper * e)
    return pull, slope, mass, weight * hangs, eased, loss, area


@kernel
def mapped_pull(
    rows: Any, fixed: Any, j: int, was: float, x: float
) -> tuple[float, float, float, float, float, float, float]:
    """Return :func:`finer_pull` with the map of the static law."""
    pull, slope, mass, hung, eased, loss, area = finer_pull(rows, fixed, j, was, x)
    _, _, _, shift = carried(fixed, j, rows[R.LOAD][j])
    e = x / fixed[R.MUSCLE_REST_LENGTH][j]
    middle = 0.5 * (was + rows[R.DRIVE][j]) - shift
    more = map_force(fixed, j, R.MUSCLE_MAP_05, was - shift, e)
    steeper, wider = map_slopes(fixed, j, R.MUSCLE_MAP_05, middle, e)
    return pull + more, slope + steeper, mass, hung, eased, loss, area + wider


@kernel
def forces(
    rows: Any, fixed: Any, was: Any, h: float, own: Any, strands: int, deflects: int, finer: int,
    maps: int,
) -> None:  # fmt: skip
    """Write the linearised motion of a tile, the effective pressure going from ``was``.

    Rows 3 to 7 of ``own``, per unit mass: stiffness, push at the predicted middle, jerk, damping,
    and one over the mass [1/kg]. Rows 8 and 9 are constant (:func:`plain_pull`).
    """
    x, v = rows[R.CONTRACTION], rows[R.VELOCITY]
    friction, sticking, strain = own[0], own[1], own[3]
    for j in range(LANES):
        friction[j] = 0.0
        sticking[j] = 0.0
    if strands > 0:
        for j in range(LANES):
            strain[j] = (x[j] + 0.5 * h * v[j]) / fixed[R.MUSCLE_REST_LENGTH][j]
        strand_forces(
            rows, fixed, EFFECTS_AT + S.strands, R.MUSCLE_STRAND_1, R.MUSCLE_STRAND_BREAK, strain,
            rows[R.DRIVE], friction, sticking,
        )  # fmt: skip
    if deflects > 0:
        for j in range(LANES):
            strain[j] = 0.5 * h * v[j] / fixed[R.MUSCLE_REST_LENGTH][j]
        yield_forces(
            rows, fixed, EFFECTS_AT + S.deflection, R.MUSCLE_YIELD_FORCE, strain, rows[R.DRIVE],
            friction, sticking,
        )  # fmt: skip
    if strands + deflects > 0:
        for j in range(LANES):
            wide = friction_factor(rows, fixed, j)
            friction[j] = friction[j] * wide
            sticking[j] = sticking[j] * wide
    if maps > 0:
        for j in range(LANES):
            found = mapped_pull(rows, fixed, j, was[j], x[j] + 0.5 * h * v[j])
            write_motion(rows, fixed, j, was[j], h, own, *found)
    elif finer > 0:
        for j in range(LANES):
            found = finer_pull(rows, fixed, j, was[j], x[j] + 0.5 * h * v[j])
            write_motion(rows, fixed, j, was[j], h, own, *found)
    else:
        for j in range(LANES):
            found = plain_pull(rows, fixed, j, was[j], x[j] + 0.5 * h * v[j], own)
            write_motion(rows, fixed, j, was[j], h, own, *found)


@kernel
def write_motion(
    rows: Any, fixed: Any, j: int, was: float, h: float, own: Any, pull: float, slope: float,
    mass: float, hung: float, eased: float, loss: float, area: float,
) -> None:  # fmt: skip
    """Write the linearised motion of lane ``j`` (:func:`forces`); see :func:`finer_pull`."""
    rub = fixed[R.HYSTERESIS_FRICTION][j]
    pull, slope = pull - own[0][j], slope + own[1][j]
    pull, slope = pull - rub * rows[R.LAG][j], slope + rub * rows[R.STICK][j]
    slope = slope + eased
    stiff = slope * own[8][j] + air_stiffness(rows, j, EFFECTS_AT + S.air)
    moved = max(0.0, mass) * fixed[R.MASS_CARRIED][j] + fixed[R.MASS_MOVING_MASS][j]
    # motion that is over within the sub-step is followed as slowly as the series reaches
    per_mass = 1.0 / max(moved, loss * h * FASTEST_DECAY, stiff * h * h * FASTEST_TURN)
    own[3][j] = stiff * per_mass
    own[4][j] = (pull - hung) * per_mass
    own[5][j] = area * (rows[R.DRIVE][j] - was) * per_mass / h
    own[6][j] = per_mass * loss
    own[7][j] = per_mass


@kernel
def move(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, was: Any,
    h: float, own: Any, strands: int, deflects: int, sticks: int, mounts: int, stretches: int,
    finer: int, maps: int,
) -> None:  # fmt: skip
    """Move the load of a tile for ``h`` seconds, the effective pressure going from ``was``."""
    x, v, stuck = rows[R.CONTRACTION], rows[R.VELOCITY], rows[EFFECTS_AT + S.stuck]
    before, width = own[0], own[1]
    springs, pushes, jerks, drags, lightness = own[3], own[4], own[5], own[6], own[7]
    hysteresis_ahead(rows, fixed, counts, table, hysteresis, 0, LANES, elements, 0.5 * h)
    forces(rows, fixed, was, h, own, strands, deflects, finer, maps)
    for j in range(LANES if deflects > 0 else 0):
        before[j] = x[j]
    if sticks > 0:
        for j in range(LANES):
            dx, v[j], stuck[j] = stick_slip_step(
                v[j], stuck[j], pushes[j], jerks[j], springs[j], drags[j],
                fixed[R.MASS_STICK][j] * lightness[j], fixed[R.MASS_STICK_KINETIC][j],
                fixed[R.MASS_STICK_SPEED][j], h,
            )  # fmt: skip
            x[j] = x[j] + dx
    else:
        for j in range(LANES):
            k, drag = springs[j], drags[j]
            a = pushes[j] + 0.5 * k * h * v[j]
            dx, v[j] = damped_motion(v[j], a, jerks[j], k, drag, decay(0.5 * drag * h), h)
            x[j] = x[j] + dx
    hysteresis_moved(rows, fixed, counts, table, hysteresis, 0, LANES, elements, 0.0)
    if strands > 0:
        for j in range(LANES):
            width[j] = x[j] / fixed[R.MUSCLE_REST_LENGTH][j]
        slip_strands(
            rows, fixed, EFFECTS_AT + S.strands, R.MUSCLE_STRAND_BREAK, width, rows[R.DRIVE]
        )
    if deflects > 0:
        for j in range(LANES):
            width[j] = (x[j] - before[j]) / fixed[R.MUSCLE_REST_LENGTH][j]
        yield_deflections(
            rows, fixed, EFFECTS_AT + S.deflection, R.MUSCLE_YIELD_FORCE, width, rows[R.DRIVE]
        )
    shown = rows[EFFECTS_AT + S.shown]
    for j in range(LANES):
        before[j] = shown[j]
        shown[j] = x[j]
        width[j] = h
    if stretches > 0:
        left = scratch(4, LANES)
        creep_left(fixed, R.MUSCLE_CREEP_1, R.HYSTERESIS_CREEP_TIME_1, 0, LANES, width, left)
        creep_step(rows, fixed, EFFECTS_AT + S.stretch, R.MUSCLE_CREEP_1, 0, LANES, x, left, shown)
    for j in range(LANES):
        rows[EFFECTS_AT + S.position][j] = shown[j] - rows[R.REST][j]
    if mounts > 0:
        for j in range(LANES):
            position = mount_step(
                rows, j, EFFECTS_AT + S.mount, before[j], shown[j], fixed[R.MASS_RING_SHARE][j],
                fixed[R.MASS_RING_FREQUENCY][j], fixed[R.MASS_RING_DAMPING][j], h,
            )  # fmt: skip
            rows[EFFECTS_AT + S.position][j] = position - rows[R.REST][j]


@kernel
def lead_pressures(
    rows: Any, fixed: Any, i: int, h: float, valve: int, older: Any, newer: Any, width: Any,
    own: Any, work: Any,
) -> None:  # fmt: skip
    """Write the pressures of a tile at the end of sub-step ``i``, each interval in one pass.

    The regulators are one interval ahead of the lanes whose setpoint has not yet switched.
    """
    pressure, travel = rows[R.PRESSURE], rows[EFFECTS_AT + S.travel]
    at, late, target, ahead, before = work[10], work[11], work[12], work[13], work[14]
    for n in range(0 if i == 0 else i + 1, i + 2):
        interval_of(n, at, late, older, newer, h, target, width)
        given = ahead if n > 0 else pressure
        for j in range(LANES):
            before[j] = given[j]
        for j in range(LANES):
            ahead[j] = before[j]
        air_step(
            rows, fixed, EFFECTS_AT + S.air, R.EFFECT.regulator, ahead,
            fixed[R.REGULATOR_MAX_PRESSURE], fixed[R.REGULATOR_TIME_CONSTANT],
            fixed[R.REGULATOR_SLEW_RATE], target, width, own, valve, 0,
        )  # fmt: skip
        for j in range(LANES):
            travel[j] += abs(ahead[j] - own[1][j])
    for j in range(LANES):
        last, earlier = ahead[j], before[j]
        pressure[j] = last if at[j] <= i else earlier


@kernel
def advance_extended(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, substeps: int,
    period: float, work: Any,
) -> None:  # fmt: skip
    """Advance a tile by control period ``counts[STEP]``, with all effects."""
    h = period / substeps
    drive, load = rows[R.DRIVE], rows[R.LOAD]
    older, newer, switch, was, width = work[3], work[4], work[5], work[6], work[7]
    late = work[8]
    own, left = scratch(10, LANES), scratch(4, LANES)
    air, effects, shift, end = EFFECTS_AT + S.air, R.EFFECT.regulator, work[9], own[2]
    flows, creeps = flows_on(fixed, effects), creeps_on(fixed, R.HYSTERESIS_CREEP_1)
    stretches = creeps_on(fixed, R.MUSCLE_CREEP_1)
    lines, valve = line_effects_on(fixed, effects), valve_effects_on(fixed, effects)
    mounts = count_on(fixed[R.MASS_RING_SHARE], 0.0)
    worn = (
        count_on(fixed[R.HYSTERESIS_SHAPE], 1.0)
        + count_on(fixed[R.HYSTERESIS_PRESSURE_SLOPE], 0.0)
        + count_on(fixed[R.HYSTERESIS_PRESSURE_BEND], 0.0)
        + count_on(fixed[R.HYSTERESIS_FIRST_WIDTH], 0.0)
        + count_on(fixed[R.HYSTERESIS_FIRST_LOSS], 0.0)
        + count_on(fixed[R.MUSCLE_TEMPERATURE_GAIN], 0.0)
    )
    strands, sticks = strands_on(fixed, R.MUSCLE_STRAND_1), count_on(fixed[R.MASS_STICK], 0.0)
    yields = count_on(fixed[R.HYSTERESIS_YIELD_WIDTH], 0.0)
    deflects = count_on(fixed[R.MUSCLE_YIELD_FORCE], 0.0)
    maps = map_on(fixed, R.MUSCLE_MAP_05)
    fine = sticks + count_on(fixed[R.MUSCLE_VISCOSITY], 0.0)
    fine = fine + count_on(fixed[R.MUSCLE_VISCOSITY_RELAXING], 1.0)
    parts, finer = FINE_PARTS if fine > 0 else 1, finer_terms_on(fixed)
    for j in range(LANES):
        if load[j] != rows[EFFECTS_AT + S.hung][j]:
            rows[EFFECTS_AT + S.hung][j] = load[j]
            rows[EFFECTS_AT + S.hangs][j] = balance(fixed, j, 0.0, load[j], NO_SUPPORT)
    delay_commands(
        rows, R.HISTORY, rows[R.SET_POINT], fixed[R.REGULATOR_DEAD_TIME], counts[R.STEP], period,
        older, newer, switch,
    )  # fmt: skip
    begin_leak(rows, air)
    for j in range(LANES):
        width[j] = h
        own[8][j] = 1.0 / fixed[R.MUSCLE_REST_LENGTH][j]
        own[9][j] = fixed[R.MUSCLE_BRAID_FORCE][j] / fixed[R.MUSCLE_BRAID_STRAIN][j]
    creep_left(fixed, R.HYSTERESIS_CREEP_1, R.HYSTERESIS_CREEP_TIME_1, 0, LANES, width, left)
    # pressures that follow from the setpoints alone are one interval ahead of the motion
    leads = 1 if STAGED + flows + lines + worn + yields == 0 else 0
    if leads > 0:
        switch_substeps(switch, substeps, period, work[10], work[11])
    for i in range(substeps):
        if leads > 0:
            lead_pressures(rows, fixed, i, h, valve, older, newer, width, own, work)
        late_shares(switch, i, substeps, period, late)
        if flows > 0:
            squeeze_muscle(rows, fixed, AHEAD, shift)
        for j in range(LANES):
            was[j] = drive[j]
        if flows > 0:
            flow_step(
                rows, fixed, air, effects, rows[R.PRESSURE], older, newer, late, h, own, valve,
                lines,
            )  # fmt: skip
            for j in range(LANES):
                rows[EFFECTS_AT + S.travel][j] += abs(rows[R.PRESSURE][j] - own[1][j])
        for stage in range(0 if flows == LANES or leads > 0 else 2):  # older, then newer setpoint
            if stage_widths(late, stage, h, width) == 0:
                continue
            if flows > 0:
                without_flow(fixed, effects, width)
            air_step(
                rows, fixed, air, effects, rows[R.PRESSURE],
                fixed[R.REGULATOR_MAX_PRESSURE], fixed[R.REGULATOR_TIME_CONSTANT],
                fixed[R.REGULATOR_SLEW_RATE], newer if stage == 1 else older, width, own, valve,
                lines,
            )  # fmt: skip
            for j in range(LANES):
                rows[EFFECTS_AT + S.travel][j] += abs(rows[R.PRESSURE][j] - own[1][j])
            if STAGED > 0:
                creep_left(
                    fixed, R.HYSTERESIS_CREEP_1, R.HYSTERESIS_CREEP_TIME_1, 0, LANES, width, left
                )
                effective_pressure(
                    rows, fixed, counts, table, hysteresis, 0, LANES, elements, work, left, own,
                    creeps, worn, yields,
                )  # fmt: skip
            elif yields > 0:
                yield_to_pressure(rows, fixed, 0, LANES, own)
        if STAGED > 0 and flows > 0:
            for j in range(LANES):
                width[j] = h if fixed[effects + AIR.flow][j] > 0.0 else 0.0
            creep_left(
                fixed, R.HYSTERESIS_CREEP_1, R.HYSTERESIS_CREEP_TIME_1, 0, LANES, width, left
            )
        if STAGED == 0 or flows > 0:
            effective_pressure(
                rows, fixed, counts, table, hysteresis, 0, LANES, elements, work, left, own,
                creeps, worn, yields,
            )  # fmt: skip
        for j in range(LANES):
            end[j] = drive[j]
        for q in range(parts):
            if q > 0 and flows > 0:
                squeeze_muscle(rows, fixed, AHEAD, shift)
                for j in range(LANES):
                    was[j] = drive[j]
                    end[j] = end[j] + shift[j]
            if parts - q > 1:
                for j in range(LANES):
                    drive[j] = was[j] + (end[j] - was[j]) / (parts - q)
            else:
                for j in range(LANES):
                    drive[j] = was[j] + (end[j] - was[j])
            move(
                rows, fixed, counts, table, hysteresis, elements, was, h / parts, own, strands,
                deflects, sticks, mounts, stretches, finer, maps,
            )  # fmt: skip
            if flows > 0:
                for j in range(LANES):
                    enclose_air(rows, fixed, j, 0.5 * h / parts * rows[R.VELOCITY][j])
                squeeze_muscle(rows, fixed, REACHED, shift)
                for j in range(LANES):
                    end[j] = end[j] + shift[j]
            for j in range(LANES):
                was[j] = drive[j]
    read_with_effects(rows, fixed, counts[R.STEP], period)


def replacements(kind: str, first: int) -> dict[str, Any]:
    """Return the kernels of the extended plant; ``first`` is the row after the hysteresis state."""
    measured = (first + S.position, R.PRESSURE)
    effects = (R.EFFECT.position, R.EFFECT.pressure)
    return {
        **effect_kernels(first, R, measured, effects, ()),
        "full_scale": full_scale,
        **hysteresis_kernels(kind, "plain_hysteresis"),
        "write_drive": settled,
        "advance": advance_extended,
        "rest_contraction": rest_extended,
        "excess_pull": excess_pull,
        "hang_load": hang_load,
        "begin_effects": begin_effects,
        "true_position": true_position,
        "seen_position": seen_position,
        "seen_pressure": seen_pressure,
        "lost_pressure": lost_pressure,
    }
