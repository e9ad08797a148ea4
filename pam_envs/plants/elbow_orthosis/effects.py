"""Effects of the elbow orthosis: kernels that replace the placeholders.

With proportional valves both bundles have all effects of their path; with on/off valves creep,
first cycles and temperature. Friction of the bundles may yield smoothly, viscous forces resist
their contraction, and a correction of the law depends on effective pressure and strain. The bearing
sticks and slips, and the sensors have their effects.
"""

from typing import Any

from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.yielding import deflected_with_tail
from pam_envs.muscle.effects import taut_damping, yield_spring
from pam_envs.muscle.law_correction import correction_force, correction_on, correction_slope
from pam_envs.plants.core.muscle_path import (
    DELAYED,
    PATH_STATE,
    WARM,
    begin_path,
    path_air,
    path_muscle,
    path_squeeze,
)
from pam_envs.plants.core.sensors import effect_kernels
from pam_envs.plants.elbow_orthosis import rows as K
from pam_envs.plants.elbow_orthosis.bundles import (
    AIR,
    GIVES_A,
    MIDDLE,
    NOW_A,
    WAS_A,
    contraction_at,
    count_used_air,
    factors_of,
    shape_of,
    volume_of,
)
from pam_envs.pneumatics.enclosed_air import AHEAD, REACHED, enclose, flows_on
from pam_envs.pneumatics.regulator import AIR_STATE

EFFECTS_AT = 0  # placeholder: the row after the hysteresis state
FULL_SCALES = (2.1, 6e5, 6e5)
"""Full scales of the sensors: rad, Pa, Pa."""
plain_exchange: Any = None  # placeholders: air of the plain plant
plain_settle: Any = None
spring_of: Any = None  # placeholder: spring of the yielding friction of a drive of the hysteresis


@kernel
def path_of(side: int) -> int:
    """Return the first row of the state of a bundle's path."""
    return EFFECTS_AT + K.STATE.paths + side * PATH_STATE.end  # type: ignore[no-any-return]


@kernel
def factor_of(rows: Any, side: int) -> Any:
    """Return the factors of temperature and first cycles on the pressures of a bundle."""
    return rows[path_of(side) + PATH_STATE.factor]


@kernel
def effective_pressures(rows: Any, fixed: Any, side: int, h: float, work: Any) -> None:
    """Turn the pressures of a bundle before and after a sub-step into effective ones."""
    was, now, gives = work[WAS_A + side], work[NOW_A + side], work[GIVES_A + side]
    crept, factor = rows[EFFECTS_AT + K.STATE.crept + side], factor_of(rows, side)
    effective = rows[EFFECTS_AT + K.STATE.effective + side]
    path_muscle(
        rows,
        fixed,
        path_of(side),
        K.EFFECT.path,
        K.EFFECT.warm + side * len(WARM),
        now,
        h,
        crept,
        factor,
    )
    for j in range(LANES):
        was[j] = effective[j]
        now[j] = max(0.0, now[j] + crept[j]) * factor[j]
        gives[j] = gives[j] * factor[j]


@kernel
def exchange_regulated(
    rows: Any, fixed: Any, counts: Any, i: int, substeps: int, period: float, work: Any
) -> None:
    """Advance both pressures of a tile towards their setpoints, with all effects."""
    h = period / substeps
    for side in range(2):
        pressure = rows[K.PRESSURE_A + side]
        effective = rows[EFFECTS_AT + K.STATE.effective + side]
        path_squeeze(rows, fixed, path_of(side), K.EFFECT.path, pressure, effective, AHEAD)
        path_air(
            rows, fixed, path_of(side), K.EFFECT.path, K.DELAY + side * DELAYED.end,
            K.REGULATOR_MAX_PRESSURE, pressure, rows[K.COMMAND_A + side],
            counts[K.STEP], i, substeps, period,
        )  # fmt: skip
        for j in range(LANES):
            work[NOW_A + side][j] = pressure[j]
            work[GIVES_A + side][j] = rows[path_of(side) + PATH_STATE.air + AIR_STATE.slope][j]
        effective_pressures(rows, fixed, side, h, work)


