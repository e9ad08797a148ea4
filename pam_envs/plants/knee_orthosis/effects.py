"""Effects of the knee orthosis: kernels that replace the placeholders.

The muscle has the effects of its path (those of the air only behind the regulator's lag); the
hysteresis turns the effective pressure into stiffness, and a correction of the law depends on
effective pressure and length. Yielding friction and a viscous force resist its contraction. The
bearing of the brace without a leg sticks and slips, and all sensors have their effects.
"""

from typing import Any

from pam_envs.constants import DENSITY_PER_PRESSURE
from pam_envs.kernels.arithmetic import count_on, sine_and_cosine
from pam_envs.kernels.build import LANES, kernel, scratch
from pam_envs.kernels.yielding import deflected_with_tail
from pam_envs.mechanics.knee_lever import muscle_length
from pam_envs.muscle.effects import taut_damping, yield_spring
from pam_envs.muscle.gas_spring import gas_volume, stretch_of
from pam_envs.muscle.law_correction import correction_force, correction_slope
from pam_envs.plants.core.muscle_path import (
    PATH_STATE,
    begin_path,
    path_air,
    path_muscle,
    path_squeeze,
)
from pam_envs.plants.core.sensors import effect_kernels
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.motion import tension_of
from pam_envs.pneumatics.enclosed_air import AHEAD, REACHED, air_stiffness, enclose, flows_on
from pam_envs.pneumatics.regulator import AIR, AIR_STATE

EFFECTS_AT = 0  # placeholder: the row after the hysteresis state
plain_regulate: Any = None  # placeholders: the dynamics of the pressure of the plain plant, and the
angle_ahead: Any = None  # predicted angle

MEASURED = (K.TENSION, K.ANGLE, K.PRESSURE, K.HEEL, K.GROUND_Z, K.COP, K.ANKLE)
"""Rows of the quantities that ``SENSORS`` measure."""
FULL_SCALES = (300.0, 3.2, 4.5e5, 50.0, 1e3, 0.3, 1.0)
"""Full scales of the sensors: N, rad, Pa, kg, N, m, rad."""


@kernel
def regulate_with_lag(
    rows: Any, fixed: Any, counts: Any, i: int, substeps: int, period: float
) -> None:
    """Advance the pressures of a tile behind the lag of the regulator, with all effects."""
    squeeze_muscle(rows, fixed, AHEAD)
    path_air(
        rows, fixed, EFFECTS_AT + K.STATE.path, K.EFFECT.path, K.DELAY, K.REGULATOR_MAX_PRESSURE,
        rows[K.PRESSURE], rows[K.SET_POINT], counts[K.STEP], i, substeps, period,
    )  # fmt: skip
    advance_muscle(rows, fixed, period / substeps)


@kernel
def squeeze_muscle(rows: Any, fixed: Any, share: float) -> None:
    """Move the enclosed air of a tile with the motion, where air flows (:func:`path_squeeze`).

    The stiffness changes with the effective pressure as without hysteresis.
    """
    if flows_on(fixed, K.EFFECT.path) == 0:
        return
    effective, beyond, stiffness, was = (
        rows[EFFECTS_AT + K.STATE.effective],
        rows[EFFECTS_AT + K.STATE.beyond],
        rows[K.STIFFNESS],
        scratch(1, LANES),
    )
    for j in range(LANES):
        effective[j] = effective[j] + beyond[j]
        was[0][j] = effective[j]
    path_squeeze(
        rows, fixed, EFFECTS_AT + K.STATE.path, K.EFFECT.path, rows[K.PRESSURE], effective, share
    )
    for j in range(LANES):
        gain = fixed[K.MUSCLE_GAIN][j] * fixed[K.MUSCLE_STIFFNESS_RATIO][j]
        stiffness[j] = stiffness[j] + gain * (effective[j] - was[0][j])
        write_effective(rows, fixed, j, effective[j])


