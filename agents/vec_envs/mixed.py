"""Several batches as one vectorised environment, with rows on different plants."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvStepReturn

from agents.vec_envs.batch import BatchVecEnv


class MixedVecEnv(VecEnv):
    """The rows of several batches, one batch after the other.

    Parameters
    ----------
    batches : sequence of BatchVecEnv
        With the same spaces.
    """

    def __init__(self, batches: Sequence[BatchVecEnv]) -> None:
        self.batches = tuple(batches)
        ends = np.cumsum([batch.num_envs for batch in self.batches]).tolist()
        self.slices = tuple(slice(a, b) for a, b in zip([0, *ends[:-1]], ends, strict=True))
        self.spec = self.batches[0].spec
        first = self.batches[0]
        super().__init__(ends[-1], first.observation_space, first.action_space)

    def parts(self) -> Iterator[tuple[slice, Any]]:
        """Yield the rows of each plant; adjacent batches of equal plants are one entry."""
        plants = [batch.get_attr("plant")[0] for batch in self.batches]
        grouped = itertools.groupby(
            zip(self.slices, plants, strict=True), key=lambda pair: pair[1].digest()
        )
        for _, group in grouped:
            pairs = list(group)
            yield slice(pairs[0][0].start, pairs[-1][0].stop), pairs[0][1]

    def reset(self) -> NDArray[np.float32]:
        """Start all episodes; see stable-baselines3."""
        for rows, batch in zip(self.slices, self.batches, strict=True):
            batch._seeds, batch._options = self._seeds[rows], self._options[rows]
        observations = [batch.reset() for batch in self.batches]
        self.reset_infos = [info for batch in self.batches for info in batch.reset_infos]
        self._reset_seeds()
        self._reset_options()
        return np.concatenate(observations)

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions for :meth:`step_wait`."""
        for rows, batch in zip(self.slices, self.batches, strict=True):
            batch.step_async(actions[rows])

    def step_wait(self) -> VecEnvStepReturn:
        """Step all rows; see stable-baselines3."""
        made = [batch.step_wait() for batch in self.batches]
        observations, rewards, done, infos = zip(*made, strict=True)
        rows = [info for batch in infos for info in batch]
        return np.concatenate(observations), np.concatenate(rewards), np.concatenate(done), rows

    def close(self) -> None:
        """Close all batches."""
        for batch in self.batches:
            batch.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of each row's batch."""
        whole = [v for batch in self.batches for v in batch.get_attr(attr_name)]
        return [whole[row] for row in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of all batches; see :meth:`BatchVecEnv.set_attr`."""
        self._check_all_rows(attr_name, indices)
        for batch in self.batches:
            batch.set_attr(attr_name, value)

    def env_method(
        self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any
    ) -> list[Any]:
        """Call a method of all batches; see :meth:`BatchVecEnv.env_method`."""
        self._check_all_rows(method_name, indices)
        made = [batch.env_method(method_name, *args, **kwargs) for batch in self.batches]
        return [value for values in made for value in values]

    @staticmethod
    def _check_all_rows(name: str, indices: VecEnvIndices) -> None:
        if indices is not None:
            raise ValueError(f"{name!r} concerns all rows; leave indices out")

    def env_is_wrapped(
        self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Return False for each row."""
        return [False] * len(list(self._get_indices(indices)))

    def get_state(self) -> dict[str, NDArray[Any]]:
        """Return all that the future depends on."""
        return {
            f"{i}/{name}": array
            for i, batch in enumerate(self.batches)
            for name, array in batch.get_state().items()
        }

    def set_state(self, state: dict[str, NDArray[Any]]) -> None:
        """Return to a state of :meth:`get_state`, bit for bit."""
        for i, batch in enumerate(self.batches):
            mark = f"{i}/"
            batch.set_state({k[len(mark) :]: v for k, v in state.items() if k.startswith(mark)})
