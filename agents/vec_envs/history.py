"""Environment whose observation includes past signals."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn


class HistoryVecEnv(VecEnvWrapper):
    """Append ``frames`` past values of some columns, ``stride`` control periods apart.

    The latest comes first; at reset they equal the present.
    """

    def __init__(self, venv: VecEnv, columns: Sequence[int], frames: int, stride: int = 1) -> None:
        self.columns = list(columns)
        self.frames, self.stride = frames, stride
        box: Any = venv.observation_space
        low, high = (np.concatenate([v, *[v[self.columns]] * frames]) for v in (box.low, box.high))
        super().__init__(venv, spaces.Box(low, high, dtype=np.float32))
        # every past period; frame k of the observation is the one k * stride periods ago
        self.past = np.zeros((venv.num_envs, frames * stride * len(self.columns)), np.float32)
        self.last = np.zeros((venv.num_envs, len(self.columns)), np.float32)
        self.shown = shown_columns(len(self.columns), frames, stride)

    def reset(self) -> NDArray[np.float32]:
        """Start all episodes; see stable-baselines3."""
        observation = np.asarray(self.venv.reset())
        self.last = observation[:, self.columns]
        self.past = np.tile(self.last, self.frames * self.stride)
        return self._joined(observation, self.past)

    def _joined(self, observation: NDArray[Any], past: NDArray[Any]) -> NDArray[np.float32]:
        return np.concatenate([observation, past[..., self.shown]], -1)

    def step_wait(self) -> VecEnvStepReturn:
        """Step all rows; see stable-baselines3."""
        raw, reward, done, infos = self.venv.step_wait()
        observation = np.asarray(raw)
        kept = self.past.shape[1] - len(self.columns)
        self.past = np.concatenate([self.last, self.past[:, :kept]], 1)
        self.last = observation[:, self.columns]
        for row in np.flatnonzero(done).tolist():
            ended = infos[row]["terminal_observation"]
            infos[row]["terminal_observation"] = self._joined(ended, self.past[row])
            self.past[row] = np.tile(self.last[row], self.frames * self.stride)
        return self._joined(observation, self.past), reward, done, infos


def shown_columns(columns: int, frames: int, stride: int) -> list[int]:
    """Return the places, among the values of every past period, of those in the observation."""
    starts = [(k * stride - 1) * columns for k in range(1, frames + 1)]
    return [start + i for start in starts for i in range(columns)]
