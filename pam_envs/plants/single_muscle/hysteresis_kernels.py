"""Effective pressure or friction of the single muscle, around the kernels of a model."""

import math
from typing import Any

from pam_envs.hysteresis import protocol
from pam_envs.hysteresis.slip import LIMIT
from pam_envs.kernels.build import kernel
from pam_envs.plants.single_muscle import rows as R

hysteresis_step: Any = None
hysteresis_lag: Any = None
hysteresis_peek: Any = None
"""Placeholders: kernels of the model."""


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
def friction_per_load(width_per_load: float, load: float) -> float:
    """Return the factor on friction beside the operator at this load: none limits its growth."""
    return max(0.0, 1.0 + width_per_load * load)


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


@kernel
def no_friction(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, first: int, last: int,
    elements: int, ahead: float,
) -> None:  # fmt: skip
    """Do nothing: the pressure has the hysteresis."""


@kernel
def begin_friction(rows: Any, fixed: Any, hysteresis: int, elements: int, j: int) -> None:
    """Put the sliders of one lane where they exert no force."""
    for k in range(elements):
        rows[hysteresis + k][j] = rows[R.CONTRACTION][j] / fixed[R.MUSCLE_REST_LENGTH][j]


@kernel
def begin_without(rows: Any, fixed: Any, hysteresis: int, elements: int, j: int) -> None:
    """Do nothing: the pressure has the hysteresis."""


@kernel
def set_strain(rows: Any, fixed: Any, hysteresis: int, first: int, last: int, ahead: float) -> None:
    """Write the strain ``ahead`` seconds from now, and the limit of the friction elements."""
    strain, limit = rows[R.STRAIN], rows[hysteresis + LIMIT]
    for j in range(first, last):
        x = rows[R.CONTRACTION][j] + ahead * rows[R.VELOCITY][j]
        strain[j] = x / fixed[R.MUSCLE_REST_LENGTH][j]
        grown = fixed[R.HYSTERESIS_LIMIT_PER_PRESSURE][j] * rows[R.DRIVE][j]
        grown = grown + fixed[R.HYSTERESIS_LIMIT_PER_LOAD][j] * rows[R.LOAD][j]
        limit[j] = max(0.0, 1.0 + grown)


@kernel
def peek_friction(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, first: int, last: int,
    elements: int, ahead: float,
) -> None:  # fmt: skip
    """Write lag and sticking share of the friction ``ahead`` seconds from now; it does not move."""
    set_strain(rows, fixed, hysteresis, first, last, ahead)
    hysteresis_peek(
        rows, fixed, counts, table, hysteresis, elements, R.STRAIN, R.LAG, R.STICK, 1, R.MODEL,
        R.STACK_COUNT, R.MEMBER, first, last,
    )  # fmt: skip


@kernel
def move_friction(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, first: int, last: int,
    elements: int, ahead: float,
) -> None:  # fmt: skip
    """Move the friction to the contraction reached."""
    set_strain(rows, fixed, hysteresis, first, last, ahead)
    hysteresis_lag(
        rows, fixed, counts, table, hysteresis, elements, R.STRAIN, R.LAG, 1, R.MODEL,
        R.STACK_COUNT, R.MEMBER, first, last,
    )  # fmt: skip


def hysteresis_kernels(kind: str, name: str = "write_drive") -> dict[str, Any]:
    """Return the kernels of a kind; ``name`` is the plant's placeholder for the whole."""
    model = protocol.model_of(kind)
    by_length = model.drive == "length"
    plain = model.identity or by_length
    return protocol.kernels(kind) | {
        name: pressure_itself if plain else effective_pressure,
        "STAGED": 0 if plain else 1,
        "hysteresis_ahead": peek_friction if by_length else no_friction,
        "hysteresis_moved": move_friction if by_length else no_friction,
        "start_friction": begin_friction if by_length else begin_without,
    }
