"""One control period of the antagonistic joint, for one environment or a tile of them.

    set-points -> regulators -> pressures -> muscles on their lever -> angle

The regulators are exact at the end of a sub-step. The motion is exact for the torque linearised
about the predicted middle, with the pressures going straight from their old to their new values:
of second order, and without a stability limit from stiff muscles. The hysteresis models are asked
at the predicted middle and moved to the angle reached.

The reduced plant of fluidic_muscles has in its place a hysteresis from command to resting angle
and two real poles; disturbance and payload reach it through the stiffness of the nominal point.
"""

from __future__ import annotations

from typing import Any

from pam_envs.hysteresis import protocol
from pam_envs.kernels.arithmetic import decay, sine_and_cosine
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.motion import damped_motion
from pam_envs.mechanics.guide import turn
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint.effects import effect_kernels
from pam_envs.plants.antagonistic_joint.pair import (
    air_of,
    clear_hysteresis_models,
    command,
    contract,
    feed_forward,
    fill,
    lever_of,
    pulled,
    stop_torque,
    turning,
)
from pam_envs.plants.antagonistic_joint.rows import (
    ANGLE,
    AT_A,
    AT_B,
    COMMAND,
    DAMPING,
    DISTURBANCE,
    GRAVITY,
    LAG_A,
    LAG_B,
    LINK_CENTRE,
    LINK_GYRATION,
    LINK_MASS,
    MEMBER,
    MODEL,
    NOMINAL_POLE,
    NOMINAL_STIFFNESS,
    PAYLOAD,
    PAYLOAD_ARM,
    PRESSURE_A,
    PRESSURE_B,
    REST_LENGTH,
    SET_POINT_A,
    STACK_COUNT,
    STICK_A,
    STICK_B,
    STOP,
    STRAIGHT,
    VELOCITY,
)
from pam_envs.plants.core.sensors import read_sensors

__all__ = [
    "N_WORK",
    "advance",
    "begin_lane",
    "feed_forward",
    "replacements",
    "start_hysteresis",
]

WAS_A, WAS_B, RATE_A, RATE_B, CURVE_A, CURVE_B = range(6)
"""Rows of scratch: pressures before the sub-step, geometry at its middle."""
N_WORK = 6

# placeholders, filled in for each of the two plants and each hysteresis
hysteresis_lag: Any = None
hysteresis_peek: Any = None
move: Any = None
rest: Any = None
report: Any = None
EFFECTIVE_A, SENSED_ANGLE, SENSED_PRESSURE = PRESSURE_A, ANGLE, PRESSURE_A
"""Rows of effective pressures and readings; those of the extended plant replace them."""


@kernel
def regulate(
    rows: Any, fixed: Any, counts: Any, side: int, i: int, substeps: int, period: float, work: Any
) -> None:
    """Advance the pressure of one muscle of a tile through a sub-step."""
    h = period / substeps
    fill(rows[PRESSURE_A + side], rows[SET_POINT_A + side], work[side], fixed, h)


@kernel
def begin_muscles(rows: Any, fixed: Any, j: int) -> None:
    """Begin the effects of the muscles: a plain plant has none."""


@kernel
def load_torque(rows: Any, fixed: Any, j: int, angle: float) -> tuple[float, float]:
    """Return the torque [N m] of disturbance, weight and stop, and minus its slope [N m/rad]."""
    sine, cosine = sine_and_cosine(angle)
    moment = fixed[GRAVITY][j] * (
        fixed[LINK_MASS][j] * fixed[LINK_CENTRE][j] + rows[PAYLOAD][j] * fixed[PAYLOAD_ARM][j]
    )
    stop, hard = stop_torque(fixed, j, angle)
    return rows[DISTURBANCE][j] - moment * sine + stop, moment * cosine + hard


