"""The single environment: the only ``step`` there is."""

from __future__ import annotations

import math
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from pam_envs.envs.setup import (
    BEGIN,
    STATE_KEYS,
    STEP,
    Setup,
    check_seed,
    check_state,
    for_kernels,
)
from pam_envs.kernels import COMPILED, seed_words
from pam_envs.parameters import Signals

Info = dict[str, Any]


def space_of(signals: Signals) -> gym.spaces.Box:
    """Return the Box of a vector of signals."""
    low = [-1.0 if s.normalized else s.low for s in signals]
    high = [1.0 if s.normalized else s.high for s in signals]
    return gym.spaces.Box(np.array(low, np.float32), np.array(high, np.float32), dtype=np.float32)


def fresh_seed() -> int:
    """Return a seed from the operating system's entropy."""
    return int(np.random.SeedSequence().generate_state(1, np.uint64)[0] >> 1)


class PlantEnv(gym.Env[NDArray[np.float32], NDArray[np.float32]]):
    """An environment around a plant: a batch of one, run by the kernels that run a batch.

    ``reset(seed=s)`` starts episode 0 of the seed; ``reset()`` starts the next one. All random
    numbers are a function of seed, episode, stream and draw; ``np_random`` is never drawn from.
    """

    metadata = {"render_modes": ["rgb_array", "human"], "render_fps": 50}

    def __init__(self, setup: Setup) -> None:
        self.setup = setup
        self.plant = setup.plant
        self.signals = setup.signals
        self.action_signals = setup.action_signals
        self.render_mode = setup.render_mode
        self.observation_space = space_of(setup.signals)
        self.action_space = space_of(setup.action_signals)
        self.control_period = setup.control_period
        self._seed: int | None = None
        self._steps = -1
        self._renderer: Any = None
        self._all = tuple(for_kernels(a) for a in setup.state(1, 1))
        self._counts = self._all[1][0]
        self._actions = for_kernels(np.zeros((1, len(setup.action_signals)), np.float64))
        self._observation = for_kernels(np.zeros((1, len(setup.signals)), np.float32))
        self._reward = for_kernels(np.zeros(1))
        self._flags = for_kernels(np.zeros((2, 1), np.int8))
        self._info = for_kernels(np.zeros((len(setup.info_keys), 1)))
        outputs = (self._observation, self._reward, self._flags, self._info)
        self._arguments = (
            *self._all,
            *(for_kernels(a) for a in setup.shared),
            for_kernels(setup.scales),
            self._actions,
            *outputs,
            self._observation,
            self._info,
            1,
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], Info]:
        """Start an episode; see Gymnasium."""
        a, b, episode = self.setup.seed_rows
        if seed is not None or self._seed is None:
            self._seed = fresh_seed() if seed is None else check_seed(seed)
            super().reset(seed=self._seed % 2**63)
            self._counts[a][0], self._counts[b][0] = seed_words(self._seed)
            self._counts[episode][0] = 0
        else:
            self._counts[episode][0] += 1
        self._flags[0][0], self._flags[1][0] = 1, 0
        self.setup.kernels.single(*self._arguments, BEGIN)
        self._steps = 0
        observation, info = self._read()
        if self.render_mode is not None:
            self._draw(observation, info, start=True)
        return observation, info

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, Info]:
        """Apply an action for one control period; see Gymnasium.

        Raises
        ------
        ValueError
            If the action is not finite or has the wrong shape; nothing has changed then.
        """
        if self._steps < 0:
            raise gym.error.ResetNeeded("call reset() before step()")
        self._take(action)
        self.setup.kernels.single(*self._arguments, STEP)
        self._steps += 1
        observation, info = self._read()
        if self.render_mode is not None:
            self._draw(observation, info)
        flags = self._flags
        return (
            observation,
            float(self._reward[0]),
            bool(flags[0][0]),
            bool(flags[1][0]),
            info,
        )

    def _take(self, action: Any) -> None:
        """Check an action and hand it to the kernel."""
        row = self._actions[0]
        if not isinstance(action, np.ndarray) or action.shape != (len(row),):
            action = self._as_action(action, len(row))
        for i, value in enumerate(action.tolist()):
            if not math.isfinite(value):
                signal = self.action_signals[i]
                raise ValueError(
                    f"action[{i}] ({signal.name}) is {value}; give a finite number between "
                    f"{self.action_space.low[i]:g} and {self.action_space.high[i]:g}"
                )
            row[i] = value

    def _as_action(self, action: Any, number: int) -> NDArray[Any]:
        try:
            made = np.asarray(action, np.float64)
        except (TypeError, ValueError, OverflowError) as error:
            raise ValueError(
                f"the action {str(action)[:60]!r} is not an array of {number} numbers: {error}"
            ) from error
        if made.shape != (number,):
            raise ValueError(
                f"the action has shape {made.shape}, expected ({number},): one number for each of "
                + ", ".join(self.action_signals.names())
            )
        return made

    def _read(self) -> tuple[NDArray[np.float32], Info]:
        if COMPILED:
            observation = self._observation[0].copy()
            values = self._info.ravel().tolist()
        else:
            observation = np.array(self._observation[0], np.float32)
            values = [row[0] for row in self._info]
        return observation, dict(zip(self.setup.info_keys, values, strict=True))

    def _draw(self, observation: NDArray[np.float32], info: Info, start: bool = False) -> None:
        """Keep what a picture needs, and show it at once in the ``human`` mode."""
        if self._renderer is None:
            from pam_envs.envs.rendering import make_renderer

            self._renderer = make_renderer(self)
        self._renderer.record(observation, info, start)
        if self.render_mode == "human":
            self._renderer.show()

    def render(self) -> NDArray[np.uint8] | None:  # type: ignore[override]
        """Return a picture, shape (height, width, 3), in the mode ``"rgb_array"``."""
        if self.render_mode is None:
            gym.logger.warn("render() needs render_mode='rgb_array' or 'human' in gym.make")
            return None
        if self._steps < 0:
            raise gym.error.ResetNeeded("call reset() before render()")
        if self.render_mode == "human":
            return None
        picture: NDArray[np.uint8] = self._renderer.picture()
        return picture

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def get_state(self) -> dict[str, NDArray[Any]]:
        """Return everything that the future depends on, as arrays that own their data."""
        seed = -1 if self._seed is None else self._seed
        rows, counts, ahead = (np.array(a) for a in self._all)
        return {
            "rows": rows.astype(np.float64),
            "counts": counts.astype(np.int64),
            "ahead": ahead.astype(np.float64),
            "steps": np.array(self._steps),
            "seed": np.frombuffer(str(seed).encode(), np.uint8).copy(),
        }

    def set_state(self, state: dict[str, NDArray[Any]]) -> None:
        """Go back to a state of :meth:`get_state`, to the last bit.

        Raises
        ------
        ValueError
            If the state is of another kind of environment; nothing has changed then.
        """
        check_state(state, self.setup.state(1, 1))
        for to, name in zip(self._all, STATE_KEYS, strict=True):
            for i, value in enumerate(np.asarray(state[name])[0].tolist()):
                to[0][i][0] = value[0]
        self._steps = int(state["steps"])
        seed = int(np.asarray(state["seed"], np.uint8).tobytes().decode())
        self._seed = None if seed < 0 else seed

    def __getstate__(self) -> dict[str, Any]:
        """Pickle and deepcopy through :meth:`get_state`."""
        return {
            "setup": self.setup,
            "state": self.get_state(),
            "spec": self.spec,
        }

    def __setstate__(self, pickled: dict[str, Any]) -> None:
        """Rebuild the environment in the pickled state."""
        type(self).__init__(self, pickled["setup"])
        self.spec = pickled["spec"]
        self.set_state(pickled["state"])