@kernel
def exchange_pulsed(
    rows: Any, fixed: Any, counts: Any, i: int, substeps: int, period: float, work: Any
) -> None:
    """Let air through the valves of a tile; the bundles have their effects."""
    plain_exchange(rows, fixed, counts, i, substeps, period, work)
    for side in range(2):
        travel = rows[path_of(side) + PATH_STATE.travel]
        for j in range(LANES):
            travel[j] += abs(work[NOW_A + side][j] - work[WAS_A + side][j])
        effective_pressures(rows, fixed, side, period / substeps, work)


@kernel
def settle_regulated(rows: Any, fixed: Any, h: float, work: Any) -> None:
    """Keep the pressures of regulated bundles and their effective pressures, but for motion."""
    for side in range(2):
        effective, pressure = rows[EFFECTS_AT + K.STATE.effective + side], rows[K.PRESSURE_A + side]
        for j in range(LANES):
            effective[j] = work[NOW_A + side][j]
        if flows_on(fixed, K.EFFECT.path) > 0:
            ahead = 2.0 * side - 1.0
            for j in range(LANES):
                travel = ahead * fixed[K.PULLEY_RADIUS][j] * rows[K.VELOCITY][j]
                enclose_air(rows, fixed, j, side, 0.5 * h * travel)
            path_squeeze(rows, fixed, path_of(side), K.EFFECT.path, pressure, effective, REACHED)
        lost = rows[path_of(side) + PATH_STATE.air + AIR_STATE.lost]
        for j in range(LANES):
            count_used_air(rows, fixed, j, side, lost[j])
            lost[j] = 0.0


@kernel
def enclose_air(rows: Any, fixed: Any, j: int, side: int, ahead: float) -> None:
    """Write the volume of a bundle of lane ``j``, and its change with the contraction [m2].

    ``ahead`` is the predicted contraction [m].
    """
    contraction = contraction_at(fixed, j, side, rows[K.ANGLE][j])
    shape, _ = shape_of(fixed, j, side, contraction)
    _, pressed = factors_of(fixed, j, side)
    volume = volume_of(fixed, j, side, contraction)
    enclose(rows, j, path_of(side) + PATH_STATE.air, volume, pressed * shape, ahead)


@kernel
def begin_enclosed(rows: Any, fixed: Any, j: int) -> None:
    """Begin the enclosed air of both bundles of lane ``j`` at its angle."""
    for side in range(2):
        enclose_air(rows, fixed, j, side, 0.0)


@kernel
def settle_pulsed(rows: Any, fixed: Any, h: float, work: Any) -> None:
    """Write the pressures of the air that is inside, and the effective ones."""
    plain_settle(rows, fixed, h, work)
    for side in range(2):
        crept, factor = rows[EFFECTS_AT + K.STATE.crept + side], factor_of(rows, side)
        for j in range(LANES):
            pressure = max(0.0, rows[K.PRESSURE_A + side][j] + crept[j])
            rows[EFFECTS_AT + K.STATE.effective + side][j] = pressure * factor[j]


@kernel
def begin_muscles(rows: Any, fixed: Any, j: int) -> None:
    """Begin the paths of both bundles of lane ``j`` at their pressures."""
    for side in range(2):
        rows[EFFECTS_AT + K.STATE.effective + side][j] = begin_path(
            rows, fixed, j, path_of(side), K.EFFECT.path, K.EFFECT.warm + side * len(WARM),
            rows[K.PRESSURE_A + side][j],
        )  # fmt: skip
    rows[EFFECTS_AT + K.STATE.stuck][j] = 1.0


