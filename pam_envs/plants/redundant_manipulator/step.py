"""One control period of the redundant manipulator, for one environment or a tile of them.

    M(q) q'' + bias(q, q') = torques of the muscles - D q' + disturbances

A sub-step takes the predicted middle for everything that depends on the pose, and is implicit in
the stiffness and damping of the joints, which their inertia couples:

    (M + h/2 D + h^2/4 K) dv = h [torque - bias - D v]

It is of second order, and has no stability limit from stiff muscles on light links.

A factor ``f`` of all links' masses multiplies M and bias, with the payload over ``f`` in them: so
``f`` divides the other terms, and those of the chain do not depend on it.
"""

from __future__ import annotations

from typing import Any

from pam_envs.hysteresis import protocol
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.mechanics.serial_chain.dynamics import chain_solve, chain_terms
from pam_envs.mechanics.serial_chain.kinematics import N_STAGES
from pam_envs.mechanics.serial_chain.rows import (
    CENTRE,
    GRAVITY_ROWS,
    LENGTH,
    LINK_ROWS,
    MASS,
    TURN_X,
    mass_row,
)
from pam_envs.mechanics.serial_chain.rows import work_rows as chain_work_rows
from pam_envs.plants.antagonistic_joint.pair import (
    air_of,
    clear_hysteresis_models,
    command,
    contract,
    feed_forward,
    fill,
    friction_of,
    lever_of,
    pulled,
    stop_torque,
    turning,
)
from pam_envs.plants.core.sensors import read_sensors
from pam_envs.plants.redundant_manipulator import rows as M
from pam_envs.plants.redundant_manipulator.effects import effect_kernels
from pam_envs.plants.redundant_manipulator.rows import (
    ANGLE,
    AT,
    CHAIN,
    CHANGE,
    COMMAND,
    DAMPING,
    DAMPING_FACTOR,
    DISTURBANCE,
    JOINT_DAMPING,
    LAG,
    MASS_FACTOR,
    MEMBER,
    MIDDLE,
    MIDDLE_RATE,
    MODEL,
    MOST_STAGES,
    PAYLOAD,
    PRESSURE,
    PRESTRESS,
    REST_LENGTH,
    SET_POINT,
    SHARE,
    STACK_COUNT,
    STICK,
    STRAIGHT,
    VELOCITY,
)

__all__ = [
    "CHAIN_WORK",
    "advance",
    "begin_lane",
    "feed_forward",
    "hysteresis_rows",
    "replacements",
    "start_hysteresis",
    "work_rows",
]

WAS, RATE, CURVE = 0, 2 * MOST_STAGES, 4 * MOST_STAGES
"""First rows of scratch: pressures before the sub-step, geometry at its middle."""
CHAIN_WORK = 6 * MOST_STAGES
"""First row of the chain's scratch."""
RESTING = 30
"""Steps to the pose at rest."""

# placeholders, filled in for each hysteresis
hysteresis_lag: Any = None
hysteresis_peek: Any = None
MODEL_STATE = 0
EFFECTIVE, SENSED_ANGLE, SENSED_PRESSURE = PRESSURE, ANGLE, PRESSURE
"""Rows of effective pressures and readings; those of the extended plant replace them."""


@kernel
def regulate(
    rows: Any, fixed: Any, counts: Any, m: int, i: int, substeps: int, period: float, work: Any
) -> None:
    """Advance the pressure of muscle ``m`` of a tile through a sub-step."""
    h = period / substeps
    fill(rows[PRESSURE + m], rows[SET_POINT + m], work[WAS + m], fixed, h)


@kernel
def begin_muscles(rows: Any, fixed: Any, j: int) -> None:
    """Begin the effects of the muscles: a plain plant has none."""