@kernel
def write_effective(rows: Any, fixed: Any, j: int, effective: float) -> None:
    """Write the effective pressure [Pa] of lane ``j``, within the regulator's range.

    Beyond it, where motion compresses the air, the hysteresis is continued by its slope
    (:func:`stiffen_beyond`).
    """
    within = min(fixed[K.REGULATOR_MAX_PRESSURE][j], effective)
    rows[EFFECTS_AT + K.STATE.effective][j] = within
    flow = fixed[K.EFFECT.path + AIR.flow][j]
    rows[EFFECTS_AT + K.STATE.beyond][j] = effective - within if flow > 0.0 else 0.0


@kernel
def stiffen_beyond(rows: Any, fixed: Any) -> None:
    """Add the stiffness [N/m] of effective pressures beyond the regulator's range to a tile's."""
    beyond = rows[EFFECTS_AT + K.STATE.beyond]
    for j in range(LANES):
        gain = fixed[K.MUSCLE_GAIN][j] * fixed[K.MUSCLE_STIFFNESS_RATIO][j]
        rows[K.STIFFNESS][j] = rows[K.STIFFNESS][j] + gain * beyond[j]


@kernel
def enclose_air(rows: Any, fixed: Any, j: int, angle: float, ahead: float) -> None:
    """Write the volume of the muscle of lane ``j`` at an angle, and its change with it [m3/rad].

    ``ahead`` is the predicted turn [rad].
    """
    sine, cosine = sine_and_cosine(0.5 * angle)
    arm, shortest = fixed[K.LEVER_ARM][j], fixed[K.MUSCLE_SHORTEST_LENGTH][j]
    ratio = fixed[K.MUSCLE_STIFFNESS_RATIO][j]
    length = muscle_length(sine, arm, fixed[K.LEVER_FITTINGS][j])
    stretch = stretch_of(length, shortest)  # a slack muscle folds and keeps its volume
    volume = gas_volume(shortest + stretch, shortest, ratio, fixed[K.MUSCLE_FULL_VOLUME][j])
    gives = -ratio * stretch * arm * cosine
    enclose(rows, j, EFFECTS_AT + K.STATE.path + PATH_STATE.air, volume, gives, ahead)


@kernel
def settle_air(rows: Any, fixed: Any, h: float, work: Any) -> None:
    """Move yielding friction and, where air flows, the enclosed air of a tile with the motion."""
    if count_on(fixed[K.MUSCLE_YIELD_FORCE], 0.0) > 0:
        for j in range(LANES):
            move_yield(rows, fixed, j, angle_ahead(rows, fixed, j, 0.0, work))
    if flows_on(fixed, K.EFFECT.path) == 0:
        return
    for j in range(LANES):
        angle = angle_ahead(rows, fixed, j, 0.0, work)
        ahead = angle_ahead(rows, fixed, j, 0.5 * h, work) - angle
        enclose_air(rows, fixed, j, angle, ahead)
    squeeze_muscle(rows, fixed, REACHED)


@kernel
def begin_enclosed(rows: Any, fixed: Any, j: int) -> None:
    """Begin yielding friction and enclosed air of the muscle of lane ``j`` at its angle."""
    move_yield(rows, fixed, j, rows[K.ANGLE][j])
    enclose_air(rows, fixed, j, rows[K.ANGLE][j], 0.0)


@kernel
def enclosed_stiffness(rows: Any, j: int) -> float:
    """Return the stiffness [N m/rad] of the air in the muscle of lane ``j``."""
    return air_stiffness(rows, j, EFFECTS_AT + K.STATE.path + PATH_STATE.air)


@kernel
def full_length(fixed: Any, j: int) -> float:
    """Return the length [m] of the muscle in the fully open brace, from which strains count."""
    return 2.0 * fixed[K.LEVER_ARM][j] - fixed[K.LEVER_FITTINGS][j]  # type: ignore[no-any-return]


@kernel
def drive_of(rows: Any, j: int) -> float:
    """Return the effective pressure [Pa] of lane ``j``, with that beyond the regulator's range."""
    return rows[EFFECTS_AT + K.STATE.effective][j] + rows[EFFECTS_AT + K.STATE.beyond][j]  # type: ignore[no-any-return]


