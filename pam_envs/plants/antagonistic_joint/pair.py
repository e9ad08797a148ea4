"""A pair of muscles on the lever of one stage, as kernels: alone and in a chain the same."""

from __future__ import annotations

import math
from typing import Any

from pam_envs.constants import ATMOSPHERE, DENSITY_PER_PRESSURE
from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import LANES, kernel
from pam_envs.mechanics.antagonistic_lever import span, squares
from pam_envs.muscle.force_map import force_terms, inner_volume
from pam_envs.plants.antagonistic_joint.rows import (
    AREA,
    BRAID_FORCE,
    BRAID_STRAIN,
    DIAMETER,
    FITTINGS,
    FRICTION_BASE,
    FRICTION_RATE,
    GAIN,
    IMBALANCE,
    L_O,
    L_U,
    LIMIT,
    LOOP_WIDTH,
    MAX_PRESSURE,
    MUSCLE_STIFFNESS,
    R_O,
    R_U,
    REST_LENGTH,
    SLEW_RATE,
    STOP,
    STOP_STIFFNESS,
    STRETCH,
    TAPER,
    THRESHOLD,
    TIME_CONSTANT,
    VISCOSITY,
)
from pam_envs.pneumatics.regulator import regulator_step


@kernel
def fill(pressure: Any, set_point: Any, was: Any, fixed: Any, h: float) -> None:
    """Advance the pressures of one muscle in all lanes, and keep those before."""
    for j in range(LANES):
        time, slew = fixed[TIME_CONSTANT][j], fixed[SLEW_RATE][j]
        target = max(0.0, min(fixed[MAX_PRESSURE][j], set_point[j]))
        was[j] = pressure[j]
        pressure[j] = regulator_step(pressure[j], target, time, 1.0 / time, slew, 1.0 / slew, h)


@kernel
def contract(rows: Any, fixed: Any, j: int, angle: float, at: int, straight: int) -> None:
    """Write the contractions of a pair at an angle into two rows from ``at``.

    They count from that of the straight joint, row ``straight``.
    """
    x_a, _, _ = lever_of(fixed, j, angle, 1.0)
    x_b, _, _ = lever_of(fixed, j, angle, -1.0)
    rows[at][j], rows[at + 1][j] = x_a - rows[straight][j], x_b - rows[straight][j]


@kernel
def clear_hysteresis_models(
    rows: Any, counts: Any, hysteresis: int, first: int, number: int, j: int
) -> None:
    """Put the hysteresis models of one lane into their virgin state, ``number`` of them.

    Their state is all rows from ``hysteresis`` on; their counts begin at ``first``.
    """
    for k in range(len(rows) - hysteresis):
        rows[hysteresis + k][j] = 0.0
    for m in range(number):
        counts[first + m][j] = 1


@kernel
def lever_of(fixed: Any, j: int, angle: float, side: float) -> tuple[float, float, float]:
    """Return contraction, ``dL/dphi`` [m] and its derivative [m] of the muscle on one side."""
    sine, cosine = sine_and_cosine(angle)
    total, even, odd = squares(fixed[R_U][j], fixed[R_O][j], fixed[L_U][j], fixed[L_O][j])
    length, rate, curve = span(sine, cosine, side, total, even, odd)
    return 1.0 - (length - fixed[FITTINGS][j]) / fixed[REST_LENGTH][j], rate, curve


@kernel
def terms_of(fixed: Any, j: int, contraction: float) -> tuple[float, float, float, float]:
    """Return the terms of the force at a contraction (:func:`force_terms`)."""
    return force_terms(
        contraction,
        fixed[AREA][j],
        fixed[TAPER][j],
        fixed[THRESHOLD][j],
        fixed[BRAID_FORCE][j],
        fixed[BRAID_STRAIN][j],
        fixed[MUSCLE_STIFFNESS][j],
        1.0 / fixed[STRETCH][j],
    )


@kernel
def friction_of(fixed: Any, j: int, pressure: float) -> float:
    """Return the friction over the hysteresis lag [N]."""
    return fixed[LOOP_WIDTH][j] * (fixed[FRICTION_BASE][j] + fixed[FRICTION_RATE][j] * pressure)


@kernel
def gain_of(fixed: Any, j: int, side: float) -> float:
    """Return the force of a specimen over that of the law."""
    return fixed[GAIN][j] * (1.0 + side * fixed[IMBALANCE][j])


@kernel
def pulled(
    fixed: Any, j: int, side: float, contraction: float, speed: float, pressure: float, lag: float
) -> tuple[float, float]:
    """Return the force of a muscle [N] and minus its derivative by contraction [N].

    ``speed`` [1/s] is that of the contraction, ``lag`` that of the hysteresis; the derivative is
    that of the law alone. A slack muscle has neither force nor stiffness.
    """
    area, passive, less, more = terms_of(fixed, j, contraction)
    gain = gain_of(fixed, j, side)
    drag = friction_of(fixed, j, pressure) * lag + fixed[VISCOSITY][j] * pressure * speed
    force = gain * (pressure * area - passive) - drag
    return max(0.0, force), gain * (pressure * less + more) if force > 0.0 else 0.0


