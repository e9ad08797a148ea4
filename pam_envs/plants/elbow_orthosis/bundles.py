"""The two bundles on their pulley as kernels: forces, torque, stiffness, volume, and their air.

The air comes from proportional regulators, or from on/off valves. ``exchange_air`` advances it by a
sub-step and writes, for the middle of the motion, the pressures before and after, and their fall as
a bundle contracts; ``settle`` writes pressures and air at its end. ``begin_period`` latches the
pulses of the valves.
"""

from typing import Any

from pam_envs.constants import ATMOSPHERE, PRESSURE_PER_DENSITY
from pam_envs.kernels.arithmetic import clip, sine_and_cosine
from pam_envs.kernels.build import LANES, kernel
from pam_envs.mechanics.pulley import contraction_of
from pam_envs.muscle.quadratic_bundle import bundle_shape, bundle_volume, grown_volume
from pam_envs.plants.core.muscle_path import DELAYED, follow_set_point
from pam_envs.plants.elbow_orthosis import rows as K
from pam_envs.pneumatics.on_off_pair import coil_window, emptied, filled


@kernel
def contraction_at(fixed: Any, j: int, side: int, angle: float) -> float:
    """Return the contraction [m] of a bundle, 0 for a and 1 for b, at an angle [rad]."""
    sign = 2.0 * side - 1.0
    return contraction_of(
        angle,
        sign,
        fixed[K.PULLEY_RADIUS][j],
        fixed[K.PULLEY_LOWEST][j],
        fixed[K.PULLEY_HIGHEST][j],
    )


@kernel
def travel_at(fixed: Any, j: int, angle: float) -> float:
    """Return the travel of the pulley [m] from the middle of its range."""
    return fixed[K.PULLEY_RADIUS][j] * (
        angle - 0.5 * (fixed[K.PULLEY_LOWEST][j] + fixed[K.PULLEY_HIGHEST][j])
    )


@kernel
def factors_of(fixed: Any, j: int, side: int) -> tuple[float, float]:
    """Return ``k0`` [N/m2] and ``k1`` [N/(m2 Pa)] of a bundle."""
    row = side * len(K.BUNDLE)
    muscles, gain = fixed[row + K.BUNDLE.muscles][j], fixed[row + K.BUNDLE.gain][j]
    passive = (
        fixed[row + K.BUNDLE.passive_base][j] + fixed[row + K.BUNDLE.passive_each][j] * muscles
    )
    pressed = (
        fixed[row + K.BUNDLE.pressure_base][j] + fixed[row + K.BUNDLE.pressure_each][j] * muscles
    )
    return gain * passive, gain * pressed


@kernel
def shape_of(fixed: Any, j: int, side: int, contraction: float) -> tuple[float, float]:
    """Return the force over ``X`` [m2] of the law at a contraction [m], and its slope [m]."""
    row = side * len(K.BUNDLE)
    length = fixed[row + K.BUNDLE.nominal_length][j]
    return bundle_shape(contraction, length, fixed[row + K.BUNDLE.largest_contraction][j] * length)


@kernel
def friction_of(fixed: Any, j: int, side: int, lag: float) -> float:
    """Return the share of friction [m2] in the shape of a bundle at a lag [m] of the travel."""
    row = side * len(K.BUNDLE)
    length = fixed[row + K.BUNDLE.nominal_length][j]
    full = length * length * fixed[row + K.BUNDLE.largest_contraction][j]
    sign = 2.0 * side - 1.0
    return sign * 0.5 * fixed[K.HYSTERESIS_LOOP][j] * full * lag / fixed[K.LARGEST_LAG][j]


@kernel
def volume_of(fixed: Any, j: int, side: int, contraction: float) -> float:
    """Return the inner volume [m3] of a bundle at a contraction [m]."""
    row = side * len(K.BUNDLE)
    length, share = (
        fixed[row + K.BUNDLE.nominal_length][j],
        fixed[row + K.BUNDLE.largest_contraction][j],
    )
    empty = bundle_volume(
        fixed[row + K.BUNDLE.muscles][j], length, share, fixed[row + K.BUNDLE.diameter][j]
    )
    _, pressed = factors_of(fixed, j, side)
    grown = pressed * grown_volume(contraction, length, share * length)
    return empty + fixed[row + K.BUNDLE.line_volume][j] + grown


