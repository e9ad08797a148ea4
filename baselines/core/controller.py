"""Policy-predictor protocol of controllers, and their common functions.

A controller is a policy predictor as in stable-baselines3: any object with ``predict``. It runs
unchanged in ``evaluate_policy``, on one observation of shape (n_obs,) or on a batch of shape
(n_env, n_obs). Its ``state`` is a named tuple of arrays with the row as first axis (one row for a
single observation); it is passed in and returned, and never changed in place.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol, TypeVar, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.arrays import Array
from pam_envs.parameters import Signal, Signals

Rows = NDArray[np.bool_]
Prediction = tuple[NDArray[np.float32], Any]
S = TypeVar("S", bound=tuple[Any, ...])
LOAD_DIGITS = 4
"""Loads that agree to 0.1 g count as equal."""


class Controller(Protocol):
    """A policy predictor."""

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Prediction:
        """Return the action for an observation, and the state for the next call.

        Parameters
        ----------
        observation : array_like, shape (n_obs,) or (n_env, n_obs)
            As returned by the environment.
        state : tuple of ndarray, optional
            As returned by the last call; None starts an episode in every row.
        episode_start : bool or array_like, shape (n_env,), optional
            Rows that start an episode: their state is reset.
        deterministic : bool
            Unused: every controller here is a function of its arguments.

        Returns
        -------
        action : ndarray of float32, shape (n_act,) or (n_env, n_act)
            Scaled as the action space of the environment [-1 to 1, or SI].
        state : tuple of ndarray
        """
        ...


class RowController(ABC):
    """Base of the controllers here: two methods, for all rows at once.

    ``predict`` handles starts of episodes; a controller defines the state at a start and the
    response to an observation.
    """

    def initial_state(self, observation: ArrayLike) -> Any:
        """Return the state of all rows at the start of an episode; by default none."""
        return None

    @abstractmethod
    def respond(self, observation: ArrayLike, state: Any) -> Prediction:
        """Return the action and the next state; see :class:`Controller`."""

    @final
    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Prediction:
        """Return the action and the next state; see :class:`Controller`."""
        rows = row_count(observation)
        now = reset_rows(state, episode_start, rows, lambda: self.initial_state(observation))
        return self.respond(observation, now)


class Reader(NamedTuple):
    """Columns and scales of named signals in an observation."""

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
        If there is no signal of that name; the message lists the names.
    """
    chosen: list[Signal] = [signals[name] for name in names]
    gain, offset = np.array([signal.scale for signal in chosen]).T
    return Reader(np.array([signal.index for signal in chosen]), gain, offset)


def preview_names(name: str, signals: Signals) -> list[str]:
    """Return the names of a signal and its preview samples, the present one first."""
    names, known = [name], set(signals.names())
    while f"{name}_{len(names)}" in known:
        names.append(f"{name}_{len(names)}")
    return names


def preview_weights(times: Sequence[float], lead: float, extrapolation: float = 0.0) -> Array:
    """Return the weights of samples at times [s], the first at 0, for the value at a lead [s].

    Linear interpolation; beyond the last sample the line from the first to the last one is
    extended, by at most ``extrapolation`` times the preview horizon. The weights add up to 1.
    """
    weights = np.array([np.interp(lead, times, sample) for sample in np.eye(len(times))])
    if lead > times[-1] > 0.0:
        beyond = min(lead / times[-1] - 1.0, extrapolation)
        weights[[0, -1]] = -beyond, 1.0 + beyond
    return weights


def row_count(observation: ArrayLike) -> int:
    """Return the number of rows of an observation: 1 for a single one."""
    return 1 if np.ndim(observation) == 1 else len(np.asarray(observation))


def encode_action(signal: Signal, value: Array, observation: ArrayLike) -> NDArray[np.float32]:
    """Return the action for SI values of shape (n_env,), in the form of the observation."""
    return encode_actions([signal], value[None], observation)


def encode_actions(
    signals: Sequence[Signal], values: ArrayLike, observation: ArrayLike
) -> NDArray[np.float32]:
    """Return the action for SI values, shape (n_act, n_env), clipped to their ranges.

    ``signals`` are all signals of the action; the observation determines its form.
    """
    values = np.asarray(values)
    action = np.empty(values.shape[::-1], np.float32)
    for signal, value in zip(signals, values, strict=True):
        gain, offset = signal.scale
        clipped = np.minimum(np.maximum(value, signal.low), signal.high)
        action[:, signal.index] = gain * clipped + offset
    return action if np.ndim(observation) == 2 else action[0]


def reset_rows(
    state: S | None, episode_start: ArrayLike | None, rows: int, initial: Callable[[], S]
) -> S:
    """Return the state, with initial values in the rows that start an episode."""
    if state is None:
        return initial()
    if episode_start is None:
        return state
    start = np.broadcast_to(np.asarray(episode_start, bool), (rows,))
    return _merged(start, initial(), state) if start.any() else state


def _merged(start: Rows, fresh: S, old: S) -> S:
    """Merge (nested, named) tuples of arrays: ``fresh`` in rows with ``start``, else ``old``."""
    if start.all():
        return fresh
    parts = [
        _merged(start, a, b)
        if isinstance(a, tuple)
        else np.where(start.reshape((-1,) + (1,) * (np.ndim(a) - 1)), a, b)
        for a, b in zip(fresh, old, strict=True)
    ]
    return type(fresh)(*parts) if hasattr(fresh, "_fields") else type(fresh)(parts)


def by_load(load: Array, respond: Callable[..., Any], *arguments: Any) -> Any:
    """Return ``respond(load, *arguments)`` for the rows of each load [kg].

    Loads are rounded to ``LOAD_DIGITS``. Arguments and results are (tuples of) arrays with the row
    as first axis.
    """
    if len(load) == 1 or (load == load[0]).all():
        return respond(round(float(load[0]), LOAD_DIGITS), *arguments)
    keys = np.round(load, LOAD_DIGITS)
    groups = [(np.flatnonzero(keys == key), float(key)) for key in np.unique(keys)]
    return _joined([(rows, respond(key, *_taken(arguments, rows))) for rows, key in groups])


def _taken(values: Any, rows: Any) -> Any:
    return tuple(_taken(v, rows) for v in values) if isinstance(values, tuple) else values[rows]


def _joined(parts: list[tuple[Any, Any]]) -> Any:
    first = parts[0][1]
    if isinstance(first, tuple):
        return tuple(_joined([(rows, part[k]) for rows, part in parts]) for k in range(len(first)))
    whole = np.empty((sum(len(rows) for rows, _ in parts), *first.shape[1:]), first.dtype)
    for rows, part in parts:
        whole[rows] = part
    return whole