@kernel
def foresee(rows: Any, fixed: Any, h: float, work: Any) -> None:
    """Write the predicted middle of a sub-step, and the payload of the nominal links."""
    for j in range(LANES):
        rows[SHARE][j] = rows[PAYLOAD][j] / fixed[MASS_FACTOR][j]
    for k in range(N_STAGES):
        a, b = 2 * k, 2 * k + 1
        for j in range(LANES):
            v = rows[VELOCITY + k][j]
            middle = rows[ANGLE + k][j] + 0.5 * h * v
            rows[MIDDLE + k][j] = middle
            rows[MIDDLE_RATE + k][j] = v + 0.5 * rows[CHANGE + k][j]
            x_a, work[RATE + a][j], work[CURVE + a][j] = lever_of(fixed, j, middle, 1.0)
            x_b, work[RATE + b][j], work[CURVE + b][j] = lever_of(fixed, j, middle, -1.0)
            rows[AT + a][j], rows[AT + b][j] = x_a - rows[STRAIGHT][j], x_b - rows[STRAIGHT][j]


@kernel
def balance(rows: Any, fixed: Any, k: int, h: float, work: Any) -> None:
    """Write right-hand side and diagonal of joint ``k``."""
    velocity, disturbance, straight = rows[VELOCITY + k], rows[DISTURBANCE + k], rows[STRAIGHT]
    bias, right = work[CHAIN_WORK + k], work[CHAIN_WORK + N_STAGES + k]
    diagonal, a, b = work[mass_row(CHAIN_WORK, N_STAGES, k, k)], 2 * k, 2 * k + 1
    for j in range(LANES):
        stop, slope = stop_torque(fixed, j, rows[MIDDLE + k][j])
        old_a, new_a, slope_a, drag_a = turning(
            fixed, j, 1.0, rows[AT + a][j] + straight[j], work[RATE + a][j], work[CURVE + a][j],
            velocity[j], work[WAS + a][j], rows[EFFECTIVE + a][j], rows[LAG + a][j],
            rows[STICK + a][j],
        )  # fmt: skip
        old_b, new_b, slope_b, drag_b = turning(
            fixed, j, -1.0, rows[AT + b][j] + straight[j], work[RATE + b][j], work[CURVE + b][j],
            velocity[j], work[WAS + b][j], rows[EFFECTIVE + b][j], rows[LAG + b][j],
            rows[STICK + b][j],
        )  # fmt: skip
        torque = stop + disturbance[j] + 0.5 * (old_a + new_a + old_b + new_b)
        own = fixed[DAMPING_FACTOR][j] * fixed[JOINT_DAMPING + k][j]
        drag = fixed[DAMPING][j] + own + drag_a + drag_b
        slope = max(0.0, slope + slope_a + slope_b)
        per = 1.0 / fixed[MASS_FACTOR][j]
        right[j] = h * (per * (torque - drag * velocity[j]) - bias[j])
        diagonal[j] = diagonal[j] + per * (0.5 * h * drag + 0.25 * h * h * slope)


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
    """Move the arm by one sub-step."""
    foresee(rows, fixed, h, work)
    hysteresis_peek(
        rows, fixed, counts, table, hysteresis, elements, AT, LAG, STICK, 2 * N_STAGES, MODEL,
        STACK_COUNT, MEMBER, 0, LANES,
    )  # fmt: skip
    chain_terms(rows, fixed, work, MIDDLE, MIDDLE_RATE, SHARE, CHAIN, CHAIN_WORK)
    for k in range(N_STAGES):
        balance(rows, fixed, k, h, work)
    chain_solve(work, CHAIN_WORK)
    for k in range(N_STAGES):
        angle, velocity = rows[ANGLE + k], rows[VELOCITY + k]
        change, found = rows[CHANGE + k], work[CHAIN_WORK + N_STAGES + k]
        for j in range(LANES):
            change[j] = found[j]
            angle[j] = angle[j] + h * (velocity[j] + 0.5 * found[j])
            velocity[j] = velocity[j] + found[j]
    for k in range(N_STAGES):
        for j in range(LANES):
            contract(rows, fixed, j, rows[ANGLE + k][j], AT + 2 * k, STRAIGHT)
    hysteresis_lag(
        rows, fixed, counts, table, hysteresis, elements, AT, LAG, 2 * N_STAGES, MODEL, STACK_COUNT,
        MEMBER, 0, LANES,
    )  # fmt: skip