@kernel
def inertia_of(rows: Any, fixed: Any, j: int) -> float:
    """Return the inertia about the joint [kg m2], payload included."""
    radius, arm = fixed[LINK_GYRATION][j], fixed[PAYLOAD_ARM][j]
    return fixed[LINK_MASS][j] * radius * radius + rows[PAYLOAD][j] * arm * arm  # type: ignore[no-any-return]


@kernel
def swing(
    rows: Any,
    fixed: Any,
    counts: Any,
    table: Any,
    hysteresis: int,
    elements: int,
    h: float,
    work: Any,
) -> None:
    """Move the joint by one sub-step."""
    angle, velocity, straight = rows[ANGLE], rows[VELOCITY], rows[STRAIGHT]
    for j in range(LANES):
        middle = angle[j] + 0.5 * h * velocity[j]
        x_a, work[RATE_A][j], work[CURVE_A][j] = lever_of(fixed, j, middle, 1.0)
        x_b, work[RATE_B][j], work[CURVE_B][j] = lever_of(fixed, j, middle, -1.0)
        rows[AT_A][j], rows[AT_A + 1][j] = x_a - straight[j], x_b - straight[j]
    hysteresis_peek(
        rows, fixed, counts, table, hysteresis, elements, AT_A, LAG_A, STICK_A, 2, MODEL,
        STACK_COUNT,
        MEMBER, 0, LANES,
    )  # fmt: skip
    for j in range(LANES):
        ahead = 0.5 * h * velocity[j]
        load, slope = load_torque(rows, fixed, j, angle[j] + ahead)
        old_a, new_a, slope_a, drag_a = turning(
            fixed, j, 1.0, rows[AT_A][j] + straight[j], work[RATE_A][j], work[CURVE_A][j],
            velocity[j], work[WAS_A][j], rows[EFFECTIVE_A][j], rows[LAG_A][j], rows[STICK_A][j],
        )  # fmt: skip
        old_b, new_b, slope_b, drag_b = turning(
            fixed, j, -1.0, rows[AT_B][j] + straight[j], work[RATE_B][j], work[CURVE_B][j],
            velocity[j], work[WAS_B][j], rows[EFFECTIVE_A + 1][j], rows[LAG_B][j], rows[STICK_B][j],
        )  # fmt: skip
        old, new = load + old_a + old_b, load + new_a + new_b
        slope = max(1.0, slope + slope_a + slope_b)
        per_inertia = 1.0 / inertia_of(rows, fixed, j)
        drag = (fixed[DAMPING][j] + drag_a + drag_b) * per_inertia
        du, velocity[j] = turn(
            rows, fixed, j, velocity[j], (old + slope * ahead) * per_inertia,
            (new - old) * per_inertia / h, slope * per_inertia, drag, per_inertia, h,
        )  # fmt: skip
        angle[j] = angle[j] + du
        contract(rows, fixed, j, angle[j], AT_A, STRAIGHT)
    hysteresis_lag(
        rows, fixed, counts, table, hysteresis, elements, AT_A, LAG_A, 2, MODEL, STACK_COUNT,
        MEMBER,
        0, LANES,
    )  # fmt: skip


@kernel
def follow(
    rows: Any,
    fixed: Any,
    counts: Any,
    table: Any,
    hysteresis: int,
    elements: int,
    h: float,
    work: Any,
) -> None:
    """Move the reduced plant by one sub-step."""
    angle, velocity = rows[ANGLE], rows[VELOCITY]
    for j in range(LANES):
        rows[AT_A][j] = rows[COMMAND][j]
    hysteresis_lag(
        rows, fixed, counts, table, hysteresis, elements, AT_A, LAG_A, 1, MODEL, STACK_COUNT,
        MEMBER,
        0, LANES,
    )  # fmt: skip
    for j in range(LANES):
        ahead = 0.5 * h * velocity[j]
        pole, per_stiffness = fixed[NOMINAL_POLE][j], 1.0 / fixed[NOMINAL_STIFFNESS][j]
        torque, slope = load_torque(rows, fixed, j, angle[j] + ahead)
        target = rows[COMMAND][j] - fixed[K.LOOP_WIDTH][j] * rows[LAG_A][j]
        off = target - angle[j] + (torque + slope * ahead) * per_stiffness
        stiff = pole * pole
        du, velocity[j] = damped_motion(
            velocity[j],
            off * stiff,
            0.0,
            stiff * (1.0 + slope * per_stiffness),
            2.0 * pole,
            decay(pole * h),
            h,
        )
        angle[j] = angle[j] + du


