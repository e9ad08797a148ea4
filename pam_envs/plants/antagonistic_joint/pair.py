"""Kernels of a pair of muscles on the lever of one stage, the same alone and in a chain."""

import math
from collections import namedtuple
from typing import Any

from pam_envs.constants import ATMOSPHERE, DENSITY_PER_PRESSURE
from pam_envs.hysteresis import protocol
from pam_envs.hysteresis.slip import LIMIT, STATE_ROWS
from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import LANES, kernel
from pam_envs.mechanics.antagonistic_lever import span, squares
from pam_envs.muscle.force_map import force_terms, inner_volume
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint.hysteresis import REFERENCE_PRESSURE
from pam_envs.plants.core.muscle_path import DELAYED, begin_delay, follow_set_point
from pam_envs.plants.core.sensors import read_sensors

PAIR: Any = None
"""Placeholder: rows of the plant whose joints have the pairs (:func:`pair_rows`)."""
N_PAIRS = 1  # placeholder: number of joints
# placeholders, filled in for each plant and each hysteresis
hysteresis_lag: Any = None
hysteresis_peek: Any = None
set_limits: Any = None
friction_of: Any = None
move: Any = None
report_state: Any = None

ROWS = (
    "angle velocity pressure set_point command prestress force contraction lag at stick torque "
    "stiffness straight air slack delay model"
)
"""Rows of a plant that these kernels read: of joint ``k`` the row of the first and ``k``, of
muscle ``m`` that of the first and ``m``."""


def friction_kernels(kind: str) -> dict[str, Any]:
    """Return the kernels of the friction of a kind of hysteresis by their placeholders."""
    by_length = protocol.model_of(kind).drive == "length"
    return protocol.kernels(kind) | {
        "set_limits": write_limits if by_length else leave_limits,
        "friction_of": constant_friction if by_length else friction_at,
    }


def pair_rows(layout: Any, effects: int | None) -> Any:
    """Return the rows of a plant with pairs; ``effects``: first row of the effects' state."""
    found = {n: getattr(layout, n.upper(), None) for n in ROWS.split()}
    found = {n: getattr(layout, f"{n.upper()}_A") if r is None else r for n, r in found.items()}
    if effects is None:
        found |= {"effective": found["pressure"], "paths": 0, "deflection": 0, "yielded": 0}
    else:
        own = layout.STATE
        found |= {"effective": effects + own.effective, "paths": effects + own.paths}
        found |= {"deflection": effects + own.deflection, "yielded": effects + own.yielded}
    found |= {
        name: getattr(layout.EFFECT, name) for name in ("path", "warm", "law", "soft", "uneven")
    }
    return namedtuple("PairRows", tuple(found))(**found)


@kernel
def regulate(
    rows: Any, fixed: Any, counts: Any, m: int, i: int, substeps: int, period: float, work: Any
) -> None:
    """Advance the pressure of muscle ``m`` of a tile through a sub-step; keep those before."""
    pressure, set_point, was = rows[PAIR.pressure + m], rows[PAIR.set_point + m], work[m]
    for j in range(LANES):
        was[j] = pressure[j]
    follow_set_point(
        rows, fixed, PAIR.delay + m * DELAYED.end, K.REGULATOR_MAX_PRESSURE, pressure, set_point,
        counts[K.STEP], i, substeps, period,
    )  # fmt: skip


@kernel
def begin_delays(rows: Any, j: int) -> None:
    """Begin the dead times of all muscles of lane ``j`` under its setpoints."""
    for m in range(2 * N_PAIRS):
        begin_delay(rows, j, PAIR.delay + m * DELAYED.end, rows[PAIR.set_point + m][j])


@kernel
def begin_muscles(rows: Any, fixed: Any, j: int) -> None:
    """Begin the effects of the muscles: a plain plant has none."""


@kernel
def settle_air(rows: Any, fixed: Any, h: float, work: Any) -> None:
    """Move the enclosed air of a tile with the motion: a plain plant has regulators."""


@kernel
def begin_enclosed(rows: Any, fixed: Any, j: int) -> None:
    """Begin the enclosed air of the muscles of lane ``j``: a plain plant has regulators."""


