"""The hysteresis models of the orthosis' muscle as kernels: each writes the stiffness of a tile's lanes."""

from __future__ import annotations

from typing import Any

from pam_envs.hysteresis.modified_maxwell_slip import stiffness_step
from pam_envs.hysteresis.preisach import preisach_step
from pam_envs.kernels.build import kernel
from pam_envs.plants.knee_orthosis.rows import (
    DEPTH,
    ELEMENTS,
    GAIN,
    LOOP_WIDTH,
    MAX_PRESSURE,
    MEMBER,
    PRESSURE,
    STACK_COUNT,
    STIFFNESS,
    STIFFNESS_RATIO,
)

BREAKS, STIFFNESSES, SPRING, SEGMENT = range(4)
"""Rows of a modified Maxwell-slip model's table."""


@kernel
def no_hysteresis(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, first: int, last: int,
    elements: int,
) -> None:  # fmt: skip
    """Stiffness without hysteresis: proportional to the pressure."""
    pressure, stiffness = rows[PRESSURE], rows[STIFFNESS]
    for j in range(first, last):
        stiffness[j] = fixed[GAIN][j] * fixed[STIFFNESS_RATIO][j] * pressure[j]


@kernel
def slip_hysteresis(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, first: int, last: int,
    elements: int,
) -> None:  # fmt: skip
    """Stiffness by a modified Maxwell-slip model."""
    pressure, stiffness = rows[PRESSURE], rows[STIFFNESS]
    slips = rows[hysteresis : hysteresis + elements]
    for j in range(first, last):
        model = table[counts[MEMBER][j]]
        value = stiffness_step(
            pressure[j],
            slips,
            j,
            model[BREAKS],
            model[STIFFNESSES],
            model[SPRING],
            model[SEGMENT][0],
            fixed[LOOP_WIDTH][j],
        )
        stiffness[j] = fixed[GAIN][j] * value


@kernel
def preisach_hysteresis(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, first: int, last: int,
    elements: int,
) -> None:  # fmt: skip
    """Stiffness by a Preisach operator."""
    pressure, stiffness = rows[PRESSURE], rows[STIFFNESS]
    stack, sums = (
        rows[hysteresis : hysteresis + DEPTH],
        rows[hysteresis + DEPTH : hysteresis + 2 * DEPTH],
    )
    count = counts[STACK_COUNT]
    for j in range(first, last):
        everett, full = table[counts[MEMBER][j]], fixed[MAX_PRESSURE][j]
        cells = len(everett) - 1
        value = preisach_step(pressure[j], stack, sums, count, j, everett, 0.0, cells / full)
        line = everett[cells][0] / full * pressure[j]
        stiffness[j] = fixed[GAIN][j] * (line + fixed[LOOP_WIDTH][j] * (value - line))


@kernel
def forget_nothing(
    rows: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int
) -> None:
    """Start a muscle without hysteresis."""


@kernel
def forget_slips(
    rows: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int
) -> None:
    """Put the slip positions of one lane where venting leaves them."""
    model = table[counts[MEMBER][j]]
    middle = 0.5 * (len(model[SPRING]) - 1) * model[SEGMENT][0]
    for k in range(elements):
        rows[hysteresis + k][j] = min(model[BREAKS][k], middle)


@kernel
def forget_turns(
    rows: Any, counts: Any, table: Any, hysteresis: int, elements: int, j: int
) -> None:
    """Put every relay of one lane down."""
    for k in range(2 * DEPTH):
        rows[hysteresis + k][j] = 0.0
    counts[STACK_COUNT][j] = 1


HYSTERESIS_MODELS: dict[str, Any] = {
    "none": no_hysteresis,
    "maxwell_slip": slip_hysteresis,
    "preisach": preisach_hysteresis,
}
FORGET: dict[str, Any] = {
    "none": forget_nothing,
    "maxwell_slip": forget_slips,
    "preisach": forget_turns,
}
HYSTERESIS_ROWS = {"none": 0, "maxwell_slip": ELEMENTS + 1, "preisach": 2 * DEPTH}
