"""Environment whose observation includes signals of the last control periods."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn


class HistoryVecEnv(VecEnvWrapper):
    """Append past values of some columns, the latest first; at reset they equal the present."""

    def __init__(self, venv: VecEnv, columns: Sequence[int], frames: int) -> None:
        self.columns = list(columns)
        self.frames = frames
        box: Any = venv.observation_space
        low, high = (np.concatenate([v, *[v[self.columns]] * frames]) for v in (box.low, box.high))
        super().__init__(venv, spaces.Box(low, high, dtype=np.float32))
        self.past = np.zeros((venv.num_envs, frames * len(self.columns)), np.float32)
        self.last = np.zeros((venv.num_envs, len(self.columns)), np.float32)

    def reset(self) -> NDArray[np.float32]:
        """Start all episodes; see stable-baselines3."""
        observation = np.asarray(self.venv.reset())
        self.last = observation[:, self.columns]
        self.past = np.tile(self.last, self.frames)
        return np.concatenate([observation, self.past], 1)

    def step_wait(self) -> VecEnvStepReturn:
        """Step all rows; see stable-baselines3."""
        raw, reward, done, infos = self.venv.step_wait()
        observation = np.asarray(raw)
        kept = len(self.columns) * (self.frames - 1)
        self.past = np.concatenate([self.last, self.past[:, :kept]], 1)
        self.last = observation[:, self.columns]
        for row in np.flatnonzero(done).tolist():
            ended = infos[row]["terminal_observation"]
            infos[row]["terminal_observation"] = np.concatenate([ended, self.past[row]])
            self.past[row] = np.tile(self.last[row], self.frames)
        return np.concatenate([observation, self.past], 1), reward, done, infos