@kernel
def begin_yield(rows: Any, j: int) -> None:
    """Begin the yielding friction of both bundles of lane ``j`` at the middle of the range."""
    for side in range(2):
        rows[EFFECTS_AT + K.STATE.deflection + side][j] = 0.0
        rows[EFFECTS_AT + K.STATE.yielded + side][j] = 0.0


@kernel
def spring_at_pressure(fixed: Any, j: int, first: int, drive: float) -> tuple[float, float]:
    """Return :func:`yield_spring` where the pressure changes the stiffness, not the limit."""
    stiff, limit = yield_spring(fixed, j, first, drive)
    span = fixed[K.HYSTERESIS_YIELD_BREAK][j]
    return stiff * limit / span, span


@kernel
def move_yield(rows: Any, fixed: Any, first: int, last: int) -> None:
    """Move the yielding friction of the bundles of some lanes, and write its slope.

    That of one muscle, at a bundle's travel over its nominal length, times their number.
    """
    for side in range(2):
        deflection = rows[EFFECTS_AT + K.STATE.deflection + side]
        yielded = rows[EFFECTS_AT + K.STATE.yielded + side]
        stick, effective = (
            rows[EFFECTS_AT + K.STATE.stick + side],
            rows[EFFECTS_AT + K.STATE.effective + side],
        )
        sign, row = 2.0 * side - 1.0, side * len(K.BUNDLE)
        for j in range(first, last):
            length = fixed[row + K.BUNDLE.nominal_length][j]
            stiff, limit = spring_of(fixed, j, K.EFFECT.soft, effective[j])
            moved = sign * (rows[K.AT_A + side][j] - yielded[j]) / length
            deflection[j], slope = deflected_with_tail(
                deflection[j], moved, limit, fixed[K.HYSTERESIS_YIELD_RATIO][j],
                fixed[K.HYSTERESIS_YIELD_TAIL][j],
            )  # fmt: skip
            yielded[j] = rows[K.AT_A + side][j]
            stick[j] = fixed[row + K.BUNDLE.muscles][j] * stiff * slope / length


@kernel
def rub_of(rows: Any, fixed: Any, j: int, side: int, pressure: float) -> float:
    """Return the yielding friction [N] against the contraction of a bundle at a pressure [Pa]."""
    stiff, _ = spring_of(fixed, j, K.EFFECT.soft, pressure)
    muscles = fixed[side * len(K.BUNDLE) + K.BUNDLE.muscles][j]
    return muscles * stiff * rows[EFFECTS_AT + K.STATE.deflection + side][j]  # type: ignore[no-any-return]


@kernel
def stick_of(rows: Any, j: int, side: int) -> float:
    """Return the derivative [N/m] of :func:`rub_of` by contraction."""
    return rows[EFFECTS_AT + K.STATE.stick + side][j]  # type: ignore[no-any-return]


@kernel
def corrected_force(fixed: Any, j: int, side: int, contraction: float, pressure: float) -> float:
    """Return the force [N] of the law's correction of a bundle.

    At a contraction [m] and an effective pressure [Pa].
    """
    row = side * len(K.BUNDLE)
    strain = contraction / fixed[row + K.BUNDLE.nominal_length][j]
    force = correction_force(fixed, j, K.EFFECT.law, pressure, strain)
    return fixed[row + K.BUNDLE.muscles][j] * fixed[row + K.BUNDLE.gain][j] * force  # type: ignore[no-any-return]


@kernel
def corrected_growth(fixed: Any, j: int, side: int, contraction: float, pressure: float) -> float:
    """Return the derivative [N/m] of :func:`corrected_force` by contraction."""
    row = side * len(K.BUNDLE)
    per_length = 1.0 / fixed[row + K.BUNDLE.nominal_length][j]
    slope = correction_slope(fixed, j, K.EFFECT.law, pressure, contraction * per_length)
    muscles = fixed[row + K.BUNDLE.muscles][j] * fixed[row + K.BUNDLE.gain][j]
    return -muscles * slope * per_length  # type: ignore[no-any-return]