@kernel
def yield_at(rows: Any, fixed: Any, j: int, strain: float) -> tuple[float, float, float]:
    """Return the yielding friction's stiffness [N], and its deflection at a strain with its slope.

    The deflection of lane ``j`` continues from the last stored one; the stiffness is per strain.
    """
    stiff, limit = yield_spring(fixed, j, K.EFFECT.soft, drive_of(rows, j))
    deflection, slope = deflected_with_tail(
        rows[EFFECTS_AT + K.STATE.deflection][j],
        strain - rows[EFFECTS_AT + K.STATE.yielded][j],
        limit, fixed[K.MUSCLE_YIELD_RATIO][j], fixed[K.MUSCLE_YIELD_TAIL][j],
    )  # fmt: skip
    return stiff, deflection, slope


@kernel
def move_yield(rows: Any, fixed: Any, j: int, angle: float) -> None:
    """Move the yielding friction of the muscle of lane ``j`` to an angle [rad]."""
    if fixed[K.MUSCLE_YIELD_FORCE][j] > 0.0:
        sine, _ = sine_and_cosine(0.5 * angle)
        length = muscle_length(sine, fixed[K.LEVER_ARM][j], fixed[K.LEVER_FITTINGS][j])
        strain = 1.0 - length / full_length(fixed, j)
        _, rows[EFFECTS_AT + K.STATE.deflection][j], _ = yield_at(rows, fixed, j, strain)
        rows[EFFECTS_AT + K.STATE.yielded][j] = strain


@kernel
def further_tension(rows: Any, fixed: Any, j: int, length: float) -> float:
    """Return the tension [N] of the law's correction and of yielding friction at a length [m]."""
    strain = 1.0 - length / full_length(fixed, j)
    more = correction_force(fixed, j, K.EFFECT.law, drive_of(rows, j), strain)
    if fixed[K.MUSCLE_YIELD_FORCE][j] > 0.0:
        stiff, deflection, _ = yield_at(rows, fixed, j, strain)
        more = more - stiff * deflection
    return more  # type: ignore[no-any-return]


@kernel
def further_stiffness(rows: Any, fixed: Any, j: int, length: float) -> float:
    """Return the derivative of :func:`further_tension` by length [N/m]."""
    full = full_length(fixed, j)
    strain = 1.0 - length / full
    more = correction_slope(fixed, j, K.EFFECT.law, drive_of(rows, j), strain)
    if fixed[K.MUSCLE_YIELD_FORCE][j] > 0.0:
        stiff, _, slope = yield_at(rows, fixed, j, strain)
        more = more + stiff * slope
    return more / full  # type: ignore[no-any-return]


@kernel
def viscous_drag(
    rows: Any, fixed: Any, j: int, angle: float, rate: float, stiffness: float
) -> float:
    """Return the damping [N m s/rad] by viscosity at an angle, its rate and a stiffness [N/m]."""
    sine, cosine = sine_and_cosine(0.5 * angle)
    arm = fixed[K.LEVER_ARM][j]
    lever = arm * cosine
    length = muscle_length(sine, arm, fixed[K.LEVER_FITTINGS][j])
    tension = tension_of(rows, fixed, j, length, stiffness)
    drive, speed = drive_of(rows, j), -lever * rate
    damping = taut_damping(fixed, j, K.EFFECT.viscous, speed, drive, tension)
    return lever * lever * damping  # type: ignore[no-any-return]


@kernel
def report_drag(rows: Any, fixed: Any, j: int) -> None:
    """Add the viscous force of the muscle of lane ``j`` to its tension and torque."""
    _, cosine = sine_and_cosine(0.5 * rows[K.ANGLE][j])
    lever, tension = fixed[K.LEVER_ARM][j] * cosine, rows[K.TENSION][j]
    drive, speed = drive_of(rows, j), -lever * rows[K.VELOCITY][j]
    damping = taut_damping(fixed, j, K.EFFECT.viscous, speed, drive, tension)
    rows[K.TENSION][j] = max(0.0, tension - damping * speed)
    rows[K.TORQUE][j] = rows[K.TORQUE][j] - lever * damping * speed


