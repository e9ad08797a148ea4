"""Episodes of environments that advance together under one controller."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from pam_envs.arrays import Array, Flags


def run_episodes(
    envs: Sequence[Any],
    controller: Any,
    read: Callable[[Mapping[str, Any]], Sequence[float]],
    seed: int = 0,
) -> tuple[Array, Flags]:
    """Run an episode of each environment.

    Parameters
    ----------
    envs : sequence of Env
        Environments with the same signals; the k-th is reset with ``seed + k``.
    controller : Controller
        For observations (n, k), with ``predict`` as a policy of Stable-Baselines3 has it.
    read : callable
        From ``info`` after a step to the values [SI] to keep.
    seed : int
        Seed of the first episode.

    Returns
    -------
    kept : ndarray, shape (values, T, n)
        Values [SI], NaN after the end of an episode.
    ended : ndarray of bool, shape (n,)
        Whether a limit of the environment ended the episode.
    """
    count = len(envs)
    observations = np.stack([env.reset(seed=seed + k)[0] for k, env in enumerate(envs)])
    state, start = None, np.ones(count, bool)
    running, ended = np.ones(count, bool), np.zeros(count, bool)
    rows = []
    while running.any():
        actions, state = controller.predict(observations, state, start, True)
        start, observations = np.zeros(count, bool), observations.copy()
        row: list[Sequence[float] | None] = [None] * count
        for k in np.flatnonzero(running).tolist():
            observations[k], _, ended[k], truncated, info = envs[k].step(actions[k])
            row[k] = read(info)
            running[k] = not (ended[k] or truncated)
        rows.append(row)
    width = len(next(values for values in rows[0] if values is not None))
    nothing = [np.nan] * width
    filled = [[nothing if values is None else values for values in row] for row in rows]
    return np.asarray(np.array(filled, float).transpose(2, 0, 1)), ended