@kernel
def advance(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, substeps: int,
    period: float, work: Any,
) -> None:  # fmt: skip
    """Advance a tile by one control period, towards its set-points.

    Parameters
    ----------
    rows, fixed, counts : rows
        State, parameters and whole numbers (``redundant_manipulator_rows``). ``SET_POINT`` [Pa],
        ``DISTURBANCE`` [N m] and ``PAYLOAD`` [kg] are the caller's to write.
    table : array
        Of the hysteresis: ``RedundantManipulator.hysteresis_tables()``.
    hysteresis, elements : int
        First row of the hysteresis state, and ``RedundantManipulator.elements``.
    substeps, period : int, float
        Sub-steps and duration [s] of the period.
    work : rows
        ``work_rows(stages)`` rows of scratch.
    """
    h = period / substeps
    for i in range(substeps):
        for m in range(2 * N_STAGES):
            regulate(rows, fixed, counts, m, i, substeps, period, work)
        swing(rows, fixed, counts, table, hysteresis, elements, h, work)
    for j in range(LANES):
        report(rows, fixed, j)
        read_sensors(rows, fixed, j, counts[M.STEP][j] + 1, period)


@kernel
def pull_of(rows: Any, fixed: Any, j: int, k: int, angle: float) -> tuple[float, float]:
    """Return torque [N m] and stiffness [N m/rad] of the muscles of joint ``k``, and note them."""
    torque, stiffness = 0.0, 0.0
    for side in range(2):
        m, sign = 2 * k + side, 1.0 - 2.0 * side
        x, rate, curve = lever_of(fixed, j, angle, sign)
        speed = -rate * rows[VELOCITY + k][j] / fixed[REST_LENGTH][j]
        effective = rows[EFFECTIVE + m][j]
        force, slope = pulled(fixed, j, sign, x, speed, effective, rows[LAG + m][j])
        rows[M.CONTRACTION + m][j], rows[M.FORCE + m][j] = x, force
        torque = torque - force * rate
        stiffness = stiffness + slope * rate * rate / fixed[REST_LENGTH][j] + force * curve
    return torque, stiffness


@kernel
def report(rows: Any, fixed: Any, j: int) -> None:
    """Write what can be seen of one lane."""
    air, slack = 0.0, 0.0
    for k in range(N_STAGES):
        torque, stiffness = pull_of(rows, fixed, j, k, rows[ANGLE + k][j])
        rows[M.TORQUE + k][j], rows[M.STIFFNESS + k][j] = torque, stiffness
    for m in range(2 * N_STAGES):
        air = air + air_of(fixed, j, rows[M.CONTRACTION + m][j], rows[PRESSURE + m][j])
        slack = slack + (0.0 if rows[M.FORCE + m][j] > 0.0 else 1.0)
    rows[M.AIR][j], rows[M.SLACK][j] = air, slack


@kernel
def start_hysteresis(rows: Any, counts: Any, hysteresis: int, j: int) -> None:
    """Put the hysteresis models of one lane into their virgin state."""
    clear_hysteresis_models(rows, counts, hysteresis, STACK_COUNT, 2 * MOST_STAGES, j)


@routine
def begin_lane(
    rows: Any,
    fixed: Any,
    counts: Any,
    table: Any,
    hysteresis: int,
    elements: int,
    j: int,
    work: Any,
) -> None:
    """Bring one lane to rest at its commanded angles [rad] and co-contractions [N].

    ``COMMAND``, ``PRESTRESS``, ``DISTURBANCE``, ``PAYLOAD`` and ``counts[MEMBER]`` are set before,
    and the hysteresis cleared with :func:`start_hysteresis`: the arm comes from a straight virgin
    state.
    """
    straight, _, _ = lever_of(fixed, j, 0.0, 1.0)
    rows[STRAIGHT][j] = straight
    factor = fixed[MASS_FACTOR][j]
    rows[SHARE][j] = rows[PAYLOAD][j] / factor
    for k in range(N_STAGES):
        asked, stress, a = rows[COMMAND + k][j], rows[PRESTRESS + k][j], 2 * k
        command(rows, fixed, j, asked, stress, COMMAND + k, PRESTRESS + k, SET_POINT + a)
        rows[PRESSURE + a][j], rows[PRESSURE + a + 1][j] = (
            rows[SET_POINT + a][j],
            rows[SET_POINT + a + 1][j],
        )
        rows[VELOCITY + k][j] = rows[MIDDLE_RATE + k][j] = 0.0
        rows[CHANGE + k][j] = weight_bound(rows, fixed, j, k)
        rows[ANGLE + k][j] = rows[COMMAND + k][j]
    begin_muscles(rows, fixed, j)
    for _ in range(RESTING):
        for k in range(N_STAGES):
            rows[MIDDLE + k][j] = rows[ANGLE + k][j]
        chain_terms(rows, fixed, work, MIDDLE, MIDDLE_RATE, SHARE, CHAIN, CHAIN_WORK)
        for k in range(N_STAGES):
            weight = factor * work[CHAIN_WORK + k][j]
            settle(rows, fixed, counts, table, hysteresis, elements, j, k, weight)
    for k in range(N_STAGES):
        rows[CHANGE + k][j] = 0.0
        contract(rows, fixed, j, rows[ANGLE + k][j], AT + 2 * k, STRAIGHT)
    hysteresis_lag(
        rows, fixed, counts, table, hysteresis, elements, AT, LAG, 2 * N_STAGES, MODEL, STACK_COUNT,
        MEMBER, j, j + 1,
    )  # fmt: skip
    report(rows, fixed, j)
    read_sensors(rows, fixed, j, 0, 0.0)