@routine
def correct_motion(rows: Any, fixed: Any, work: Any) -> None:
    """Write the correction of the law in a sub-step of a tile, where it is on."""
    if correction_on(fixed, K.EFFECT.law) == 0:
        return
    for side in range(2):
        was, now = rows[EFFECTS_AT + K.STATE.more + side], rows[EFFECTS_AT + K.STATE.next + side]
        growth, before, after = (
            rows[EFFECTS_AT + K.STATE.steeper + side],
            work[WAS_A + side],
            work[NOW_A + side],
        )
        for j in range(LANES):
            at = contraction_at(fixed, j, side, work[MIDDLE][j])
            was[j] = corrected_force(fixed, j, side, at, before[j])
            now[j] = corrected_force(fixed, j, side, at, after[j])
            growth[j] = corrected_growth(fixed, j, side, at, 0.5 * (before[j] + after[j]))


@routine
def correct_at(rows: Any, fixed: Any, j: int, angle: float) -> None:
    """Write the correction of the law at an angle [rad] of one lane."""
    for side in range(2):
        pressure = rows[EFFECTS_AT + K.STATE.effective + side][j]
        at = contraction_at(fixed, j, side, angle)
        rows[EFFECTS_AT + K.STATE.more + side][j] = corrected_force(fixed, j, side, at, pressure)
        rows[EFFECTS_AT + K.STATE.steeper + side][j] = corrected_growth(
            fixed, j, side, at, pressure
        )
        rows[EFFECTS_AT + K.STATE.next + side][j] = 0.0


@kernel
def correct_report(rows: Any, fixed: Any) -> None:
    """Write the correction of the law at the angles of a tile, where it is on."""
    if correction_on(fixed, K.EFFECT.law) > 0:
        for j in range(LANES):
            correct_at(rows, fixed, j, rows[K.ANGLE][j])


@kernel
def more_of(rows: Any, j: int, side: int) -> tuple[float, float, float]:
    """Return the forces [N] of the law's correction of a bundle before and after a sub-step.

    Then their derivative by contraction [N/m].
    """
    return (
        rows[EFFECTS_AT + K.STATE.more + side][j],
        rows[EFFECTS_AT + K.STATE.next + side][j],
        rows[EFFECTS_AT + K.STATE.steeper + side][j],
    )


@kernel
def drag_of(fixed: Any, j: int, side: int, speed: float, pressure: float, force: float) -> float:
    """Return the damping [N s/m] of a bundle by viscosity, at a speed of its contraction [m/s].

    ``pressure`` [Pa] is the effective one, ``force`` [N] that without viscosity.
    """
    muscles = fixed[side * len(K.BUNDLE) + K.BUNDLE.muscles][j]
    one = taut_damping(fixed, j, K.EFFECT.viscous, speed, pressure, force / muscles)
    return muscles * one  # type: ignore[no-any-return]


def bundle_kernels(valves: str, first: int) -> dict[str, Any]:
    """Return the kernels of the effects, whose state begins at row ``first``."""
    regulated = valves == "proportional"
    measured = (K.ANGLE, K.PRESSURE_A, K.PRESSURE_A + 1)
    effects = (K.EFFECT.angle, K.EFFECT.pressure, K.EFFECT.pressure)
    return effect_kernels(first, K, measured, effects, FULL_SCALES) | {
        "plain_exchange": AIR[valves]["exchange_air"],
        "plain_settle": AIR[valves]["settle"],
        "exchange_air": exchange_regulated if regulated else exchange_pulsed,
        "settle": settle_regulated if regulated else settle_pulsed,
        "begin_muscles": begin_muscles,
        "begin_enclosed": begin_enclosed,
        "begin_yield": begin_yield,
        "move_yield": move_yield,
        "rub_of": rub_of,
        "stick_of": stick_of,
        "correct_motion": correct_motion,
        "correct_report": correct_report,
        "correct_at": correct_at,
        "more_of": more_of,
        "drag_of": drag_of,
    }
