"""One control period of the single muscle, for one environment or a tile of them.

The sub-step: the regulator's pressure is exact at its end; a hysteresis driven by pressure is then
exact too, because within a sub-step the pressure is monotone, and friction driven by length is
evaluated at the predicted mid-point and moved to the contraction reached; the motion is exact for
the force linearised about that mid-point with the effective pressure going straight from its old to
its new value. So the step is of second order and has no stability limit from the stiffness of a
light load.
"""

from typing import Any

from pam_envs.constants import GRAVITY
from pam_envs.kernels.arithmetic import decay
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.motion import damped_motion
from pam_envs.muscle.effective_area import tension, tension_slope
from pam_envs.plants.single_muscle import rows as R
from pam_envs.pneumatics.regulator import delay_commands, late_shares, regulator_step, stage_widths

# placeholders, see hysteresis_kernels
write_drive: Any = None
hysteresis_ahead: Any = None
hysteresis_moved: Any = None
start_friction: Any = None
hysteresis_begin: Any = None


@kernel
def advance(
    rows: Any,
    fixed: Any,
    counts: Any,
    table: Any,
    hysteresis: int,
    elements: int,
    substeps: int,
    period: float,
    work: Any,
) -> None:
    """Advance a tile by control period ``counts[STEP]``, towards its setpoints."""
    h = period / substeps
    x, v, pressure, drive = rows[R.CONTRACTION], rows[R.VELOCITY], rows[R.PRESSURE], rows[R.DRIVE]
    load, moving, damping, dead = (
        rows[R.LOAD],
        fixed[R.MASS_MOVING_MASS],
        fixed[R.MASS_DAMPING],
        fixed[R.REGULATOR_DEAD_TIME],
    )
    lag, slew, length, area = (
        fixed[R.REGULATOR_TIME_CONSTANT],
        fixed[R.REGULATOR_SLEW_RATE],
        fixed[R.MUSCLE_REST_LENGTH],
        fixed[R.MUSCLE_AREA],
    )
    taper, force, k1, k3 = (
        fixed[R.MUSCLE_AREA_TAPER],
        fixed[R.MUSCLE_BRAID_FORCE],
        fixed[R.MUSCLE_STIFFNESS],
        fixed[R.MUSCLE_HARDENING],
    )
    braid_strain, rub = fixed[R.MUSCLE_BRAID_STRAIN], fixed[R.HYSTERESIS_FRICTION]
    older, newer, switch, was, damped = work[3], work[4], work[5], work[6], work[7]
    per_lag, per_slew, per_mass, per_length = work[8], work[9], work[10], work[11]
    per_strain, per_jerk, drag, late, width = work[12], work[13], work[14], work[15], work[16]
    delay_commands(
        rows, R.HISTORY, rows[R.SET_POINT], dead, counts[R.STEP], period, older, newer, switch
    )
    for j in range(LANES):
        per_lag[j] = 1.0 / lag[j]
        per_slew[j] = 1.0 / slew[j]
        per_length[j] = 1.0 / length[j]
        per_strain[j] = 1.0 / braid_strain[j]
        per_mass[j] = 1.0 / (load[j] + moving[j])
        per_jerk[j] = per_mass[j] / h
        drag[j] = damping[j] * per_mass[j]
        damped[j] = decay(0.5 * drag[j] * h)
    for i in range(substeps):
        late_shares(switch, i, substeps, period, late)
        for j in range(LANES):
            was[j] = drive[j]
        for stage in range(2):  # towards the older setpoint, then towards the newer one
            if stage_widths(late, stage, h, width) == 0:
                continue
            for j in range(LANES):
                target = newer[j] if stage == 1 else older[j]
                reached = regulator_step(
                    pressure[j], target, lag[j], per_lag[j], slew[j], per_slew[j], width[j]
                )
                pressure[j] = reached if width[j] > 0.0 else pressure[j]
            write_drive(rows, fixed, counts, table, hysteresis, 0, LANES, elements, work)
        hysteresis_ahead(rows, fixed, counts, table, hysteresis, 0, LANES, elements, 0.5 * h)
        for j in range(LANES):
            ahead = 0.5 * h * v[j]
            e = (x[j] + ahead) * per_length[j]
            slack = decay(e * per_strain[j])
            pull = tension(was[j], e, slack, area[j], taper[j], force[j], k1[j], k3[j])
            slope = tension_slope(
                0.5 * (was[j] + drive[j]),
                e,
                slack,
                area[j],
                taper[j],
                force[j] * per_strain[j],
                k1[j],
                k3[j],
            )
            pull = pull - rub[j] * rows[R.LAG][j]
            slope = slope + rub[j] * rows[R.STICK][j]
            k = slope * per_length[j] * per_mass[j]
            a = (pull - load[j] * GRAVITY) * per_mass[j] + k * ahead
            jerk = area[j] * (1.0 - taper[j] * e) * (drive[j] - was[j]) * per_jerk[j]
            dx, v[j] = damped_motion(v[j], a, jerk, k, drag[j], damped[j], h)
            x[j] = x[j] + dx
        hysteresis_moved(rows, fixed, counts, table, hysteresis, 0, LANES, elements, 0.0)