@kernel
def weight_of(fixed: Any, j: int, angle: float) -> float:
    """Return the flexing torque [N m] that supports the orthosis at an angle [rad]."""
    sine, _ = sine_and_cosine(angle)
    return fixed[K.LINK_MASS][j] * fixed[K.LINK_CENTRE][j] * fixed[K.LINK_GRAVITY][j] * sine


MIDDLE, WAS_A, WAS_B, NOW_A, NOW_B, GIVES_A, GIVES_B, DRIVE_WAS = range(8)
"""Rows of scratch: angle at the middle; pressures before and after; their fall with contraction;
torque of the intended motion at the start of the period."""
N_WORK = 8
STILL_ON = 1.0 - 1e-6
"""Lift of a valve whose coil was on until a moment ago."""


@kernel
def begin_regulated(rows: Any, fixed: Any, j: int, period: float) -> None:
    """Regulators take their setpoints as they come."""


@kernel
def exchange_regulated(
    rows: Any, fixed: Any, counts: Any, i: int, substeps: int, period: float, work: Any
) -> None:
    """Advance both pressures of a tile towards their setpoints."""
    for side in range(2):
        pressure = rows[K.PRESSURE_A + side]
        was, now, gives = work[WAS_A + side], work[NOW_A + side], work[GIVES_A + side]
        for j in range(LANES):
            was[j] = now[j] = pressure[j]
            gives[j] = 0.0
        follow_set_point(
            rows, fixed, K.DELAY + side * DELAYED.end, K.REGULATOR_MAX_PRESSURE, now,
            rows[K.COMMAND_A + side], counts[K.STEP], i, substeps, period,
        )  # fmt: skip


@kernel
def settle_regulated(rows: Any, fixed: Any, h: float, work: Any) -> None:
    """Keep the pressures; the increase of the air inside comes from the supply."""
    for side in range(2):
        for j in range(LANES):
            rows[K.PRESSURE_A + side][j] = work[NOW_A + side][j]
            count_used_air(rows, fixed, j, side, 0.0)


@kernel
def count_used_air(rows: Any, fixed: Any, j: int, side: int, lost: float) -> None:
    """Write the air [kg] in a bundle, and add its growth and its leak to the air used.

    ``lost`` is the pressure [Pa] that leaked since the last call.
    """
    space = volume_of(fixed, j, side, contraction_at(fixed, j, side, rows[K.ANGLE][j]))
    air = (rows[K.PRESSURE_A + side][j] + ATMOSPHERE) * space / PRESSURE_PER_DENSITY
    leaked = lost * space / PRESSURE_PER_DENSITY
    rows[K.USED][j] = rows[K.USED][j] + max(0.0, air - rows[K.AIR_A + side][j] + leaked)
    rows[K.AIR_A + side][j] = air


@kernel
def air_at(rows: Any, fixed: Any, j: int, side: int) -> float:
    """Return the air [kg] in a bundle at its pressure."""
    space = volume_of(fixed, j, side, contraction_at(fixed, j, side, rows[K.ANGLE][j]))
    return (rows[K.PRESSURE_A + side][j] + ATMOSPHERE) * space / PRESSURE_PER_DENSITY


@kernel
def begin_pulsed(rows: Any, fixed: Any, j: int, period: float) -> None:
    """Pass pulses to the coils of one lane at the start of a cycle; positive pulses fill."""
    latches = rows[K.CLOCK][j] < 0.5 * period
    cycle = 1.0 / fixed[K.VALVE_FREQUENCY][j]
    for valve in range(K.VALVES):
        side, sign = valve // 2, 1.0 - 2.0 * (valve % 2)
        width = clip(sign * rows[K.COMMAND_A + side][j], 0.0, cycle)
        left = rows[K.LEFT + valve][j]
        starts = latches and width > 0.0 and left <= 0.0 and rows[K.LIFT + valve][j] < STILL_ON
        rows[K.SWITCHES][j] = rows[K.SWITCHES][j] + (1.0 if starts else 0.0)
        rows[K.LEFT + valve][j] = width if latches else left
    rows[K.CLOCK][j] = rows[K.CLOCK][j] + (cycle if latches else 0.0) - period