@kernel
def more_force(fixed: Any, j: int, pressure: float, contraction: float) -> float:
    """Return the force [N] of the law's correction: a plain plant has none."""
    return 0.0


@kernel
def more_stiffness(fixed: Any, j: int, pressure: float, contraction: float) -> float:
    """Return minus the derivative of :func:`more_force` by contraction [N]."""
    return 0.0


@kernel
def rub_of(fixed: Any, j: int, side: float) -> float:
    """Return the friction of a specimen over that of the hysteresis: 1 in a plain plant."""
    return 1.0


@kernel
def leaked_air(rows: Any, fixed: Any, j: int) -> float:
    """Return the air [kg] that leaked in this control period: a plain plant has no leak."""
    return 0.0


@kernel
def enclosed_stiffness(rows: Any, j: int, m: int) -> float:
    """Return the stiffness [N m/rad] of the air in muscle ``m``: none in a plain plant."""
    return 0.0


@kernel
def advance(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, substeps: int,
    period: float, work: Any,
) -> None:  # fmt: skip
    """Advance a tile by one control period, towards its setpoints [Pa].

    The caller writes setpoints, disturbance [N m], payload [kg], and the command that the reduced
    plant follows. ``hysteresis`` is the first row of the hysteresis state, ``elements`` that of the
    plant; ``work`` are rows of scratch.
    """
    h = period / substeps
    for i in range(substeps):
        for m in range(2 * N_PAIRS):
            regulate(rows, fixed, counts, m, i, substeps, period, work)
        move(rows, fixed, counts, table, hysteresis, elements, h, work)
        settle_air(rows, fixed, h, work)
    for j in range(LANES):
        report_state(rows, fixed, j)
    read_sensors(rows, fixed, counts[K.STEP], period)


@kernel
def predict(rows: Any, fixed: Any, j: int, k: int, angle: float, work: Any) -> None:
    """Write contractions, rates and curvatures of the pair of joint ``k`` at an angle."""
    rate, curve, at, straight = 2 * N_PAIRS, 4 * N_PAIRS, PAIR.at + 2 * k, rows[PAIR.straight]
    a, b = 2 * k, 2 * k + 1
    x_a, work[rate + a][j], work[curve + a][j] = lever_of(fixed, j, angle, 1.0)
    x_b, work[rate + b][j], work[curve + b][j] = lever_of(fixed, j, angle, -1.0)
    rows[at][j], rows[at + 1][j] = x_a - straight[j], x_b - straight[j]


@kernel
def contract(rows: Any, fixed: Any, j: int, k: int, angle: float) -> None:
    """Write the contractions of the pair of joint ``k``, from those of the straight joint."""
    x_a, _, _ = lever_of(fixed, j, angle, 1.0)
    x_b, _, _ = lever_of(fixed, j, angle, -1.0)
    at, straight = PAIR.at + 2 * k, rows[PAIR.straight]
    rows[at][j], rows[at + 1][j] = x_a - straight[j], x_b - straight[j]


@kernel
def leave_limits(
    rows: Any, fixed: Any, state: int, m: int, operators: int, first: int, last: int
) -> None:
    """Do nothing: the friction's stiffness depends on pressure, its limits do not."""


@kernel
def write_limits(
    rows: Any, fixed: Any, state: int, m: int, operators: int, first: int, last: int
) -> None:
    """Write the limits of the friction of muscles from ``m`` on, as their slip force grows."""
    for k in range(operators):
        limit, pressure = rows[state + k * STATE_ROWS + LIMIT], rows[PAIR.effective + m + k]
        for j in range(first, last):
            base, rate = fixed[K.HYSTERESIS_BASE][j], fixed[K.HYSTERESIS_RATE][j]
            limit[j] = (base + rate * pressure[j]) / (base + rate * REFERENCE_PRESSURE)


@kernel
def peek_yield(rows: Any, fixed: Any, m: int, operators: int, first: int, last: int) -> None:
    """Add the lags of yielding friction, which does not move: a plain plant has none."""


@kernel
def move_yield(rows: Any, fixed: Any, m: int, operators: int, first: int, last: int) -> None:
    """Move yielding friction and add its lags: a plain plant has none."""


