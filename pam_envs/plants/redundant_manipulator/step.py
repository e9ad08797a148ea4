"""One control period of the redundant manipulator, for one environment or a tile of them.

    M(q) q'' + bias(q, q') = torques of the muscles - D q' + disturbances

A sub-step takes the predicted middle for everything that depends on the pose, and is implicit in
the stiffness and damping of the joints, which their inertia couples:

    (M + h/2 D + h^2/4 K) dv = h [torque - bias - D v]

It is of second order, and has no stability limit from stiff muscles on light links.

A factor ``f`` of all links' masses multiplies M and bias, with the payload over ``f`` in them: so
``f`` divides the other terms, and those of the chain do not depend on it.
"""

from typing import Any

from pam_envs.hysteresis import protocol
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.mechanics.serial_chain.kernels import (
    CENTRE,
    GRAVITY_ROWS,
    LENGTH,
    LINK_ROWS,
    MASS,
    N_STAGES,
    TURN_X,
    chain_solve,
    chain_terms,
    mass_row,
)
from pam_envs.mechanics.serial_chain.kernels import work_rows as chain_work_rows
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
    pull_of,
    report_muscles,
    report_state,
    stop_torque,
    turning,
)
from pam_envs.plants.core.sensors import begin_sensors
from pam_envs.plants.redundant_manipulator import rows as M

CHAIN_WORK = 6 * M.MOST_STAGES
"""First row of the chain's scratch, after pressures before the sub-step and geometry at its middle
of each muscle."""
RESTING = 30
"""Steps to the pose at rest."""

# placeholders: rows of state of a hysteresis model, and its friction
MODEL_STATE = 0
friction_of: Any = None
SENSED_ANGLE, SENSED_PRESSURE = M.ANGLE, M.PRESSURE
"""Rows of readings; those of the extended plant replace them."""


@kernel
def predict_middles(rows: Any, fixed: Any, h: float, work: Any) -> None:
    """Write the predicted middle of a sub-step, and the payload of the nominal links."""
    for j in range(LANES):
        rows[M.SHARE][j] = rows[M.PAYLOAD][j] / fixed[M.ARM_MASS_FACTOR][j]
    for k in range(N_STAGES):
        for j in range(LANES):
            v = rows[M.VELOCITY + k][j]
            middle = rows[M.ANGLE + k][j] + 0.5 * h * v
            rows[M.MIDDLE + k][j] = middle
            rows[M.MIDDLE_RATE + k][j] = v + 0.5 * rows[M.CHANGE + k][j]
            predict(rows, fixed, j, k, middle, work)


@kernel
def balance(rows: Any, fixed: Any, k: int, h: float, work: Any) -> None:
    """Write right-hand side and diagonal of joint ``k``."""
    velocity, disturbance = rows[M.VELOCITY + k], rows[M.DISTURBANCE + k]
    bias, right = work[CHAIN_WORK + k], work[CHAIN_WORK + N_STAGES + k]
    diagonal = work[mass_row(CHAIN_WORK, N_STAGES, k, k)]
    for j in range(LANES):
        stop, slope = stop_torque(fixed, j, rows[M.MIDDLE + k][j])
        old_a, new_a, slope_a, drag_a = turning(rows, fixed, j, k, 0, work)
        old_b, new_b, slope_b, drag_b = turning(rows, fixed, j, k, 1, work)
        torque = stop + disturbance[j] + 0.5 * (old_a + new_a + old_b + new_b)
        own = fixed[M.ARM_DAMPING_FACTOR][j] * fixed[M.JOINT_DAMPING + k][j]
        drag = fixed[M.LINK_DAMPING][j] + own + drag_a + drag_b
        slope = max(0.0, slope + slope_a + slope_b)
        per = 1.0 / fixed[M.ARM_MASS_FACTOR][j]
        right[j] = h * (per * (torque - drag * velocity[j]) - bias[j])
        diagonal[j] = diagonal[j] + per * (0.5 * h * drag + 0.25 * h * h * slope)


@kernel
def swing(
    rows: Any, fixed: Any, counts: Any, table: Any, state: int, elements: int, h: float, work: Any
) -> None:
    """Move the arm by one sub-step."""
    predict_middles(rows, fixed, h, work)
    peek_at(rows, fixed, counts, table, state, elements, 0, 2 * N_STAGES, 0, LANES)
    chain_terms(rows, fixed, work, M.MIDDLE, M.MIDDLE_RATE, M.SHARE, M.CHAIN, CHAIN_WORK)
    for k in range(N_STAGES):
        balance(rows, fixed, k, h, work)
    chain_solve(work, CHAIN_WORK)
    for k in range(N_STAGES):
        angle, velocity = rows[M.ANGLE + k], rows[M.VELOCITY + k]
        change, found = rows[M.CHANGE + k], work[CHAIN_WORK + N_STAGES + k]
        for j in range(LANES):
            change[j] = found[j]
            angle[j] = angle[j] + h * (velocity[j] + 0.5 * found[j])
            velocity[j] = velocity[j] + found[j]
    for k in range(N_STAGES):
        for j in range(LANES):
            contract(rows, fixed, j, k, rows[M.ANGLE + k][j])
    lag_of(rows, fixed, counts, table, state, elements, 2 * N_STAGES, 0, LANES)


@routine
def begin_lane(
    rows: Any, fixed: Any, counts: Any, table: Any, state: int, elements: int, j: int, work: Any
) -> None:
    """Bring one lane to rest at its commanded angles [rad] and co-contractions [N].

    The arm comes there from a straight virgin state; commands, disturbances, payload, member and a
    cleared hysteresis (:func:`start_hysteresis`) are set before.
    """
    for k in range(N_STAGES):
        asked, stress, a = rows[M.COMMAND + k][j], rows[M.PRESTRESS + k][j], 2 * k
        command(rows, fixed, j, asked, stress, M.COMMAND + k, M.PRESTRESS + k, M.SET_POINT + a)
    begin_filled(rows, fixed, counts, table, state, elements, j, work)