@kernel
def advance(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, substeps: int,
    period: float, work: Any,
) -> None:  # fmt: skip
    """Advance a tile by one control period, towards its set-points.

    Parameters
    ----------
    rows, fixed, counts : rows
        State, parameters and whole numbers (``antagonistic_joint_rows``). ``SET_POINT_A`` and
        ``_B`` [Pa], ``COMMAND`` [rad] (which the reduced plant follows), ``DISTURBANCE`` [N m] and
        ``PAYLOAD`` [kg] are the caller's to write.
    table : array
        Of the hysteresis: ``AntagonisticJoint.hysteresis_tables()``.
    hysteresis, elements : int
        First row of the hysteresis state, and ``AntagonisticJoint.elements``.
    substeps, period : int, float
        Sub-steps and duration [s] of the period.
    work : rows
        ``N_WORK`` rows of scratch.
    """
    h = period / substeps
    for i in range(substeps):
        for side in range(2):
            regulate(rows, fixed, counts, side, i, substeps, period, work)
        move(rows, fixed, counts, table, hysteresis, elements, h, work)
    for j in range(LANES):
        report(rows, fixed, j)
        read_sensors(rows, fixed, j, counts[K.STEP][j] + 1, period)


@kernel
def report_muscles(rows: Any, fixed: Any, j: int) -> None:
    """Write what can be seen of one lane."""
    torque, stiffness, air, slack = 0.0, 0.0, 0.0, 0.0
    for side in range(2):
        sign, pressure = 1.0 - 2.0 * side, rows[PRESSURE_A + side][j]
        x, rate, curve = lever_of(fixed, j, rows[ANGLE][j], sign)
        speed = -rate * rows[VELOCITY][j] / fixed[REST_LENGTH][j]
        effective = rows[EFFECTIVE_A + side][j]
        force, k = pulled(fixed, j, sign, x, speed, effective, rows[LAG_A + side][j])
        rows[K.CONTRACTION_A + side][j], rows[K.FORCE_A + side][j] = x, force
        torque = torque - force * rate
        stiffness = stiffness + k * rate * rate / fixed[REST_LENGTH][j] + force * curve
        air = air + air_of(fixed, j, x, pressure)
        slack = slack + (0.0 if force > 0.0 else 1.0)
    rows[K.TORQUE][j], rows[K.STIFFNESS][j] = torque, stiffness
    rows[K.AIR][j], rows[K.SLACK][j] = air, slack


@kernel
def report_reduced(rows: Any, fixed: Any, j: int) -> None:
    """Write what can be seen of the reduced plant; forces are those of the law alone."""
    lag = rows[LAG_A][j]
    rows[LAG_A][j] = 0.0
    report_muscles(rows, fixed, j)
    rows[LAG_A][j] = lag


@kernel
def start_hysteresis(rows: Any, counts: Any, hysteresis: int, j: int) -> None:
    """Put the hysteresis models of one lane into their virgin state."""
    clear_hysteresis_models(rows, counts, hysteresis, STACK_COUNT, 2, j)


