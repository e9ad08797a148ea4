"""An environment in which the action corrects that of a controller."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from agents.policies.controllers import mapped, restored
from agents.settings.schema import SettingsError

Make = Callable[[Any], Any]


class ResidualVecEnv(VecEnvWrapper):
    """The plant gets ``controller's action + scale * action``, held within its range.

    The controller runs on all rows at once, with a state for each. What it answers is appended to
    the observation, since the policy cannot know it otherwise. Rows on plants of different kinds
    have controllers of their own, each told its rows' nominal plant.

    Parameters
    ----------
    venv : VecEnv
        With actions in [-1, 1].
    name : str
        The controller's.
    make : callable
        From a nominal plant to the controller.
    scale : float
        See :class:`agents.settings.parts.Residual`.
    """

    def __init__(self, venv: VecEnv, name: str, make: Make, scale: float) -> None:
        box, action = venv.observation_space, venv.action_space
        assert isinstance(box, spaces.Box)
        assert isinstance(action, spaces.Box)
        if action.low.min() < -1.0 or action.high.max() > 1.0:
            raise SettingsError(
                f"a residual needs actions from -1 to 1, but they reach from {action.low.min():g} "
                f"to {action.high.max():g}; leave normalize of the environment as it is (True)"
            )
        ends = (np.concatenate(pair) for pair in ((box.low, action.low), (box.high, action.high)))
        width = action.shape[0]
        super().__init__(
            venv,
            spaces.Box(*ends, dtype=np.float32),
            spaces.Box(-1.0, 1.0, (width,), np.float32),
        )
        self.name = name
        self.range = action
        self.scale = np.float32(scale)
        self.controllers = [(rows, make(plant)) for rows, plant in parts_of(venv)]
        self.states: list[Any] = [None] * len(self.controllers)
        self.given = np.zeros((venv.num_envs, width), np.float32)
        self.seen = np.zeros((venv.num_envs, box.shape[0]), np.float32)

    def reset(self) -> NDArray[np.float32]:
        """Start all episodes; see stable-baselines3."""
        observation = np.asarray(self.venv.reset())
        self.states = [None] * len(self.controllers)
        return self._joined(observation, np.ones(self.num_envs, bool))

    def _joined(self, observation: NDArray[Any], starts: NDArray[np.bool_]) -> NDArray[np.float32]:
        """Ask the controllers and return the observation with their answers."""
        self.seen = observation
        for i, (rows, controller) in enumerate(self.controllers):
            self.given[rows], self.states[i] = controller.predict(
                observation[rows], self.states[i], starts[rows]
            )
        return np.concatenate([observation, self.given], 1)

    def step_async(self, actions: NDArray[Any]) -> None:
        """Apply the correction."""
        change = np.clip(np.asarray(actions, np.float32), np.float32(-1.0), np.float32(1.0))
        applied = self.given + self.scale * change
        self.venv.step_async(np.clip(applied, self.range.low, self.range.high))

    def step_wait(self) -> VecEnvStepReturn:
        """Step all rows; see stable-baselines3."""
        raw, reward, done, infos = self.venv.step_wait()
        observation = np.asarray(raw)
        if done.any():
            self._finish(done, infos)
        return self._joined(observation, done), reward, done, infos

    def _finish(self, done: NDArray[np.bool_], infos: list[dict[str, Any]]) -> None:
        """Append what the controllers would have answered to the ended rows' last observations."""
        for (rows, controller), state in zip(self.controllers, self.states, strict=True):
            ended = np.flatnonzero(done[rows])
            if not len(ended):
                continue
            places = (ended + (rows.start or 0)).tolist()
            last = np.array([infos[row]["terminal_observation"] for row in places])
            answers, _ = controller.predict(
                last, mapped(state, lambda a, e=ended: a[e]), np.zeros(len(ended), bool)
            )
            for row, observation, answer in zip(places, last, answers, strict=True):
                infos[row]["terminal_observation"] = np.concatenate([observation, answer])

    def snapshot(self) -> dict[str, Any]:
        """Return what the future depends on."""
        return {
            "seen": self.seen.copy(),
            "given": self.given.copy(),
            "states": [_plain(state) for state in self.states],
        }

    def restore(self, saved: dict[str, Any]) -> None:
        """Go back to a snapshot."""
        self.seen, self.given = saved["seen"].numpy().copy(), saved["given"].numpy().copy()
        for i, (rows, controller) in enumerate(self.controllers):
            seen = self.seen[rows]
            _, template = controller.predict(seen, None, np.ones(len(seen), bool))
            self.states[i] = restored(template, saved["states"][i])


def parts_of(venv: VecEnv) -> list[tuple[slice, Any]]:
    """Return which rows are on which nominal plant."""
    base: Any = venv.unwrapped
    if hasattr(base, "parts"):
        return list(base.parts())
    return [(slice(0, venv.num_envs), base.get_attr("plant")[0])]


def _plain(state: Any) -> Any:
    """Return nested lists of arrays that own their data."""
    if isinstance(state, tuple):
        return [_plain(part) for part in state]
    return None if state is None else np.array(state)