@kernel
def lag_of(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, operators: int,
    first: int, last: int,
) -> None:  # fmt: skip
    """Move the hysteresis of some operators in some lanes to their inputs, and write their lags."""
    set_limits(rows, fixed, hysteresis, 0, operators, first, last)
    hysteresis_lag(
        rows, fixed, counts, table, hysteresis, elements, PAIR.at, PAIR.lag, operators, PAIR.model,
        K.STACK_COUNT, K.MEMBER, first, last,
    )  # fmt: skip
    move_yield(rows, fixed, 0, operators, first, last)


@kernel
def peek_at(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, m: int,
    operators: int, first: int, last: int,
) -> None:  # fmt: skip
    """Write lags and sticking of operators from ``m`` on in some lanes, whose states stay."""
    set_limits(rows, fixed, hysteresis, m, operators, first, last)
    hysteresis_peek(
        rows, fixed, counts, table, hysteresis, elements, PAIR.at + m, PAIR.lag + m,
        PAIR.stick + m, operators, PAIR.model, K.STACK_COUNT + m, K.MEMBER, first, last,
    )  # fmt: skip
    peek_yield(rows, fixed, m, operators, first, last)


@kernel
def lever_of(fixed: Any, j: int, angle: float, side: float) -> tuple[float, float, float]:
    """Return contraction, ``dL/dphi`` [m] and its derivative [m] of the muscle on one side."""
    sine, cosine = sine_and_cosine(angle)
    total, even, odd = squares(
        fixed[K.LEVER_R_U][j], fixed[K.LEVER_R_O][j], fixed[K.LEVER_L_U][j], fixed[K.LEVER_L_O][j]
    )
    length, rate, curve = span(sine, cosine, side, total, even, odd)
    return 1.0 - (length - fixed[K.LEVER_FITTINGS][j]) / fixed[K.MUSCLE_REST_LENGTH][j], rate, curve


@kernel
def terms_of(fixed: Any, j: int, contraction: float) -> tuple[float, float, float, float]:
    """Return the terms of the force at a contraction (:func:`force_terms`)."""
    return force_terms(
        contraction,
        fixed[K.MUSCLE_AREA][j],
        fixed[K.MUSCLE_TAPER][j],
        fixed[K.MUSCLE_THRESHOLD][j],
        fixed[K.MUSCLE_BRAID_FORCE][j],
        fixed[K.MUSCLE_BRAID_STRAIN][j],
        fixed[K.MUSCLE_STIFFNESS][j],
        1.0 / fixed[K.MUSCLE_STRETCH][j],
    )


@kernel
def constant_friction(fixed: Any, j: int, pressure: float) -> float:
    """Return the stiffness of the friction elements [N], whose limits have the pressure."""
    return friction_at(fixed, j, REFERENCE_PRESSURE)


@kernel
def friction_at(fixed: Any, j: int, pressure: float) -> float:
    """Return the friction over the hysteresis lag [N], in proportion to its slip force."""
    return fixed[K.HYSTERESIS_WIDTH][j] * (
        fixed[K.HYSTERESIS_BASE][j] + fixed[K.HYSTERESIS_RATE][j] * pressure
    )


@kernel
def gain_of(fixed: Any, j: int, side: float) -> float:
    """Return the force of a specimen over that of the law."""
    return fixed[K.MUSCLE_GAIN][j] * (1.0 + side * fixed[K.MUSCLE_IMBALANCE][j])


@kernel
def pulled(
    fixed: Any, j: int, side: float, contraction: float, speed: float, pressure: float, lag: float
) -> tuple[float, float]:
    """Return the force of a muscle [N] and minus its derivative by contraction [N].

    ``speed`` [1/s] is that of the contraction, ``lag`` that of the hysteresis; the derivative is
    that of the law alone. A slack muscle has neither force nor stiffness.
    """
    area, passive, less, more = terms_of(fixed, j, contraction)
    gain, lag = gain_of(fixed, j, side), rub_of(fixed, j, side) * lag
    drag = friction_of(fixed, j, pressure) * lag + fixed[K.MUSCLE_VISCOSITY][j] * pressure * speed
    force = gain * (pressure * area - passive + more_force(fixed, j, pressure, contraction)) - drag
    slope = pressure * less + more + more_stiffness(fixed, j, pressure, contraction)
    return max(0.0, force), gain * slope if force > 0.0 else 0.0