@routine
def begin_lane(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int,
    angle: float, prestress: float,
) -> None:  # fmt: skip
    """Bring one lane to rest at a commanded angle [rad] and co-contraction [N].

    The joint comes there from a straight and virgin state. ``PAYLOAD``, ``DISTURBANCE`` and
    ``counts[MEMBER]`` are set before, and the hysteresis cleared with :func:`start_hysteresis`.
    """
    command(rows, fixed, j, angle, prestress, COMMAND, K.PRESTRESS, SET_POINT_A)
    rows[PRESSURE_A][j], rows[PRESSURE_B][j] = rows[SET_POINT_A][j], rows[SET_POINT_A + 1][j]
    straight, _, _ = lever_of(fixed, j, 0.0, 1.0)
    rows[STRAIGHT][j] = straight
    rows[LAG_A][j] = rows[LAG_A + 1][j] = 0.0
    begin_muscles(rows, fixed, j)
    rest(rows, fixed, counts, table, hysteresis, elements, j)
    rows[VELOCITY][j] = 0.0
    report(rows, fixed, j)
    read_sensors(rows, fixed, j, 0, 0.0)


@kernel
def resting_torque(rows: Any, fixed: Any, j: int, angle: float) -> float:
    """Return the torque at rest [N m] at an angle, with the lags of hysteresis at that angle."""
    torque, _ = load_torque(rows, fixed, j, angle)
    for side in range(2):
        sign = 1.0 - 2.0 * side
        x, rate, _ = lever_of(fixed, j, angle, sign)
        effective = rows[EFFECTIVE_A + side][j]
        force, _ = pulled(fixed, j, sign, x, 0.0, effective, rows[LAG_A + side][j])
        torque = torque - force * rate
    return torque


@routine
def rest_muscles(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int
) -> None:
    """Put a lane where its torques balance at its pressures, and its hysteresis models with it."""
    low, high = -fixed[STOP][j] - 0.1, fixed[STOP][j] + 0.1
    for _ in range(52):
        angle = 0.5 * (low + high)
        contract(rows, fixed, j, angle, AT_A, STRAIGHT)
        hysteresis_peek(
            rows, fixed, counts, table, hysteresis, elements, AT_A, LAG_A, STICK_A, 2, MODEL,
            STACK_COUNT, MEMBER, j, j + 1,
        )  # fmt: skip
        if resting_torque(rows, fixed, j, angle) > 0.0:
            low = angle
        else:
            high = angle
    rows[ANGLE][j] = 0.5 * (low + high)
    contract(rows, fixed, j, rows[ANGLE][j], AT_A, STRAIGHT)
    hysteresis_lag(
        rows, fixed, counts, table, hysteresis, elements, AT_A, LAG_A, 2, MODEL, STACK_COUNT,
        MEMBER,
        j, j + 1,
    )  # fmt: skip


@routine
def rest_reduced(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int
) -> None:
    """Put a lane of the reduced plant where it comes to rest under its command."""
    rows[AT_A][j] = rows[COMMAND][j]
    hysteresis_lag(
        rows, fixed, counts, table, hysteresis, elements, AT_A, LAG_A, 1, MODEL, STACK_COUNT,
        MEMBER,
        j, j + 1,
    )  # fmt: skip
    target = rows[COMMAND][j] - fixed[K.LOOP_WIDTH][j] * rows[LAG_A][j]
    angle = target
    for _ in range(30):
        torque, slope = load_torque(rows, fixed, j, angle)
        off = target - angle + torque / fixed[NOMINAL_STIFFNESS][j]
        angle = angle + off / (1.0 + max(0.0, slope) / fixed[NOMINAL_STIFFNESS][j])
    rows[ANGLE][j] = angle


DYNAMICS: dict[str, dict[str, Any]] = {
    "muscles": {"move": swing, "rest": rest_muscles, "report": report_muscles},
    "reduced": {"move": follow, "rest": rest_reduced, "report": report_reduced},
}


def replacements(kind: str, dynamics: str, effects: int | None = None) -> dict[str, Any]:
    """Return the kernels that a plant of this make puts in the place of the placeholders.

    ``effects`` is the first row of the state of the effects; None for a plain plant.
    """
    extended = {} if effects is None else effect_kernels(effects)
    return protocol.kernels(kind) | DYNAMICS[dynamics] | extended
