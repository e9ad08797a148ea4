"""One control period of the antagonistic joint, for one environment or a tile of them.

    setpoints -> regulators -> pressures -> muscles on their lever -> angle

The regulators are exact at the end of a sub-step. The motion is exact for the torque linearised
about the predicted middle, with the pressures going straight from their old to their new values:
of second order, and without a stability limit from stiff muscles. The hysteresis models are
evaluated at the predicted middle and moved to the angle reached.

The reduced plant of fluidic_muscles has in its place a hysteresis from command to resting angle
and two real poles; disturbance and payload reach it through the stiffness of the nominal point.
"""

from typing import Any

from pam_envs.kernels.arithmetic import decay, sine_and_cosine
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.motion import damped_motion
from pam_envs.mechanics.guide import turn
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint.effects import pair_kernels
from pam_envs.plants.antagonistic_joint.pair import (
    PAIR,
    begin_delays,
    begin_enclosed,
    begin_muscles,
    command,
    contract,
    lag_of,
    lever_of,
    peek_at,
    predict,
    pulled,
    report_muscles,
    report_state,
    stop_torque,
    turning,
)
from pam_envs.plants.core.sensors import begin_sensors

N_WORK = 6
"""Rows of scratch: pressures before the sub-step, rates and curvatures at its middle."""

rest: Any = None  # placeholder: of either dynamics
SENSED_ANGLE, SENSED_PRESSURE = K.ANGLE, K.PRESSURE_A
"""Rows of readings; those of the extended plant replace them."""


@kernel
def load_torque(rows: Any, fixed: Any, j: int, angle: float) -> tuple[float, float]:
    """Return the torque [N m] of disturbance, weight and stop, and minus its slope [N m/rad]."""
    sine, cosine = sine_and_cosine(angle)
    moment = fixed[K.LINK_GRAVITY][j] * (
        fixed[K.LINK_MASS][j] * fixed[K.LINK_CENTRE][j]
        + rows[K.PAYLOAD][j] * fixed[K.LINK_LENGTH][j]
    )
    stop, hard = stop_torque(fixed, j, angle)
    return rows[K.DISTURBANCE][j] - moment * sine + stop, moment * cosine + hard


@kernel
def inertia_of(rows: Any, fixed: Any, j: int) -> float:
    """Return the inertia about the joint [kg m2], payload included."""
    radius, arm = fixed[K.LINK_GYRATION][j], fixed[K.LINK_LENGTH][j]
    return fixed[K.LINK_MASS][j] * radius * radius + rows[K.PAYLOAD][j] * arm * arm  # type: ignore[no-any-return]


@kernel
def swing(
    rows: Any, fixed: Any, counts: Any, table: Any, state: int, elements: int, h: float, work: Any
) -> None:
    """Move the joint by one sub-step."""
    angle, velocity = rows[K.ANGLE], rows[K.VELOCITY]
    for j in range(LANES):
        predict(rows, fixed, j, 0, angle[j] + 0.5 * h * velocity[j], work)
    peek_at(rows, fixed, counts, table, state, elements, 0, 2, 0, LANES)
    for j in range(LANES):
        ahead = 0.5 * h * velocity[j]
        load, slope = load_torque(rows, fixed, j, angle[j] + ahead)
        old_a, new_a, slope_a, drag_a = turning(rows, fixed, j, 0, 0, work)
        old_b, new_b, slope_b, drag_b = turning(rows, fixed, j, 0, 1, work)
        old, new = load + old_a + old_b, load + new_a + new_b
        slope = max(1.0, slope + slope_a + slope_b)
        per_inertia = 1.0 / inertia_of(rows, fixed, j)
        drag = (fixed[K.LINK_DAMPING][j] + drag_a + drag_b) * per_inertia
        du, velocity[j] = turn(
            rows, fixed, j, velocity[j], (old + slope * ahead) * per_inertia,
            (new - old) * per_inertia / h, slope * per_inertia, drag, per_inertia, h,
        )  # fmt: skip
        angle[j] = angle[j] + du
        contract(rows, fixed, j, 0, angle[j])
    lag_of(rows, fixed, counts, table, state, elements, 2, 0, LANES)


