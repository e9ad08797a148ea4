"""What a controller is, and the small functions that all of them share.

A controller is what stable-baselines3 calls a policy predictor: any object with ``predict``. It
runs as it is in ``evaluate_policy``, on one observation of shape (n_obs,) or on a batch of shape
(n_env, n_obs). What it remembers is its ``state``: a named tuple of arrays whose first axis is the
row (one row for a single observation). It is handed out and back, and never changed in place.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.parameters import Signal, Signals

Array = NDArray[np.float64]
Rows = NDArray[np.bool_]
Answer = tuple[NDArray[np.float32], Any]
S = TypeVar("S", bound=tuple[Any, ...])
LOAD_DIGITS = 4
"""Loads that agree to 0.1 g are one load."""


class Controller(Protocol):
    """A policy predictor."""

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Answer:
        """Return the action for an observation, and the state for the next call.

        Parameters
        ----------
        observation : array_like, shape (n_obs,) or (n_env, n_obs)
            As the environment gives it.
        state : tuple of ndarray, optional
            As the last call returned it; None begins an episode in every row.
        episode_start : bool or array_like, shape (n_env,), optional
            Rows that begin an episode: their state is forgotten.
        deterministic : bool
            Unused: every controller here is a function of its arguments.

        Returns
        -------
        action : ndarray of float32, shape (n_act,) or (n_env, n_act)
        state : tuple of ndarray
        """
        ...


class Reader(NamedTuple):
    """Where some named signals stand in an observation, and their scales."""

    columns: NDArray[np.int64]
    gain: Array
    offset: Array

    def rows(self, observation: ArrayLike) -> Array:
        """Return the signals in SI, one row each: shape (n_signals, n_env)."""
        vectors = np.asarray(observation)
        taken = vectors[..., self.columns].astype(np.float64)
        return np.asarray(((taken - self.offset) / self.gain).reshape(-1, len(self.columns)).T)


def reader(signals: Signals, names: Sequence[str]) -> Reader:
    """Return the reader of some signals by name.

    Raises
    ------
    KeyError
        If there is no signal of that name; the message lists those there are.
    """
    chosen: list[Signal] = [signals[name] for name in names]
    gain, offset = np.array([signal.scale for signal in chosen]).T
    return Reader(np.array([signal.index for signal in chosen]), gain, offset)


def answer(signal: Signal, value: Array, observation: ArrayLike) -> NDArray[np.float32]:
    """Return the action for SI values of shape (n_env,), in the form that the observation has."""
    gain, offset = signal.scale
    held = np.minimum(np.maximum(value, signal.low), signal.high)
    action = (gain * held + offset).astype(np.float32)[:, None]
    return action if np.ndim(observation) == 2 else action[0]


def beginning(state: Any, episode_start: ArrayLike | None, rows: int) -> Rows:
    """Return which rows begin an episode, shape (rows,)."""
    if state is None:
        return np.ones(rows, bool)
    if episode_start is None:
        return np.zeros(rows, bool)
    return np.broadcast_to(np.asarray(episode_start, bool), (rows,))


def choose(begin: Rows, fresh: S, old: S | None) -> S:
    """Return the fresh state in rows that begin an episode and the old one elsewhere.

    States are (named) tuples of arrays whose first axis is the row, or of further such tuples.
    """
    if old is None or begin.all():
        return fresh
    parts = [
        choose(begin, a, b)
        if isinstance(a, tuple)
        else np.where(begin.reshape((-1,) + (1,) * (np.ndim(a) - 1)), a, b)
        for a, b in zip(fresh, old, strict=True)
    ]
    return type(fresh)(*parts) if hasattr(fresh, "_fields") else type(fresh)(parts)


def by_load(load: Array) -> Iterator[tuple[float, Any]]:
    """Yield each load [kg], rounded to ``LOAD_DIGITS``, with the index of its rows.

    What a controller prepares for a load (an inverse, a curve) can so be kept under that load.
    The index is ``slice(None)`` where all rows hang the same one.
    """
    if len(load) == 1 or (load == load[0]).all():
        yield round(float(load[0]), LOAD_DIGITS), slice(None)
        return
    keys = np.round(load, LOAD_DIGITS)
    for key in np.unique(keys):
        yield float(key), np.flatnonzero(keys == key)
