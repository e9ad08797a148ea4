"""Environment whose observation also holds what only the training knows: parameters and state."""

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

STATE = ("output", "reference")
"""Entries of ``info`` beside ``state/...``; both are free of noise."""
CLIP = 10.0  # largest normalised value


class PrivilegedVecEnv(VecEnvWrapper):
    """Append the plant's parameters that differ among episodes, and the noise-free state.

    Parameters are scaled to [-1, 1] over their ranges, which ``names`` lists in the order of the
    columns. The state is normalised by its running mean and deviation. In a row whose episode has
    just ended both are those of the next one; the terminal observation has its own.
    """

    def __init__(self, venv: VecEnv) -> None:
        base: Any = venv.unwrapped
        self.base = base
        hulls = [batch.unwrapped.hull for batch in base.batches]
        low = np.min([hull[0] for hull in hulls], axis=0)
        high = np.max([hull[1] for hull in hulls], axis=0)
        self.columns = np.flatnonzero(high > low)
        self.low, self.span = low[self.columns], (high - low)[self.columns]
        plant = base.batches[0].unwrapped.plant
        self.names = tuple(plant.names[i] for i in self.columns)
        nominal = np.array([plant.value(name) for name in self.names])
        self.nominal = self._scaled(nominal)
        """Nominal parameters, scaled, of the first kind of rows; shape (n_parameters,)."""
        self.states = [n for n in base.reported() if n in STATE or n.startswith("state/")]
        base.watch(self.states)
        self.moments = RunningMeanStd(shape=(len(self.states),))
        self.parameters = np.zeros((venv.num_envs, len(self.names)), np.float32)
        width = len(self.names) + len(self.states)
        box: Any = venv.observation_space
        low, high = box.low, box.high
        low = np.concatenate([low, np.full(width, -CLIP, np.float32)])
        high = np.concatenate([high, np.full(width, CLIP, np.float32)])
        super().__init__(venv, spaces.Box(low, high, dtype=np.float32))

    def _scaled(self, parameters: NDArray[np.float64]) -> NDArray[np.float32]:
        made: NDArray[np.float64] = 2.0 * (parameters - self.low) / self.span - 1.0
        return made.astype(np.float32)

    def _values(self, table: dict[str, NDArray[Any]]) -> NDArray[np.float64]:
        return np.stack([table[name] for name in self.states], axis=1).astype(np.float64)

    def _normalised(self, values: NDArray[np.float64]) -> NDArray[np.float32]:
        deviation = np.sqrt(self.moments.var + 1e-8)
        made = np.clip((values - self.moments.mean) / deviation, -CLIP, CLIP)
        return np.asarray(made, np.float32)

    def _present(self) -> NDArray[np.float32]:
        """Return the present state, by which the moments are updated before."""
        values = self._values(self.base.present)
        self.moments.update(values)
        return self._normalised(values)

    def reset(self) -> NDArray[np.float32]:
        """Start all episodes; see stable-baselines3."""
        observation = np.asarray(self.venv.reset())
        self.parameters = self._scaled(self.base.parameters()[:, self.columns])
        return np.concatenate([observation, self.parameters, self._present()], 1)

    def step_wait(self) -> VecEnvStepReturn:
        """Step all rows; see stable-baselines3."""
        raw, reward, done, infos = self.venv.step_wait()
        state = self._present()
        if done.any():
            self._finish(done, infos)
        observation = np.concatenate([np.asarray(raw), self.parameters, state], 1)
        return observation, reward, done, infos

    def _finish(self, done: NDArray[np.bool_], infos: list[dict[str, Any]]) -> None:
        """Complete the terminal observations, then take the next episodes' parameters."""
        last = self._normalised(self._values(self.base.last))
        for row in np.flatnonzero(done).tolist():
            ended = infos[row]["terminal_observation"]
            infos[row]["terminal_observation"] = np.concatenate(
                [ended, self.parameters[row], last[row]]
            )
        self.parameters = self._scaled(self.base.parameters()[:, self.columns])

    def snapshot(self) -> dict[str, Any]:
        """Return the complete state."""
        moments = self.moments
        return {
            "parameters": self.parameters.copy(),
            "moments": [np.array(moments.mean), np.array(moments.var), float(moments.count)],
        }

    def restore(self, saved: dict[str, Any]) -> None:
        """Return to a snapshot."""
        self.parameters = saved["parameters"].numpy().copy()
        mean, variance, count = saved["moments"]
        self.moments.mean, self.moments.var = mean.numpy().copy(), variance.numpy().copy()
        self.moments.count = count