@kernel
def true_position(rows: Any, j: int) -> float:
    """Return the position [m] of the load of lane ``j``, from its rest position."""
    return rows[R.CONTRACTION][j] - rows[R.REST][j]  # type: ignore[no-any-return]


@kernel
def seen_position(rows: Any, j: int) -> float:
    """Return the undisturbed reading of the position sensor [m]."""
    return rows[R.CONTRACTION][j] - rows[R.REST][j]  # type: ignore[no-any-return]


@kernel
def seen_pressure(rows: Any, j: int) -> float:
    """Return the undisturbed reading of the pressure sensor [Pa]."""
    return rows[R.PRESSURE][j]  # type: ignore[no-any-return]


@kernel
def lost_pressure(rows: Any, j: int) -> float:
    """Return the pressure [Pa] that leaked in this control period: a plain plant has no leak."""
    return 0.0


@kernel
def begin_effects(rows: Any, fixed: Any, j: int) -> None:
    """Begin the effects: a plain plant has none."""


N_WORK = 17
"""Rows of scratch that :func:`advance` needs."""


@kernel
def pull_of(fixed: Any, lane: int, drive: float, e: float) -> float:
    """Return the force of the law [N] at an effective pressure [Pa] and a strain."""
    return tension(
        drive,
        e,
        decay(e / fixed[R.MUSCLE_BRAID_STRAIN][lane]),
        fixed[R.MUSCLE_AREA][lane],
        fixed[R.MUSCLE_AREA_TAPER][lane],
        fixed[R.MUSCLE_BRAID_FORCE][lane],
        fixed[R.MUSCLE_STIFFNESS][lane],
        fixed[R.MUSCLE_HARDENING][lane],
    )


@routine
def rest_contraction(fixed: Any, lane: int, drive: float, load: float) -> float:
    """Return the contraction [m] at rest without friction, by bisection to rounding."""
    length = fixed[R.MUSCLE_REST_LENGTH][lane]
    low, high = -0.3, 0.6
    for _ in range(56):
        e = 0.5 * (low + high)
        if pull_of(fixed, lane, drive, e) > load * GRAVITY:
            low = e
        else:
            high = e
    return 0.5 * (low + high) * length


@kernel
def excess_pull(rows: Any, fixed: Any, j: int, e: float) -> float:
    """Return the force [N] of one lane at a strain beyond the load's weight."""
    return pull_of(fixed, j, rows[R.DRIVE][j], e) - rows[R.LOAD][j] * GRAVITY  # type: ignore[no-any-return]


@kernel
def hang_load(rows: Any, fixed: Any, j: int) -> None:
    """Do nothing: the load of a plain plant always hangs freely."""


@routine
def begin_rest(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int
) -> None:
    """Put one lane at its position of rest without pressure, free of friction."""
    rows[R.CONTRACTION][j], rows[R.VELOCITY][j] = rows[R.REST][j], 0.0
    hysteresis_begin(
        rows, fixed, counts, table, elements, hysteresis, R.MODEL, R.STACK_COUNT, R.MEMBER, j
    )
    start_friction(rows, fixed, hysteresis, elements, j)
    hang_load(rows, fixed, j)


@routine
def slide_to_rest(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int
) -> None:
    """Put one lane at rest at its effective pressure and load, by bisection, with its friction.

    The friction is that of motion straight from the contraction before.
    """
    length = fixed[R.MUSCLE_REST_LENGTH][j]
    low, high = -0.3, 0.6
    for _ in range(56):
        e = 0.5 * (low + high)
        rows[R.CONTRACTION][j] = e * length
        hysteresis_ahead(rows, fixed, counts, table, hysteresis, j, j + 1, elements, 0.0)
        rub = fixed[R.HYSTERESIS_FRICTION][j] * rows[R.LAG][j]
        if excess_pull(rows, fixed, j, e) > rub:
            low = e
        else:
            high = e
    rows[R.CONTRACTION][j] = 0.5 * (low + high) * length
    hysteresis_moved(rows, fixed, counts, table, hysteresis, j, j + 1, elements, 0.0)