@kernel
def leaked_air(rows: Any, fixed: Any, j: int) -> float:
    """Return the air [kg] that leaked from the muscle of lane ``j`` in this control period."""
    space = gas_volume(
        rows[K.LENGTH][j],
        fixed[K.MUSCLE_SHORTEST_LENGTH][j],
        fixed[K.MUSCLE_STIFFNESS_RATIO][j],
        fixed[K.MUSCLE_FULL_VOLUME][j],
    )
    lost = rows[EFFECTS_AT + K.STATE.path + PATH_STATE.air + AIR_STATE.lost][j]
    return DENSITY_PER_PRESSURE * lost * space


@kernel
def regulate_as_measured(
    rows: Any, fixed: Any, counts: Any, i: int, substeps: int, period: float
) -> None:
    """Advance the modes of the published frequency response; the muscle has its effects."""
    pressure, travel = rows[K.PRESSURE], rows[EFFECTS_AT + K.STATE.path + PATH_STATE.travel]
    was = scratch(1, LANES)
    for j in range(LANES):
        was[0][j] = pressure[j]
    plain_regulate(rows, fixed, counts, i, substeps, period)
    for j in range(LANES):
        travel[j] += abs(pressure[j] - was[0][j])
    advance_muscle(rows, fixed, period / substeps)


@kernel
def advance_muscle(rows: Any, fixed: Any, h: float) -> None:
    """Write the effective pressures of a tile after a sub-step, within the regulator's range."""
    own, factor = scratch(1, LANES), rows[EFFECTS_AT + K.STATE.path + PATH_STATE.factor]
    path_muscle(
        rows,
        fixed,
        EFFECTS_AT + K.STATE.path,
        K.EFFECT.path,
        K.EFFECT.warm,
        rows[K.PRESSURE],
        h,
        own[0],
        factor,
    )
    for j in range(LANES):
        write_effective(rows, fixed, j, max(0.0, rows[K.PRESSURE][j] + own[0][j]) * factor[j])


@kernel
def begin_muscle(rows: Any, fixed: Any, j: int) -> None:
    """Begin the path of the muscle of lane ``j`` at its pressure."""
    effective = begin_path(
        rows, fixed, j, EFFECTS_AT + K.STATE.path, K.EFFECT.path, K.EFFECT.warm, rows[K.PRESSURE][j]
    )
    rows[EFFECTS_AT + K.STATE.effective][j] = min(fixed[K.REGULATOR_MAX_PRESSURE][j], effective)
    rows[EFFECTS_AT + K.STATE.beyond][j] = 0.0
    rows[EFFECTS_AT + K.STATE.stuck][j] = 1.0
    rows[EFFECTS_AT + K.STATE.deflection][j] = rows[EFFECTS_AT + K.STATE.yielded][j] = 0.0


def muscle_kernels(dynamics: str, plain: Any, first: int) -> dict[str, Any]:
    """Return the kernels of the effects, whose state begins at row ``first``.

    ``plain`` is the dynamics of the pressure of the plain plant.
    """
    effects = [getattr(K.EFFECT, sensor) for sensor in K.SENSORS]
    return effect_kernels(first, K, MEASURED, effects, FULL_SCALES) | {
        "plain_regulate": plain,
        "regulate": regulate_with_lag if dynamics == "lag" else regulate_as_measured,
        "begin_muscle": begin_muscle,
        "stiffen_beyond": stiffen_beyond,
        "settle_air": settle_air,
        "begin_enclosed": begin_enclosed,
        "enclosed_stiffness": enclosed_stiffness,
        "leaked_air": leaked_air,
        "more_tension": further_tension,
        "more_stiffness": further_stiffness,
        "brace_drag": viscous_drag,
        "report_drag": report_drag,
    }