@kernel
def pulled_twice(
    fixed: Any, j: int, side: float, contraction: float, speed: float, was: float,
    pressure: float, lag: float, stick: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return the forces [N] at two pressures, without viscosity.

    Then, for the mean pressure, minus the derivative of the force by contraction [N], with what
    sticks of the friction, and the viscosity [N s]; all is 0 where the muscle is slack.
    """
    area, passive, less, more = terms_of(fixed, j, contraction)
    gain, middle = gain_of(fixed, j, side), 0.5 * (was + pressure)
    old = gain * (was * area - passive) - friction_of(fixed, j, was) * lag
    new = gain * (pressure * area - passive) - friction_of(fixed, j, pressure) * lag
    slope = gain * (middle * less + more) + friction_of(fixed, j, middle) * stick
    drag = fixed[VISCOSITY][j] * middle
    tight = 1.0 if old + new > 2.0 * drag * speed else 0.0
    return tight * old, tight * new, tight * slope, tight * drag


@kernel
def turning(
    fixed: Any, j: int, side: float, contraction: float, rate: float, curve: float,
    velocity: float, was: float, pressure: float, lag: float, stick: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return the torque of a muscle [N m] at two pressures, for a joint that turns.

    Then minus its derivative by the angle [N m/rad] and its damping [N m s/rad] between them;
    ``rate`` and ``curve`` are the derivatives of the muscle's length by the angle.
    """
    per_length = 1.0 / fixed[REST_LENGTH][j]
    speed = -rate * velocity * per_length
    old, new, stiff, viscous = pulled_twice(
        fixed, j, side, contraction, speed, was, pressure, lag, stick
    )
    square = rate * rate * per_length
    return -old * rate, -new * rate, stiff * square + 0.5 * (old + new) * curve, viscous * square


@kernel
def stop_torque(fixed: Any, j: int, angle: float) -> tuple[float, float]:
    """Return the torque of the mechanical stop [N m] and minus its slope [N m/rad]."""
    over = max(0.0, abs(angle) - fixed[STOP][j])
    stiffness = fixed[STOP_STIFFNESS][j]
    torque = -stiffness * over if angle > 0.0 else stiffness * over
    return torque, stiffness if over > 0.0 else 0.0


@kernel
def air_of(fixed: Any, j: int, contraction: float, pressure: float) -> float:
    """Return the air in a muscle [kg]."""
    bore = 0.25 * math.pi * fixed[DIAMETER][j] * fixed[DIAMETER][j]
    space = inner_volume(
        contraction,
        fixed[AREA][j],
        fixed[TAPER][j],
        1.0 / fixed[STRETCH][j],
        bore,
        fixed[REST_LENGTH][j],
    )
    return DENSITY_PER_PRESSURE * (max(0.0, pressure) + ATMOSPHERE) * space


@kernel
def set_pressure(fixed: Any, j: int, contraction: float, force: float) -> tuple[float, float]:
    """Return the pressure [Pa] of a force [N] by the law, at most the highest, and its force."""
    area, passive, _, _ = terms_of(fixed, j, contraction)
    highest = fixed[MAX_PRESSURE][j]
    pressure = (force + passive) / area
    if pressure > highest:
        return highest, highest * area - passive
    return max(0.0, pressure), force


@kernel
def feed_forward(fixed: Any, j: int, angle: float, prestress: float) -> tuple[float, float, float]:
    """Return setpoints [Pa] for an angle [rad] and a co-contraction [N]: fluidic_muscles, Fig. 4.

    The inverse of the law: the forces' mean is ``prestress`` and their torque 0. Where one muscle
    would need more than full pressure the co-contraction gives way. Hysteresis, gravity, loads and
    what sets the specimens apart are left out.

    Returns
    -------
    pressure_a, pressure_b : float
        Within the regulators' range.
    short : float
        1 where the angle is out of reach: beyond its limit, or without force at full pressure.
    """
    limit = fixed[LIMIT][j]
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
    rows: Any, fixed: Any, j: int, angle: float, prestress: float, asked: int, stress: int,
    set_point: int,
) -> float:  # fmt: skip
    """Set the pressures of a pair for an angle [rad] and a prestress [N]; 1 if out of reach.

    ``asked``, ``stress`` and ``set_point`` are the rows of both, and the first of the pressures'.
    """
    a, b, short = feed_forward(fixed, j, angle, prestress)
    rows[asked][j], rows[stress][j] = angle, prestress
    rows[set_point][j], rows[set_point + 1][j] = a, b
    return short
