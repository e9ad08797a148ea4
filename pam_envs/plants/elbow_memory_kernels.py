"""The memories of the elbow's bundles as kernels.

Each writes how far its operator's output lags behind the travel ``rows[AT]`` into ``rows[LAG]``,
and goes there.
"""

from __future__ import annotations

from typing import Any

from pam_envs.hysteresis.elements import play
from pam_envs.hysteresis.preisach import preisach_step
from pam_envs.kernels import kernel
from pam_envs.plants.elbow_memory import ELEMENTS
from pam_envs.plants.elbow_orthosis_rows import AT, LAG, MEMBER, MODEL, STACK_COUNT

DEPTH = 24
"""Depth of the Preisach stack of extrema."""


@kernel
def remember_nothing(
    rows: Any, fixed: Any, counts: Any, table: Any, memory: int, elements: int, first: int,
    last: int,
) -> None:  # fmt: skip
    """Without memory nothing lags."""


@kernel
def remember_plays(
    rows: Any, fixed: Any, counts: Any, table: Any, memory: int, elements: int, first: int,
    last: int,
) -> None:  # fmt: skip
    """Move plays; ``fixed[MODEL]`` on are thresholds, then weights."""
    x, lag = rows[AT], rows[LAG]
    for j in range(first, last):
        lag[j] = 0.0
    for k in range(elements):
        threshold, weight = fixed[MODEL + k], fixed[MODEL + ELEMENTS + k]
        state = rows[memory + k]
        for j in range(first, last):
            w = play(x[j], threshold[j], state[j])
            state[j] = w
            lag[j] = lag[j] + weight[j] * (x[j] - w)


@kernel
def remember_relays(
    rows: Any, fixed: Any, counts: Any, table: Any, memory: int, elements: int, first: int,
    last: int,
) -> None:  # fmt: skip
    """Move a Preisach operator; ``fixed[MODEL]`` is half its range."""
    stack, sums = rows[memory : memory + DEPTH], rows[memory + DEPTH : memory + 2 * DEPTH]
    count = counts[STACK_COUNT]
    for j in range(first, last):
        everett = table[counts[MEMBER][j]]
        cells, high = len(everett) - 1, fixed[MODEL][j]
        x = rows[AT][j]
        y = preisach_step(x, stack, sums, count, j, everett, -high, 0.5 * cells / high)
        rows[LAG][j] = x - y


MEMORIES: dict[str, Any] = {
    "none": remember_nothing,
    "maxwell_slip": remember_plays,
    "preisach": remember_relays,
}
MEMORY_ROWS = {"none": 0, "maxwell_slip": ELEMENTS, "preisach": 2 * DEPTH}
