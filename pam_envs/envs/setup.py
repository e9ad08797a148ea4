"""What an environment is made of, checked and laid out for the kernels.

A :class:`Setup` is built once from the keyword arguments. The single environment and the batched
one hold the same setup and differ only in the number of lanes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.kernels import COMPILED, LANES
from pam_envs.parameters import Signals

STEP, STEP_AND_RESTART, BEGIN = 0, 1, 2
"""Modes of the kernels: step; step and start what has ended anew; start what is flagged."""


@dataclass(frozen=True)
class Setup:
    """A checked configuration.

    Attributes
    ----------
    plant : object
        The plant that is simulated.
    signals, action_signals : Signals
        What the observation and the action hold.
    kernels : object
        With ``single``, ``batch`` and ``parallel``, which take the arrays of a batch and a mode.
    rows, fixed, counts : int
        Rows of state, of parameters and of integer state of one environment.
    drawn : bool
        Whether environments differ in their parameters; otherwise all tiles share them.
    ring : int
        References that are kept for the preview, a power of two.
    seed_rows : tuple of int
        Integer rows of the two key words and of the episode number.
    info_keys : tuple of str
        Keys of ``info``, in the order in which the kernels write them.
    shared : tuple of arrays
        What all environments share, in the order of the kernels' arguments.
    control_period, episode_seconds : float
        Seconds.
    render_mode : str or None
        As Gymnasium means it.
    arguments : dict
        Keyword arguments as given, for records.
    """

    plant: Any
    signals: Signals
    action_signals: Signals
    kernels: Any
    rows: int
    fixed: int
    drawn: bool
    counts: int
    ring: int
    seed_rows: tuple[int, int, int]
    info_keys: tuple[str, ...]
    shared: tuple[Any, ...]
    control_period: float
    episode_seconds: float
    render_mode: str | None = None
    arguments: dict[str, Any] = field(default_factory=dict)

    def state(self, tiles: int, lanes: int) -> tuple[NDArray[Any], ...]:
        """Return zeroed state, parameters, integers and previews for tiles of ``lanes`` lanes."""
        return (
            np.zeros((tiles, self.rows, lanes)),
            np.zeros((tiles if self.drawn else 1, self.fixed, lanes)),
            np.zeros((tiles, self.counts, lanes), np.int64),
            np.zeros((tiles, self.ring, lanes)),
        )


def for_kernels(array: Any) -> Any:
    """Return an array as the kernels want it: itself, or nested lists when uncompiled."""
    return array if COMPILED else array.tolist()


def tiles_for(number: int) -> int:
    """Return how many tiles hold ``number`` environments."""
    return -(-number // LANES)


def scales_of(signals: Signals) -> NDArray[np.float64]:
    """Return ``a, b, low, high`` of each signal: its entry is ``clip(a * si + b, low, high)``.

    The bounds are rounded to single precision inwards, so that a clipped value lies in the space.
    """
    table = np.empty((len(signals), 4))
    for i, signal in enumerate(signals):
        low, high = (-1.0, 1.0) if signal.normalized else (signal.low, signal.high)
        table[i] = *signal.scale, float(np.float32(low)), float(np.float32(high))
    return table


def check_choice(name: str, value: Any, choices: Sequence[Any]) -> None:
    """Raise a clear error if ``value`` is not one of ``choices``."""
    if not any(value is c or (type(value) is type(c) and value == c) for c in choices):
        listed = ", ".join(repr(c) for c in choices)
        raise ValueError(f"{name} = {value!r} is not known; choose one of {listed}")


def check_number(name: str, value: Any, low: float, high: float, unit: str) -> float:
    """Return ``value`` as a float, or raise naming value, bounds and remedy."""
    good = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if not good or not math.isfinite(value) or not low <= value <= high:
        raise ValueError(
            f"{name} = {value!r} must be a number from {low:g} to {high:g} {unit}".rstrip()
            + "; change it to lie within"
        )
    return float(value)


def check_whole(name: str, value: Any, low: int, high: int) -> int:
    """Return ``value`` as an int, or raise naming value, bounds and remedy."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise ValueError(f"{name} = {value!r} must be a whole number from {low} to {high}")
    if not low <= value <= high:
        raise ValueError(f"{name} = {value} must be from {low} to {high}; change it to lie within")
    return int(value)


def check_seed(seed: Any) -> int:
    """Return a seed as a non-negative int, or raise."""
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0:
        raise ValueError(f"seed = {seed!r} must be a non-negative whole number")
    return int(seed)


STATE_KEYS = ("rows", "fixed", "counts", "ahead")


def saved(parts: tuple[Any, ...]) -> dict[str, NDArray[Any]]:
    """Return copies of the parts of a state, as arrays by name."""
    kinds = {"counts": np.int64}
    return {
        name: np.array(part, kinds.get(name, np.float64))
        for name, part in zip(STATE_KEYS, parts, strict=True)
    }


def check_state(state: Any, wanted: tuple[NDArray[Any], ...]) -> None:
    """Raise if a saved state does not fit: missing parts, or shapes of other arguments."""
    for name, like in zip(STATE_KEYS, wanted, strict=True):
        if name not in state:
            raise ValueError(f"the state has no {name!r}: it was not made by get_state")
        shape = np.shape(state[name])
        if shape != like.shape:
            raise ValueError(
                f"the state's {name!r} has shape {shape}, this environment {like.shape}: it was "
                "taken with other arguments"
            )
