"""Copies of the environments of a batch that run ahead of it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array
from pam_envs.envs.core.setup import STEP, for_kernels, tiles_for
from pam_envs.envs.core.vector_env import PlantVectorEnv
from pam_envs.kernels.build import COMPILED, LANES


class Copies:
    """``copies`` copies of each of ``rows`` environments, stepped without resets.

    Parts that all environments share (``fixed``, without drawn parameters) have one tile.

    Parameters
    ----------
    env : PlantVectorEnv
        Batch whose environments are copied.
    copies : int
        Number of copies of each environment.
    """

    def __init__(self, env: PlantVectorEnv, copies: int) -> None:
        self.setup, self.copies, self.rows = env.setup, copies, env.num_envs
        n = self.rows * copies
        self._source = np.minimum(np.arange(tiles_for(n) * LANES), n - 1) // copies
        self._shared = tuple(for_kernels(part) for part in env.setup.shared)
        self._all: tuple[Any, ...] = ()

    def take(self, env: PlantVectorEnv) -> None:
        """Put every copy into the state of its environment."""
        state = env.get_state()
        parts = (self._copied(state[name]) for name in ("rows", "fixed", "counts", "ahead"))
        self._all = tuple(map(for_kernels, parts))

    def _copied(self, part: NDArray[Any]) -> NDArray[Any]:
        if part.shape[0] == 1 and not self.setup.drawn and part.shape[1] == self._parameters:
            return part
        lanes = part.swapaxes(0, 1).reshape(part.shape[1], -1)[:, self._source]
        tiles = lanes.reshape(part.shape[1], -1, LANES).swapaxes(0, 1)
        return np.ascontiguousarray(tiles)

    @property
    def _parameters(self) -> int:
        return int(self.setup.kernels.parameters)

    def run(self, actions: Array) -> dict[str, Array]:
        """Run actions, shape (T, rows, copies, n_act); return ``info``, arrays (T, rows, copies).

        Terminated copies run on: their state is finite, and their error grows.
        """
        n, keys = self.rows * self.copies, self.setup.info_keys
        observations = np.empty((2, n, len(self.setup.signals)), np.float32)
        infos, flags = np.empty((2, len(keys) + 1, n)), np.empty((2, n), np.bool_)
        made = np.empty((len(actions), len(keys), n))
        for t, given in enumerate(actions):
            self._step(given.reshape(n, -1), observations, infos, flags)
            made[t] = infos[0, 1:]
        shaped = made.reshape(len(actions), len(keys), self.rows, self.copies)
        return {key: shaped[:, k] for k, key in enumerate(keys)}

    def _step(self, actions: Array, observations: Any, infos: Any, flags: Any) -> None:
        outputs, function = (observations, infos, flags), self.setup.kernels.batch
        if COMPILED:
            function(*self._all, *self._shared, actions, *outputs, len(actions), STEP)
            return
        views = [array.tolist() for array in outputs]
        arguments = (actions.tolist(), *views, len(actions), STEP)
        function(*self._all, *self._shared, *arguments)
        for array, view in zip(outputs, views, strict=True):
            array[...] = np.array(view, array.dtype).reshape(array.shape)