@kernel
def weight_bound(rows: Any, fixed: Any, j: int, k: int) -> float:
    """Return by how much all joints together change the weight on joint ``k``, at most [N m/rad].

    Of the straight arm: what hangs beyond both joints, where their axes are not across.
    """
    total = 0.0
    for i in range(N_STAGES):
        here, other = CHAIN + GRAVITY_ROWS + LINK_ROWS * k, CHAIN + GRAVITY_ROWS + LINK_ROWS * i
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
        link = CHAIN + GRAVITY_ROWS + LINK_ROWS * k
        moment = moment + fixed[link + MASS][j] * (distance + fixed[link + CENTRE][j])
        distance = distance + fixed[link + LENGTH][j]
    moment = moment + rows[SHARE][j] * distance
    gravity = 0.0
    for r in range(GRAVITY_ROWS):
        gravity = gravity + abs(fixed[CHAIN + r][j])
    return gravity * fixed[MASS_FACTOR][j] * moment  # type: ignore[no-any-return]


@kernel
def settle(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int, k: int,
    weight: float,
) -> None:  # fmt: skip
    """Move joint ``k`` of a lane towards its rest against a weight's torque [N m]."""
    angle = rows[ANGLE + k][j]
    contract(rows, fixed, j, angle, AT + 2 * k, STRAIGHT)
    hysteresis_peek(
        rows, fixed, counts, table, hysteresis + 2 * k * MODEL_STATE, elements, AT + 2 * k,
        LAG + 2 * k, STICK + 2 * k, 2, MODEL, STACK_COUNT + 2 * k, MEMBER, j, j + 1,
    )  # fmt: skip
    torque, slope = pull_of(rows, fixed, j, k, angle)
    for m in range(2 * k, 2 * k + 2):
        _, rate, _ = lever_of(fixed, j, angle, 1.0 - 2.0 * (m - 2 * k))
        stuck = friction_of(fixed, j, rows[EFFECTIVE + m][j]) * rows[STICK + m][j]
        slope = slope + stuck * rate * rate / fixed[REST_LENGTH][j]
    stop, hard = stop_torque(fixed, j, angle)
    off = torque + stop + rows[DISTURBANCE + k][j] - weight
    step = off / (max(5.0, slope) + hard + rows[CHANGE + k][j])
    rows[ANGLE + k][j] = angle + max(-0.1, min(0.1, step))


def hysteresis_rows(kind: str, stages: int) -> int:
    """Return how many rows of state the hysteresis models take."""
    return 2 * stages * protocol.state_rows(kind)


def work_rows(stages: int) -> int:
    """Return how many rows of scratch :func:`advance` takes."""
    return CHAIN_WORK + chain_work_rows(stages)


def replacements(kind: str, stages: int, effects: int | None = None) -> dict[str, Any]:
    """Return what a plant of this make puts in the place of the placeholders.

    ``effects`` is the first row of the state of the effects; None for a plain plant.
    """
    extended = {} if effects is None else effect_kernels(stages, effects)
    return protocol.kernels(kind) | {"N_STAGES": stages} | extended
