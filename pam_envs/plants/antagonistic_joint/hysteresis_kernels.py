"""Hysteresis of several muscles: the kernels of one model, muscle by muscle.

Inputs, lags and their slopes are rows of one muscle after the other from ``at``, ``lag`` and
``stick``; states follow each other from row ``hysteresis``, counts from row ``stacks``.
"""

from __future__ import annotations

from typing import Any

from pam_envs.kernels.build import kernel

# placeholders
hysteresis_lag: Any = None
hysteresis_peek: Any = None
MODEL_STATE = 0


@kernel
def peek(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, at: int,
    lag: int,
    stick: int, operators: int, model: int, stacks: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Write the lags at inputs and their slopes; the states stay."""
    for m in range(operators):
        hysteresis_peek(
            rows[at + m], rows[lag + m], rows[stick + m], rows, fixed, counts, table, elements,
            hysteresis + m * MODEL_STATE, model, stacks + m, member, first, last,
        )  # fmt: skip


@kernel
def remember(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, elements: int, at: int,
    lag: int,
    operators: int, model: int, stacks: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Move the operators to their inputs and write their lags."""
    for m in range(operators):
        hysteresis_lag(
            rows[at + m], rows[lag + m], rows, fixed, counts, table, elements,
            hysteresis + m * MODEL_STATE, model, stacks + m, member, first, last,
        )  # fmt: skip
