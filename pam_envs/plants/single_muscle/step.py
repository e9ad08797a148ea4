"""One control period of the single muscle, for one environment or a tile of them.

The sub-step: the regulator's pressure is exact at its end; the hysteresis, which depends only on
the pressures passed through, is then exact too, because within a sub-step the pressure is monotone;
the motion is exact for the force linearised about the predicted mid-point with the effective
pressure going straight from its old to its new value. So the step is of second order and has no
stability limit from the stiffness of a light load. The effective pressure is that of a hysteresis
model between two scales of the pressure.
"""

from __future__ import annotations

import math
from typing import Any

from pam_envs.constants import GRAVITY
from pam_envs.hysteresis import protocol
from pam_envs.kernels.arithmetic import decay
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.history import N_HISTORY
from pam_envs.kernels.motion import damped_motion
from pam_envs.muscle.effective_area import tension, tension_slope
from pam_envs.plants.single_muscle import rows as R
from pam_envs.pneumatics.regulator import DELAY_PERIODS, delayed_fraction, regulator_step

# placeholders, see hysteresis_kernels
write_drive: Any = None
hysteresis_step: Any = None


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
    braid_strain, set_point, step = fixed[R.MUSCLE_BRAID_STRAIN], rows[R.SET_POINT], counts[R.STEP]
    older, newer, switch, was, damped = work[3], work[4], work[5], work[6], work[7]
    per_lag, per_slew, per_mass, per_length = work[8], work[9], work[10], work[11]
    per_strain, per_jerk, drag, late, width = work[12], work[13], work[14], work[15], work[16]
    for j in range(LANES):
        age = dead[j] / period
        whole = min(int(age), DELAY_PERIODS)
        switch[j] = (age - whole) * period
        now = step[j]
        rows[R.HISTORY + (now & (N_HISTORY - 1))][j] = set_point[j]
        newer[j] = rows[R.HISTORY + ((now + N_HISTORY - whole) & (N_HISTORY - 1))][j]
        older[j] = rows[R.HISTORY + ((now + N_HISTORY - whole - 1) & (N_HISTORY - 1))][j]
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
        for j in range(LANES):
            late[j] = delayed_fraction((i + 1) * h, substeps / period, switch[j])
            was[j] = drive[j]
        for stage in range(2):  # towards the older setpoint, then towards the newer one
            busy = 0
            for j in range(LANES):
                width[j] = h * (late[j] if stage == 1 else 1.0 - late[j])
                busy = busy + (1 if width[j] > 0.0 else 0)
            if busy == 0:
                continue
            for j in range(LANES):
                target = newer[j] if stage == 1 else older[j]
                reached = regulator_step(
                    pressure[j], target, lag[j], per_lag[j], slew[j], per_slew[j], width[j]
                )
                pressure[j] = reached if width[j] > 0.0 else pressure[j]
            write_drive(rows, fixed, counts, table, hysteresis, 0, LANES, elements, work)
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
            k = slope * per_length[j] * per_mass[j]
            a = (pull - load[j] * GRAVITY) * per_mass[j] + k * ahead
            jerk = area[j] * (1.0 - taper[j] * e) * (drive[j] - was[j]) * per_jerk[j]
            dx, v[j] = damped_motion(v[j], a, jerk, k, drag[j], damped[j], h)
            x[j] = x[j] + dx


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
def begin_effects(rows: Any, fixed: Any, j: int) -> None:
    """Begin the effects: a plain plant has none."""


N_WORK = 17
"""Rows of scratch that :func:`advance` needs."""


@routine
def rest_contraction(fixed: Any, lane: int, drive: float, load: float) -> float:
    """Return the contraction [m] at rest, by bisection to the last bit that matters."""
    length = fixed[R.MUSCLE_REST_LENGTH][lane]
    low, high = -0.3, 0.6
    for _ in range(56):
        e = 0.5 * (low + high)
        pull = tension(
            drive,
            e,
            decay(e / fixed[R.MUSCLE_BRAID_STRAIN][lane]),
            fixed[R.MUSCLE_AREA][lane],
            fixed[R.MUSCLE_AREA_TAPER][lane],
            fixed[R.MUSCLE_BRAID_FORCE][lane],
            fixed[R.MUSCLE_STIFFNESS][lane],
            fixed[R.MUSCLE_HARDENING][lane],
        )
        if pull > load * GRAVITY:
            low = e
        else:
            high = e
    return 0.5 * (low + high) * length


@kernel
def stretched(pressure: float, stretch: float, per_full: float) -> float:
    """Return the pressure on the scale on which the friction is uniform.

    ``g(p) = p (1 + b (1 - p / P))``: with ``b > 0`` the loop is wider at high pressure.
    ``per_full`` is ``1 / P``.
    """
    return pressure * (1.0 + stretch * (1.0 - pressure * per_full))


@kernel
def unstretched(value: float, stretch: float, per_full: float) -> float:
    """Return the pressure whose stretched value is ``value``."""
    s = 1.0 + stretch
    return 2.0 * value / (s + math.sqrt(max(0.0, s * s - 4.0 * stretch * value * per_full)))


@kernel
def loop_width(width_per_load: float, load: float) -> float:
    """Return the factor on the hysteretic part at this load, from 0 to 1.2."""
    return max(0.0, min(1.2, 1.0 + width_per_load * load))


@kernel
def pressure_itself(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, first: int, last: int,
    elements: int, work: Any,
) -> None:  # fmt: skip
    """Write the pressure as effective pressure."""
    pressure, drive = rows[R.PRESSURE], rows[R.DRIVE]
    for j in range(first, last):
        drive[j] = pressure[j]


@kernel
def effective_pressure(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, first: int, last: int,
    elements: int, work: Any,
) -> None:  # fmt: skip
    """Write the effective pressure by a hysteresis model on the stretched scale."""
    pressure, drive, stretch, full = (
        rows[R.PRESSURE],
        rows[R.DRIVE],
        fixed[R.HYSTERESIS_STRETCH],
        fixed[R.REGULATOR_MAX_PRESSURE],
    )
    load, per_load = rows[R.LOAD], fixed[R.HYSTERESIS_WIDTH_PER_LOAD]
    inputs, output, per_full = work[0], work[1], work[2]
    for j in range(first, last):
        per_full[j] = 1.0 / full[j]
        inputs[j] = stretched(pressure[j], stretch[j], per_full[j])
    hysteresis_step(
        inputs, output, rows, fixed, counts, table, elements, hysteresis, R.MODEL, R.STACK_COUNT,
        R.MEMBER, first, last,
    )  # fmt: skip
    for j in range(first, last):
        friction = inputs[j] - output[j]
        value = inputs[j] - loop_width(per_load[j], load[j]) * friction
        drive[j] = unstretched(value, stretch[j], per_full[j])


def hysteresis_kernels(kind: str, name: str = "write_drive") -> dict[str, Any]:
    """Return the kernels of a kind; ``name`` is the plant's placeholder for the whole."""
    identity = protocol.model_of(kind).identity
    return protocol.kernels(kind) | {name: pressure_itself if identity else effective_pressure}
