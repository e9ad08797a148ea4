"""Environment of a residual policy, whose action corrects a controller's."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from agents.settings.schema import SettingsError
from agents.vec_envs.gauge import ErrorMean


class ResidualVecEnv(VecEnvWrapper):
    """The plant gets ``controller's action + scale * action``, clipped to its range.

    With ``gauge`` the correction is also multiplied by that share of the recent error.

    The controller, which ``make`` makes from a nominal plant, runs on all rows at once, with a
    state for each, and its action is appended to the observation; rows on different plants have a
    controller each. ``plants``, one for each batch of rows, replaces their nominal plants. The
    actions of ``venv`` are in [-1, 1]; ``scale`` is that of
    :class:`agents.settings.parts.Residual`; ``record`` is the card's entry on the controller, once
    it is recorded.
    """

    def __init__(
        self,
        venv: VecEnv,
        name: str,
        make: Callable[[Any], Any],
        scale: float,
        plants: Sequence[Any] = (),
        gauge: ErrorMean | None = None,
    ) -> None:
        box, action = venv.observation_space, venv.action_space
        assert isinstance(box, spaces.Box)
        assert isinstance(action, spaces.Box)
        if action.low.min() < -1.0 or action.high.max() > 1.0:
            raise SettingsError(
                f"a residual needs actions from -1 to 1, but they reach from {action.low.min():g} "
                f"to {action.high.max():g}; leave normalize of the environment as it is (True)"
            )
        low = np.concatenate([box.low, action.low])
        high = np.concatenate([box.high, action.high])
        width = action.shape[0]
        super().__init__(
            venv,
            spaces.Box(low, high, dtype=np.float32),
            spaces.Box(-1.0, 1.0, (width,), np.float32),
        )
        self.name = name
        self.range = action
        self.scale = np.float32(scale)
        parts = parts_of(venv, plants)
        self.plants = [plant for _, plant in parts]
        self.controllers = [(rows, make(plant)) for rows, plant in parts]
        self.record: dict[str, Any] | None = None
        self.states: list[Any] = [None] * len(self.controllers)
        self.given = np.zeros((venv.num_envs, width), np.float32)
        self.seen = np.zeros((venv.num_envs, box.shape[0]), np.float32)
        self.gauge = gauge
        self.errors = np.zeros((venv.num_envs, gauge.width if gauge else 0), np.float32)

    def reset(self) -> NDArray[np.float32]:
        """Start all episodes; see stable-baselines3."""
        observation = np.asarray(self.venv.reset())
        self.states = [None] * len(self.controllers)
        return self._joined(observation, np.ones(self.num_envs, bool))

    def _joined(self, observation: NDArray[Any], starts: NDArray[np.bool_]) -> NDArray[np.float32]:
        """Run the controllers and return the observation with their actions."""
        self.seen = observation
        if self.gauge:
            self.errors[starts] = 0.0
            self.errors = self.gauge.after(self.errors, observation)
        for i, (rows, controller) in enumerate(self.controllers):
            self.given[rows], self.states[i] = controller.predict(
                observation[rows], self.states[i], starts[rows]
            )
        return np.concatenate([observation, self.given], 1)

    def step_async(self, actions: NDArray[Any]) -> None:
        """Apply the correction."""
        change = np.clip(np.asarray(actions, np.float32), np.float32(-1.0), np.float32(1.0))
        if self.gauge:
            change = change * self.gauge.factor(self.errors)
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
        """Append the controllers' actions to the terminal observations."""
        for (rows, controller), state in zip(self.controllers, self.states, strict=True):
            ended = np.flatnonzero(done[rows])
            if not len(ended):
                continue
            places = (ended + (rows.start or 0)).tolist()
            last = np.array([infos[row]["terminal_observation"] for row in places])
            answers, _ = controller.predict(last, _rows(state, ended), np.zeros(len(ended), bool))
            for row, observation, answer in zip(places, last, answers, strict=True):
                infos[row]["terminal_observation"] = np.concatenate([observation, answer])

    def snapshot(self) -> dict[str, Any]:
        """Return the complete state."""
        return {
            "seen": self.seen.copy(),
            "given": self.given.copy(),
            "errors": self.errors.copy(),
            "states": [_plain(state) for state in self.states],
        }

    def restore(self, saved: dict[str, Any]) -> None:
        """Return to a snapshot."""
        self.seen, self.given = saved["seen"].numpy().copy(), saved["given"].numpy().copy()
        self.errors = saved["errors"].numpy().copy()
        for i, (rows, controller) in enumerate(self.controllers):
            seen = self.seen[rows]
            _, template = controller.predict(seen, None, np.ones(len(seen), bool))
            self.states[i] = _restored(template, saved["states"][i])


def parts_of(venv: VecEnv, plants: Sequence[Any] = ()) -> list[tuple[slice, Any]]:
    """Return the rows of each nominal plant, or of each of the given ones."""
    base: Any = venv.unwrapped
    return list(base.parts(plants))


# A controller's state is a tuple, perhaps named, of arrays, None and such tuples.


def _rows(state: Any, rows: NDArray[np.intp]) -> Any:
    """Return some rows of a state."""
    if isinstance(state, tuple):
        return _like(state, [_rows(part, rows) for part in state])
    return None if state is None else state[rows]


def _plain(state: Any) -> Any:
    """Return a state as nested lists of arrays that own their data."""
    if isinstance(state, tuple):
        return [_plain(part) for part in state]
    return None if state is None else np.array(state)


def _restored(template: Any, saved: Any) -> Any:
    """Return a saved state in the form of a template."""
    if isinstance(template, tuple):
        pairs = zip(template, saved, strict=True)
        return _like(template, [_restored(*pair) for pair in pairs])
    if template is not None and saved.shape != np.shape(template):
        raise ValueError(f"a controller's state has the shape {[*saved.shape]}")
    return None if template is None else saved.numpy().astype(template.dtype)


def _like(state: tuple[Any, ...], parts: list[Any]) -> Any:
    return type(state)(*parts) if hasattr(state, "_fields") else tuple(parts)