@kernel
def follow(
    rows: Any, fixed: Any, counts: Any, table: Any, state: int, elements: int, h: float, work: Any
) -> None:
    """Move the reduced plant by one sub-step."""
    angle, velocity = rows[K.ANGLE], rows[K.VELOCITY]
    for j in range(LANES):
        rows[K.AT_A][j] = rows[K.COMMAND][j]
    lag_of(rows, fixed, counts, table, state, elements, 1, 0, LANES)
    for j in range(LANES):
        ahead = 0.5 * h * velocity[j]
        pole, per_stiffness = fixed[K.NOMINAL_POLE][j], 1.0 / fixed[K.NOMINAL_STIFFNESS][j]
        torque, slope = load_torque(rows, fixed, j, angle[j] + ahead)
        target = rows[K.COMMAND][j] - fixed[K.HYSTERESIS_WIDTH][j] * rows[K.LAG_A][j]
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
def report_reduced(rows: Any, fixed: Any, j: int) -> None:
    """Write the signals of the reduced plant; forces are those of the law alone."""
    lag = rows[K.LAG_A][j]
    rows[K.LAG_A][j] = 0.0
    report_muscles(rows, fixed, j)
    rows[K.LAG_A][j] = lag


@routine
def begin_lane(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int,
    angle: float, prestress: float,
) -> None:  # fmt: skip
    """Bring one lane to rest at a commanded angle [rad] and co-contraction [N].

    The joint comes there from a straight and virgin state; payload, disturbance, member and a
    cleared hysteresis (:func:`start_hysteresis`) are set before.
    """
    command(rows, fixed, j, angle, prestress, K.COMMAND, K.PRESTRESS, K.SET_POINT_A)
    begin_filled(rows, fixed, counts, table, hysteresis, elements, j)


@routine
def begin_filled(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int
) -> None:
    """Bring one lane to rest at its setpoints [Pa], as :func:`begin_lane`."""
    rows[K.PRESSURE_A][j], rows[K.PRESSURE_B][j] = (
        rows[K.SET_POINT_A][j],
        rows[K.SET_POINT_A + 1][j],
    )
    straight, _, _ = lever_of(fixed, j, 0.0, 1.0)
    rows[K.STRAIGHT][j] = straight
    rows[K.LAG_A][j] = rows[K.LAG_A + 1][j] = 0.0
    begin_delays(rows, j)
    begin_muscles(rows, fixed, j)
    rest(rows, fixed, counts, table, hysteresis, elements, j)
    rows[K.VELOCITY][j] = 0.0
    begin_enclosed(rows, fixed, j)
    report_state(rows, fixed, j)
    begin_sensors(rows, fixed, j)


@kernel
def resting_torque(rows: Any, fixed: Any, j: int, angle: float) -> float:
    """Return the torque at rest [N m] at an angle, with the lags of hysteresis at that angle."""
    torque, _ = load_torque(rows, fixed, j, angle)
    for side in range(2):
        sign = 1.0 - 2.0 * side
        x, rate, _ = lever_of(fixed, j, angle, sign)
        effective = rows[PAIR.effective + side][j]
        force, _ = pulled(fixed, j, sign, x, 0.0, effective, rows[K.LAG_A + side][j])
        torque = torque - force * rate
    return torque


@routine
def rest_muscles(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int
) -> None:
    """Put a lane where its torques balance at its pressures, and its hysteresis models with it."""
    low, high = -fixed[K.LINK_STOP][j] - 0.1, fixed[K.LINK_STOP][j] + 0.1
    for _ in range(52):
        angle = 0.5 * (low + high)
        contract(rows, fixed, j, 0, angle)
        peek_at(rows, fixed, counts, table, hysteresis, elements, 0, 2, j, j + 1)
        if resting_torque(rows, fixed, j, angle) > 0.0:
            low = angle
        else:
            high = angle
    rows[K.ANGLE][j] = 0.5 * (low + high)
    contract(rows, fixed, j, 0, rows[K.ANGLE][j])
    lag_of(rows, fixed, counts, table, hysteresis, elements, 2, j, j + 1)


@routine
def rest_reduced(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int
) -> None:
    """Put a lane of the reduced plant where it comes to rest under its command."""
    rows[K.AT_A][j] = rows[K.COMMAND][j]
    lag_of(rows, fixed, counts, table, hysteresis, elements, 1, j, j + 1)
    target = rows[K.COMMAND][j] - fixed[K.HYSTERESIS_WIDTH][j] * rows[K.LAG_A][j]
    angle = target
    for _ in range(30):
        torque, slope = load_torque(rows, fixed, j, angle)
        off = target - angle + torque / fixed[K.NOMINAL_STIFFNESS][j]
        angle = angle + off / (1.0 + max(0.0, slope) / fixed[K.NOMINAL_STIFFNESS][j])
    rows[K.ANGLE][j] = angle


DYNAMICS: dict[str, dict[str, Any]] = {
    "muscles": {"move": swing, "rest": rest_muscles, "report_state": report_muscles},
    "reduced": {"move": follow, "rest": rest_reduced, "report_state": report_reduced},
}


def replacements(kind: str, dynamics: str, effects: int | None = None) -> dict[str, Any]:
    """Return the kernels of a variant; ``effects``: first row of their state, None if plain."""
    return pair_kernels(kind, K, 1, effects) | DYNAMICS[dynamics]