@routine
def begin_filled(
    rows: Any, fixed: Any, counts: Any, table: Any, state: int, elements: int, j: int, work: Any
) -> None:
    """Bring one lane to rest at its setpoints [Pa], as :func:`begin_lane`.

    The search for the pose at rest starts at the commanded angles.
    """
    straight, _, _ = lever_of(fixed, j, 0.0, 1.0)
    rows[M.STRAIGHT][j] = straight
    factor = fixed[M.ARM_MASS_FACTOR][j]
    rows[M.SHARE][j] = rows[M.PAYLOAD][j] / factor
    for k in range(N_STAGES):
        a = 2 * k
        rows[M.PRESSURE + a][j], rows[M.PRESSURE + a + 1][j] = (
            rows[M.SET_POINT + a][j],
            rows[M.SET_POINT + a + 1][j],
        )
        rows[M.VELOCITY + k][j] = rows[M.MIDDLE_RATE + k][j] = 0.0
        rows[M.CHANGE + k][j] = weight_bound(rows, fixed, j, k)
        rows[M.ANGLE + k][j] = rows[M.COMMAND + k][j]
    begin_delays(rows, j)
    begin_muscles(rows, fixed, j)
    for _ in range(RESTING):
        for k in range(N_STAGES):
            rows[M.MIDDLE + k][j] = rows[M.ANGLE + k][j]
        chain_terms(rows, fixed, work, M.MIDDLE, M.MIDDLE_RATE, M.SHARE, M.CHAIN, CHAIN_WORK)
        for k in range(N_STAGES):
            weight = factor * work[CHAIN_WORK + k][j]
            settle(rows, fixed, counts, table, state, elements, j, k, weight)
    for k in range(N_STAGES):
        rows[M.CHANGE + k][j] = 0.0
        contract(rows, fixed, j, k, rows[M.ANGLE + k][j])
    lag_of(rows, fixed, counts, table, state, elements, 2 * N_STAGES, j, j + 1)
    begin_enclosed(rows, fixed, j)
    report_state(rows, fixed, j)
    begin_sensors(rows, fixed, j)


@kernel
def weight_bound(rows: Any, fixed: Any, j: int, k: int) -> float:
    """Return a bound on the change of the weight torque of joint ``k`` by all angles [N m/rad].

    For the straight arm: the weight beyond both joints, for joints whose axes are not orthogonal.
    """
    total = 0.0
    for i in range(N_STAGES):
        here, other = M.CHAIN + GRAVITY_ROWS + LINK_ROWS * k, M.CHAIN + GRAVITY_ROWS + LINK_ROWS * i
        along = 0.0
        for r in range(3):
            along = along + fixed[here + TURN_X + r][j] * fixed[other + TURN_X + r][j]
        total = total + abs(along) * moment_beyond(rows, fixed, j, max(i, k))
    return total


@kernel
def moment_beyond(rows: Any, fixed: Any, j: int, i: int) -> float:
    """Return the weight beyond joint ``i`` of the straight arm, times its distance."""
    moment, distance = 0.0, 0.0
    for k in range(i, N_STAGES):
        link = M.CHAIN + GRAVITY_ROWS + LINK_ROWS * k
        moment = moment + fixed[link + MASS][j] * (distance + fixed[link + CENTRE][j])
        distance = distance + fixed[link + LENGTH][j]
    moment = moment + rows[M.SHARE][j] * distance
    gravity = 0.0
    for r in range(GRAVITY_ROWS):
        gravity = gravity + abs(fixed[M.CHAIN + r][j])
    return gravity * fixed[M.ARM_MASS_FACTOR][j] * moment  # type: ignore[no-any-return]


@kernel
def settle(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int, k: int,
    weight: float,
) -> None:  # fmt: skip
    """Move joint ``k`` of a lane towards its rest against a weight's torque [N m]."""
    angle = rows[M.ANGLE + k][j]
    contract(rows, fixed, j, k, angle)
    peek_at(
        rows, fixed, counts, table, hysteresis + 2 * k * MODEL_STATE, elements, 2 * k, 2, j, j + 1
    )
    torque, slope = pull_of(rows, fixed, j, k, angle)
    for m in range(2 * k, 2 * k + 2):
        _, rate, _ = lever_of(fixed, j, angle, 1.0 - 2.0 * (m - 2 * k))
        stuck = friction_of(fixed, j, rows[PAIR.effective + m][j]) * rows[M.STICK + m][j]
        slope = slope + stuck * rate * rate / fixed[M.MUSCLE_REST_LENGTH][j]
    stop, hard = stop_torque(fixed, j, angle)
    off = torque + stop + rows[M.DISTURBANCE + k][j] - weight
    step = off / (max(5.0, slope) + hard + rows[M.CHANGE + k][j])
    rows[M.ANGLE + k][j] = angle + max(-0.1, min(0.1, step))


def hysteresis_rows(kind: str, stages: int) -> int:
    """Return how many rows of state the hysteresis models take."""
    return 2 * stages * protocol.state_rows(kind)


def work_rows(stages: int) -> int:
    """Return how many rows of scratch :func:`advance` takes."""
    return CHAIN_WORK + chain_work_rows(stages)


def replacements(kind: str, stages: int, effects: int | None = None) -> dict[str, Any]:
    """Return the kernels of a variant; ``effects``: first row of their state, None if plain."""
    moves = {"N_STAGES": stages, "move": swing, "report_state": report_muscles}
    return pair_kernels(kind, M, stages, effects) | moves