@kernel
def pulled_twice(
    fixed: Any, j: int, side: float, contraction: float, speed: float, was: float, pressure: float,
    lag: float, stick: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return the forces [N] at two pressures, without viscosity.

    Then, for the mean pressure, minus the derivative of the force by contraction [N], with the
    sticking part of the friction, and the viscosity [N s]; all are 0 where the muscle is slack.
    """
    area, passive, less, more = terms_of(fixed, j, contraction)
    gain, middle = gain_of(fixed, j, side), 0.5 * (was + pressure)
    rub = rub_of(fixed, j, side)
    lag, stick = rub * lag, rub * stick
    old = gain * (was * area - passive + more_force(fixed, j, was, contraction))
    old = old - friction_of(fixed, j, was) * lag
    new = gain * (pressure * area - passive + more_force(fixed, j, pressure, contraction))
    new = new - friction_of(fixed, j, pressure) * lag
    slope = gain * (middle * less + more + more_stiffness(fixed, j, middle, contraction))
    slope = slope + friction_of(fixed, j, middle) * stick
    drag = fixed[K.MUSCLE_VISCOSITY][j] * middle
    tight = 1.0 if old + new > 2.0 * drag * speed else 0.0
    return tight * old, tight * new, tight * slope, tight * drag


@kernel
def turning(
    rows: Any, fixed: Any, j: int, k: int, side: int, work: Any
) -> tuple[float, float, float, float]:
    """Return the torque [N m] of a muscle of joint ``k`` before and after a sub-step.

    Then minus its derivative by the angle [N m/rad] and its damping [N m s/rad] between them, at
    the geometry of :func:`predict`.
    """
    m, per_length = 2 * k + side, 1.0 / fixed[K.MUSCLE_REST_LENGTH][j]
    rate, curve = work[2 * N_PAIRS + m][j], work[4 * N_PAIRS + m][j]
    speed = -rate * rows[PAIR.velocity + k][j] * per_length
    old, new, stiff, viscous = pulled_twice(
        fixed, j, 1.0 - 2.0 * side, rows[PAIR.at + m][j] + rows[PAIR.straight][j], speed,
        work[m][j], rows[PAIR.effective + m][j], rows[PAIR.lag + m][j], rows[PAIR.stick + m][j],
    )  # fmt: skip
    square = rate * rate * per_length
    stiff = stiff * square + 0.5 * (old + new) * curve + enclosed_stiffness(rows, j, m)
    return -old * rate, -new * rate, stiff, viscous * square


@kernel
def pull_of(rows: Any, fixed: Any, j: int, k: int, angle: float) -> tuple[float, float]:
    """Return torque [N m] and stiffness [N m/rad] of the muscles of joint ``k``, and store them."""
    torque, stiffness = 0.0, 0.0
    for side in range(2):
        m, sign = 2 * k + side, 1.0 - 2.0 * side
        x, rate, curve = lever_of(fixed, j, angle, sign)
        speed = -rate * rows[PAIR.velocity + k][j] / fixed[K.MUSCLE_REST_LENGTH][j]
        effective = rows[PAIR.effective + m][j]
        force, slope = pulled(fixed, j, sign, x, speed, effective, rows[PAIR.lag + m][j])
        rows[PAIR.contraction + m][j], rows[PAIR.force + m][j] = x, force
        torque = torque - force * rate
        stiffness = stiffness + slope * rate * rate / fixed[K.MUSCLE_REST_LENGTH][j] + force * curve
    return torque, stiffness


@kernel
def report_muscles(rows: Any, fixed: Any, j: int) -> None:
    """Write torques, stiffnesses, air and slack muscles of one lane."""
    air, slack = 0.0, 0.0
    for k in range(N_PAIRS):
        torque, stiffness = pull_of(rows, fixed, j, k, rows[PAIR.angle + k][j])
        rows[PAIR.torque + k][j], rows[PAIR.stiffness + k][j] = torque, stiffness
    for m in range(2 * N_PAIRS):
        contraction, pressure = rows[PAIR.contraction + m][j], rows[PAIR.pressure + m][j]
        air = air + air_of(fixed, j, contraction, pressure)
        slack = slack + (0.0 if rows[PAIR.force + m][j] > 0.0 else 1.0)
    rows[PAIR.air][j], rows[PAIR.slack][j] = air, slack


@kernel
def stop_torque(fixed: Any, j: int, angle: float) -> tuple[float, float]:
    """Return the torque of the mechanical stop [N m] and minus its slope [N m/rad]."""
    over = max(0.0, abs(angle) - fixed[K.LINK_STOP][j])
    stiffness = fixed[K.LINK_STOP_STIFFNESS][j]
    torque = -stiffness * over if angle > 0.0 else stiffness * over
    return torque, stiffness if over > 0.0 else 0.0


@kernel
def volume_of(fixed: Any, j: int, contraction: float) -> float:
    """Return the inner volume of a muscle [m3]."""
    bore = 0.25 * math.pi * fixed[K.MUSCLE_DIAMETER][j] * fixed[K.MUSCLE_DIAMETER][j]
    return inner_volume(
        contraction,
        fixed[K.MUSCLE_AREA][j],
        fixed[K.MUSCLE_TAPER][j],
        1.0 / fixed[K.MUSCLE_STRETCH][j],
        bore,
        fixed[K.MUSCLE_REST_LENGTH][j],
    )


@kernel
def air_of(fixed: Any, j: int, contraction: float, pressure: float) -> float:
    """Return the air in a muscle [kg]."""
    space = volume_of(fixed, j, contraction)
    return DENSITY_PER_PRESSURE * (max(0.0, pressure) + ATMOSPHERE) * space


@kernel
def set_pressure(fixed: Any, j: int, contraction: float, force: float) -> tuple[float, float]:
    """Return the pressure [Pa] of a force [N] by the law, at most the highest, and its force."""
    area, passive, _, _ = terms_of(fixed, j, contraction)
    highest = fixed[K.REGULATOR_MAX_PRESSURE][j]
    pressure = (force + passive) / area
    if pressure > highest:
        return highest, highest * area - passive
    return max(0.0, pressure), force


@kernel
def feed_forward(fixed: Any, j: int, angle: float, prestress: float) -> tuple[float, float, float]:
    """Return setpoints [Pa] for an angle [rad] and a co-contraction [N]: fluidic_muscles, Fig. 4.

    The inverse of the law: the forces' mean is ``prestress`` and their torque 0. Where one muscle
    would need more than full pressure the co-contraction is reduced. Hysteresis, gravity, loads and
    differences between specimens are neglected.

    Returns
    -------
    pressure_a, pressure_b : float
        Pressures [Pa] within the regulators' range.
    short : float
        Flag [0 or 1], 1 where the angle is out of reach: beyond its limit, or without force at full
        pressure.
    """
    limit = fixed[K.LINK_LIMIT][j]
    held = max(-limit, min(limit, angle))
    x_a, rate_a, _ = lever_of(fixed, j, held, 1.0)
    x_b, rate_b, _ = lever_of(fixed, j, held, -1.0)
    share = 2.0 * prestress / (rate_b - rate_a)
    p_a, f_a = set_pressure(fixed, j, x_a, share * rate_b)
    p_b, f_b = set_pressure(fixed, j, x_b, -share * rate_a)
    # a force that is short makes the other one give way
    p_a, _ = set_pressure(fixed, j, x_a, min(f_a, max(0.0, -f_b * rate_b / rate_a)))
    p_b, _ = set_pressure(fixed, j, x_b, min(f_b, max(0.0, -f_a * rate_a / rate_b)))
    beyond = abs(angle) > limit + 1e-12 or min(f_a, f_b) < 0.0
    return p_a, p_b, 1.0 if beyond else 0.0


@kernel
def command(
    rows: Any, fixed: Any, j: int, angle: float, prestress: float, angles: int, stresses: int,
    set_point: int,
) -> float:  # fmt: skip
    """Set the pressures of a pair for an angle [rad] and a prestress [N]; 1 if out of reach.

    ``angles``, ``stresses`` and ``set_point`` are the rows of both and the first of the pressures.
    """
    a, b, short = feed_forward(fixed, j, angle, prestress)
    rows[angles][j], rows[stresses][j] = angle, prestress
    rows[set_point][j], rows[set_point + 1][j] = a, b
    return short