@kernel
def exchange_pulsed(
    rows: Any, fixed: Any, counts: Any, i: int, substeps: int, period: float, work: Any
) -> None:
    """Let air through the valves of a tile, at the volumes of the middle of the sub-step."""
    h = period / substeps
    for side in range(2):
        for j in range(LANES):
            contraction = contraction_at(fixed, j, side, work[MIDDLE][j])
            per_volume = PRESSURE_PER_DENSITY / volume_of(fixed, j, side, contraction)
            was = rows[K.AIR_A + side][j]
            come = inflow(rows, fixed, j, side, per_volume, h)
            left = outflow(rows, fixed, j, side, was + come, per_volume, h)
            now = was + come - left
            shape, _ = shape_of(fixed, j, side, contraction)
            _, pressed = factors_of(fixed, j, side)
            work[WAS_A + side][j] = was * per_volume - ATMOSPHERE
            work[NOW_A + side][j] = now * per_volume - ATMOSPHERE
            mean = 0.5 * (was + now) * per_volume
            work[GIVES_A + side][j] = mean * pressed * shape * per_volume / PRESSURE_PER_DENSITY
            rows[K.AIR_A + side][j] = now
            rows[K.USED][j] = rows[K.USED][j] + come


@kernel
def open_time(rows: Any, fixed: Any, j: int, valve: int, h: float) -> float:
    """Return how long [s] a valve is open in a sub-step, and advance it."""
    duration, left, lift, opened = coil_window(
        rows[K.LEFT + valve][j],
        rows[K.LIFT + valve][j],
        rows[K.OPENED + valve][j],
        fixed[K.VALVE_OPENING_TIME][j],
        fixed[K.VALVE_CLOSING_TIME][j],
        h,
    )
    rows[K.LEFT + valve][j], rows[K.LIFT + valve][j] = left, lift
    rows[K.OPENED + valve][j] = opened
    return duration


@kernel
def inflow(rows: Any, fixed: Any, j: int, side: int, per_volume: float, h: float) -> float:
    """Return the air [kg] that a fill valve lets into a bundle in a sub-step."""
    duration = open_time(rows, fixed, j, 2 * side, h)
    supply = fixed[K.VALVE_SUPPLY_PRESSURE][j] + ATMOSPHERE
    flow, critical = fixed[K.VALVE_CONDUCTANCE][j], fixed[K.VALVE_CRITICAL_RATIO][j]
    return filled(rows[K.AIR_A + side][j], per_volume, supply, flow, critical, duration)


@kernel
def outflow(
    rows: Any, fixed: Any, j: int, side: int, air: float, per_volume: float, h: float
) -> float:
    """Return the air [kg] that an exhaust valve lets out of a bundle in a sub-step."""
    duration = open_time(rows, fixed, j, 2 * side + 1, h)
    return emptied(
        air, per_volume, fixed[K.VALVE_CONDUCTANCE][j], fixed[K.VALVE_CRITICAL_RATIO][j], duration
    )


@kernel
def settle_pulsed(rows: Any, fixed: Any, h: float, work: Any) -> None:
    """Write the pressures of the air that is inside."""
    for side in range(2):
        for j in range(LANES):
            contraction = contraction_at(fixed, j, side, rows[K.ANGLE][j])
            per_volume = PRESSURE_PER_DENSITY / volume_of(fixed, j, side, contraction)
            rows[K.PRESSURE_A + side][j] = rows[K.AIR_A + side][j] * per_volume - ATMOSPHERE


AIR: dict[str, dict[str, Any]] = {
    "proportional": {
        "begin_period": begin_regulated,
        "exchange_air": exchange_regulated,
        "settle": settle_regulated,
    },
    "on_off": {
        "begin_period": begin_pulsed,
        "exchange_air": exchange_pulsed,
        "settle": settle_pulsed,
    },
}
"""Kernels by make of valves; regulators keep their setpoints where pulses end."""
