"""The single environment, around any plant."""

from math import isfinite
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from pam_envs.envs.core.info import Info
from pam_envs.envs.core.saved_state import (
    check_seal,
    check_state,
    saved,
    saved_part,
    sealed,
)
from pam_envs.envs.core.setup import (
    BEGIN,
    MOST_STEPS,
    NUMBER_KINDS,
    STEP,
    Configured,
    Setup,
    check_seed,
    fresh_seed,
    space_of,
)
from pam_envs.kernels.build import COMPILED, address_book
from pam_envs.kernels.random import seed_words
from pam_envs.wording import shown

INTERPRETED_CALLS = 50
"""Steps in plain Python before an environment asks for machine code, and asks again.

One whose machine code another environment of this process uses starts with it.
"""


class PlantEnv(Configured, gym.Env[NDArray[np.float32], NDArray[np.float32]]):
    """Environment around a plant: a batch of one, run by the kernels that run a batch.

    ``reset(seed=s)`` starts episode 0 of the seed; ``reset()`` starts the next one. All random
    numbers are a function of seed, episode, stream and draw; ``np_random`` is not used.

    Parameters
    ----------
    setup : Setup, optional
        Configuration; default: ``make_setup(**arguments)``.
    **arguments : object
        Keyword arguments of the environment.
    """

    metadata = {"render_modes": ["rgb_array", "human"], "render_fps": 100}

    def __init__(self, setup: Setup | None = None, **arguments: Any) -> None:
        setup = self._configure(setup, arguments)
        self.observation_space: gym.spaces.Box[np.float32] = space_of(setup.signals)
        self.action_space: gym.spaces.Box[np.float32] = space_of(setup.action_signals)
        self._seed: int | None = None
        self._steps = -1
        self._renderer: Any = None
        self._n_actions = len(setup.action_signals)
        self._keys = setup.info_keys
        self._run: Any = None
        self._all: Any = None
        self._action_cells: Any = None
        self._outputs: tuple[Any, ...] = ()
        run = setup.kernels.single.run if COMPILED else None
        self._warming = INTERPRETED_CALLS if COMPILED and run is None else 0
        self._use(run or setup.kernels.interpreted, compiled=run is not None)

    def _use(self, function: Any, compiled: bool) -> None:
        """Use ``function`` for all further steps: plain Python on lists, or machine code on arrays.

        Plain Python is ready at once; machine code takes time to load or to compile.
        """
        setup = self.setup
        outputs = (
            np.zeros((1, len(setup.action_signals))),
            np.zeros((2, 1, len(setup.signals)), np.float32),
            np.zeros((2, len(setup.info_keys) + 1, 1)),
            np.zeros((2, 1), np.int8),
        )
        own = [*setup.state(1, 1), *outputs]
        if self._run is not None:
            past = zip((*self._all, *self._outputs), own, strict=True)
            own = [np.array(old, new.dtype) for old, new in past]
        arrays = [*own[:4], *setup.shared, *own[4:]]
        held = arrays if compiled else [a.tolist() for a in arrays]
        self._all = tuple(held[:4])
        self._counts = self._all[2][0]
        self._outputs = tuple(held[-4:])
        self._actions, self._observations, self._infos, self._flags = self._outputs
        self._run, self._compiled = function, compiled
        self._arguments: tuple[Any, ...] = (*held, 1)
        if compiled:
            book = address_book(held)
            self._held, self._arguments = (held, book), (book.ctypes.data,)
            self._action_cells = memoryview(self._actions.ravel())
            self._reward_cell = memoryview(self._infos[0, 0])
            self._info_cells = memoryview(self._infos[0, 1:].ravel())
            self._flag_cells = memoryview(self._flags.ravel())
            self._observation = self._observations[0, 0]
        else:
            self._action_cells = self._actions[0]

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], Info]:
        """Start an episode; see Gymnasium. There are no ``options``."""
        self._check_options(options)
        a, b, episode = self.setup.seed_rows
        if seed is not None or self._seed is None:
            self._seed = fresh_seed() if seed is None else check_seed(seed)
            super().reset(seed=self._seed % 2**63)
            self._counts[a][0], self._counts[b][0] = seed_words(self._seed)
            self._counts[episode][0] = 0
        else:
            self._counts[episode][0] += 1
        self._flags[0][0], self._flags[1][0] = 1, 0
        self._run(*self._arguments, BEGIN)
        self._steps = 0
        observation, info, _, _, _ = self._read()
        if self.render_mode is not None:
            self._draw(info, start=True)
        return observation, info

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, Info]:
        """Apply an action for one control period; see Gymnasium.

        Raises
        ------
        ValueError
            If the action is anything but a finite, unmasked array or list of booleans, integers or
            floats of the shape of ``action_space``; nothing has changed then.
        """
        if self._steps < 0:
            raise gym.error.ResetNeeded("call reset() before step()")
        self._take(action)
        self._run(*self._arguments, STEP)
        self._steps += 1
        observation, info, reward, terminated, truncated = self._read()
        if self.render_mode is not None:
            self._draw(info)
        return observation, reward, terminated, truncated, info

    def _change(self) -> None:
        """Change to machine code, or try again after some steps while it is compiled."""
        run = self.setup.kernels.single.ready()
        if run is None:
            self._warming = INTERPRETED_CALLS
        else:
            self._use(run, compiled=True)

    def _take(self, action: Any) -> None:
        """Check an action and pass it to the kernel."""
        if self._warming:
            self._warming -= 1
            if not self._warming:
                self._change()
        cells, i = self._action_cells, 0
        if type(action) is np.ndarray and action.dtype.kind in NUMBER_KINDS:
            try:
                for value in action.tolist():
                    if not isfinite(value):
                        raise TypeError
                    cells[i] = value
                    i += 1
            except (TypeError, IndexError):
                i = -1
        if i != self._n_actions:
            for i, value in enumerate(self._numbers(action, (self._n_actions,), "action").tolist()):
                cells[i] = value

    def _read(self) -> tuple[NDArray[np.float32], Info, float, bool, bool]:
        """Return observation, info, reward and flags of the last call."""
        if self._compiled:
            flags, cells = self._flag_cells, self._info_cells
            info = Info(self._keys, cells[0], cells.tobytes())
            reward: float = self._reward_cell[0]
            return self._observation.copy(), info, reward, flags[0] == 1, flags[1] == 1
        reward, *values = (float(row[0]) for row in self._infos[0])
        observation = np.array(self._observations[0][0], np.float32)
        info = Info(self._keys, values[0], np.array(values).tobytes())
        return observation, info, reward, self._flags[0][0] == 1, self._flags[1][0] == 1

    def _draw(self, info: Info, start: bool = False) -> None:
        """Record a step for pictures; show the picture at once in the ``human`` mode."""
        if self._renderer is None:
            from pam_envs.envs.rendering.renderer import Renderer

            self._renderer = Renderer(self)
        self._renderer.record(info, start)
        if self.render_mode == "human":
            self._renderer.show()

    def render(self) -> NDArray[np.uint8] | None:  # type: ignore[override]
        """Return a picture, shape (height, width, 3), in the mode ``"rgb_array"``."""
        if self.render_mode is None:
            gym.logger.warn("render() needs render_mode='rgb_array' or 'human' in gym.make")
            return None
        if self._steps < 0:
            raise gym.error.ResetNeeded("call reset() before render()")
        if self._renderer is None:  # a copy, or closed in between: the past is not known
            self._draw(self._read()[1], start=True)
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
        """Return the complete state of the environment, as arrays that own their data."""
        seed = -1 if self._seed is None else self._seed
        return sealed(
            {
                **saved(self._all),
                "infos": np.array(self._infos, np.float64),
                "steps": np.array(self._steps),
                "seed": np.frombuffer(str(seed).encode(), np.uint8).copy(),
            }
        )

    def set_state(self, state: dict[str, NDArray[Any]]) -> None:
        """Restore a state of :meth:`get_state`, to the last bit.

        Raises
        ------
        ValueError
            If the state is of another kind of environment, or has changed and was not sealed
            anew (:func:`pam_envs.envs.core.saved_state.sealed`); nothing has changed then.
        """
        steps = int(saved_part(state, "steps", (), "i"))
        digits = saved_part(state, "seed", (np.size(state.get("seed", ())),), "u")
        try:
            seed = int(digits.tobytes().decode())
        except ValueError as error:
            raise ValueError(f"the state was not made by get_state: {shown(error)}") from error
        if not -1 <= steps <= MOST_STEPS or seed < (-1 if steps < 0 else 0):
            raise ValueError(f"the state has steps = {steps} and seed = {shown(seed)}; no run has")
        parts = check_state(state, self.setup, 1, 1, steps >= 0)
        infos = saved_part(state, "infos", np.shape(self._infos), "f")
        check_seal(state)
        for to, part in zip(self._all, parts, strict=True):
            for i, value in enumerate(part[0].tolist()):
                to[0][i][0] = value[0]
        for to, part in zip(self._infos, infos, strict=True):  # the last info, for a picture
            for k, value in enumerate(part.tolist()):
                to[k][0] = value[0]
        self._steps, self._seed = steps, None if seed < 0 else seed

    def __getstate__(self) -> dict[str, Any]:
        """Pickle and deepcopy through :meth:`get_state`."""
        return {"setup": self.setup, "state": self.get_state(), "spec": self.spec}

    def __setstate__(self, pickled: dict[str, Any]) -> None:
        """Rebuild the environment in the pickled state."""
        PlantEnv.__init__(self, pickled["setup"])
        self.spec = pickled["spec"]
        self.set_state(pickled["state"])
