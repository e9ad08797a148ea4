"""Checks of a hysteresis model's arguments: every message names value, bound and remedy."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array


def floats(name: str, values: Sequence[float]) -> tuple[float, ...]:
    """Return the values as floats, or raise naming the first that is not finite."""
    result = tuple(float(value) for value in values)
    for i, value in enumerate(result):
        if not math.isfinite(value):
            raise ValueError(f"{name}[{i}] is {value}; it must be finite: leave that element out")
    return result


def check_thresholds(name: str, values: tuple[float, ...], count: int, partner: str) -> None:
    """Raise unless the values rise from at least 0 and there are ``count`` of them."""
    if len(values) != count:
        raise ValueError(
            f"{name} has {len(values)} values and {partner} has {count}; "
            "give one of each per element"
        )
    for i, value in enumerate(values):
        if value < 0.0:
            raise ValueError(f"{name}[{i}] is {value}; it must be at least 0: give its size")
        if i and value <= values[i - 1]:
            raise ValueError(
                f"{name}[{i}] is {value}, not above {name}[{i - 1}] = {values[i - 1]}; sort the"
                " elements and join those with equal values by adding up their weights"
            )


def check_not_negative(name: str, values: Sequence[float], why: str) -> None:
    """Raise an error that names the first value below 0 and the reason for the bound."""
    for i, value in enumerate(values):
        if value < 0.0:
            raise ValueError(
                f"{name}[{i}] is {value}; it must be at least 0 {why}: refit with >= 0"
            )


def width_of(width: float) -> float:
    """Return a factor on the width of a hysteresis, or raise if it is below 0."""
    (width,) = floats("width", (width,))
    check_not_negative("width", (width,), "to stay passive")
    return width


def single_rows(state: Any, count: int) -> Array:
    """Return a state of ``count`` numbers as rows of one lane."""
    rows = np.array(state, dtype=float)
    if rows.shape != (count,):
        raise ValueError(
            f"state has shape {rows.shape}; a simulation needs ({count},): use step for batches"
        )
    return rows.reshape(count, 1)


def series(x: ArrayLike) -> Array:
    """Return a finite input of shape (T,), or raise."""
    values = np.ascontiguousarray(x, dtype=float)
    if values.ndim != 1:
        raise ValueError(f"x has {values.ndim} dimensions; simulate takes 1: use step for batches")
    return values
