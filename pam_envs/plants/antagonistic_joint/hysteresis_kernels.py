"""The hysteresis models of a joint's muscles as kernels.

``peek`` asks what a hysteresis would do at an input, ``remember`` lets it go there. Both write, for
every operator ``m``, how far its output lags behind its input into ``rows[lag + m]``; ``peek``
also how that grows with the input, into ``rows[stick + m]``: 1 where all sticks, 0 where all
slips.
"""

from __future__ import annotations

from typing import Any

from pam_envs.hysteresis.elements import play
from pam_envs.hysteresis.extrema import preisach_peek, preisach_step
from pam_envs.kernels.arithmetic import clip
from pam_envs.kernels.build import kernel
from pam_envs.plants.antagonistic_joint.hysteresis import ELEMENTS

DEPTH = 24
"""Depth of the Preisach stack of extrema."""


@kernel
def peek_nothing(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, at: int, lag: int,
    stick: int, operators: int, model: int, stacks: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Without hysteresis nothing lags."""
    for m in range(operators):
        for j in range(first, last):
            rows[lag + m][j] = 0.0
            rows[stick + m][j] = 0.0


@kernel
def peek_plays(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, at: int, lag: int,
    stick: int, operators: int, model: int, stacks: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Lag of plays; ``fixed[model]`` on are thresholds, then weights."""
    for m in range(operators):
        x, behind, held = rows[at + m], rows[lag + m], rows[stick + m]
        for j in range(first, last):
            behind[j] = 0.0
            held[j] = 0.0
        for k in range(elements):
            threshold, weight = fixed[model + k], fixed[model + ELEMENTS + k]
            state = rows[hysteresis + m * ELEMENTS + k]
            for j in range(first, last):
                w = play(x[j], threshold[j], state[j])
                behind[j] = behind[j] + weight[j] * (x[j] - w)
                held[j] = held[j] + (weight[j] if w == state[j] else 0.0)


@kernel
def peek_relays(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, at: int, lag: int,
    stick: int, operators: int, model: int, stacks: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Lag of a Preisach operator; its growth is that since the hysteresis was last moved."""
    for m in range(operators):
        place = hysteresis + m * 2 * DEPTH
        stack, sums = rows[place : place + DEPTH], rows[place + DEPTH : place + 2 * DEPTH]
        count = counts[stacks + m]
        for j in range(first, last):
            everett = table[counts[member][j]]
            cells, high = len(everett) - 1, fixed[model][j]
            x = rows[at + m][j]
            y = preisach_peek(x, stack, sums, count, j, everett, -high, 0.5 * cells / high)
            now = count[j] - 1
            moved, lagged = x - stack[now][j], stack[now][j] - sums[now][j]
            rows[lag + m][j] = x - y
            rows[stick + m][j] = growth(x - y - lagged, moved)


@kernel
def growth(change: float, moved: float) -> float:
    """Return a difference quotient from 0 to 1, and a half where nothing moved."""
    if abs(moved) < 1e-9:
        return 0.5
    return clip(change / moved, 0.0, 1.0)


@kernel
def remember_nothing(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, at: int, lag: int,
    operators: int, model: int, stacks: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Without hysteresis nothing lags."""
    for m in range(operators):
        for j in range(first, last):
            rows[lag + m][j] = 0.0


@kernel
def remember_plays(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, at: int, lag: int,
    operators: int, model: int, stacks: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Move plays to their inputs."""
    for m in range(operators):
        x, behind = rows[at + m], rows[lag + m]
        for j in range(first, last):
            behind[j] = 0.0
        for k in range(elements):
            threshold, weight = fixed[model + k], fixed[model + ELEMENTS + k]
            state = rows[hysteresis + m * ELEMENTS + k]
            for j in range(first, last):
                w = play(x[j], threshold[j], state[j])
                state[j] = w
                behind[j] = behind[j] + weight[j] * (x[j] - w)


@kernel
def remember_relays(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, at: int, lag: int,
    operators: int, model: int, stacks: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Move Preisach operators to their inputs; ``fixed[model]`` is half their range."""
    for m in range(operators):
        place = hysteresis + m * 2 * DEPTH
        stack, sums = rows[place : place + DEPTH], rows[place + DEPTH : place + 2 * DEPTH]
        count = counts[stacks + m]
        for j in range(first, last):
            everett = table[counts[member][j]]
            cells, high = len(everett) - 1, fixed[model][j]
            x = rows[at + m][j]
            y = preisach_step(x, stack, sums, count, j, everett, -high, 0.5 * cells / high)
            rows[lag + m][j] = x - y


HYSTERESIS_MODELS: dict[str, dict[str, Any]] = {
    "none": {"peek": peek_nothing, "remember": remember_nothing},
    "maxwell_slip": {"peek": peek_plays, "remember": remember_plays},
    "preisach": {"peek": peek_relays, "remember": remember_relays},
}
ROWS_PER_OPERATOR = {"none": 0, "maxwell_slip": ELEMENTS, "preisach": 2 * DEPTH}
MODEL_ROWS = 2 * ELEMENTS
"""Rows of parameters that describe the operator."""
