"""The batch of environments: the same step over rows, in tiles of lanes and over cores."""

import dataclasses
import os
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from pam_envs.envs.core.batch import Batch
from pam_envs.envs.core.saved_state import (
    check_limits,
    check_seal,
    check_state,
    saved,
    saved_part,
    sealed,
)
from pam_envs.envs.core.setup import (
    BEGIN,
    STEP,
    STEP_AND_RESTART,
    Setup,
    check_choice,
    for_kernels,
    tiles_for,
)
from pam_envs.envs.core.step import CHOICE
from pam_envs.kernels.build import COMPILED, LANES
from pam_envs.kernels.random import seed_words

PARALLEL_FROM = 4096
"""Rows from which on a batch is spread over the cores."""
MODES = tuple(mode.value for mode in AutoresetMode)
_THREADS_OF: list[int] = []
"""Process whose threads run parallel kernels; they do not exist in its forks."""


class PlantVectorEnv(Batch):
    """``num_envs`` environments stepped by one kernel call.

    Row ``i`` of a batch reset with seed ``s`` is the single environment reset with ``s + i``, bit
    for bit, through every automatic reset. Resets happen in the same step: where an episode ends,
    the observation is the first one of the next episode, and ``infos["final_obs"]`` and
    ``infos["final_info"]`` hold the last ones of the ended episode.

    Parameters
    ----------
    num_envs : int
        Number of rows.
    info : bool
        Whether steps return ``info``; learning needs none and is faster without.
    threads : int or None
        1: one core. None: all cores for batches of 4,096 rows and more.
    autoreset_mode : AutoresetMode or str
        Mode of automatic resets, or its value: "SameStep", "NextStep" or "Disabled".
    setup : Setup, optional
        Configuration; default: ``make_setup(**arguments)``.
    device : str
        "cpu". For others :class:`~pam_envs.envs.device.vector_env.DeviceVectorEnv` is made.
    dtype : str
        "float64". Batches on other devices have "float32" too.
    **arguments : object
        Keyword arguments of the environment.
    """

    def __new__(cls, *given: Any, device: Any = "cpu", **named: Any) -> Any:
        """Return a batch on the processor, or one on another device."""
        if device == "cpu":
            return super().__new__(cls)
        from pam_envs.envs.device.vector_env import DeviceVectorEnv

        own = ("num_envs", "info", "autoreset_mode", "setup", "dtype")
        kept = {name: named.pop(name) for name in own if name in named}
        kept["setup"] = kept.get("setup") or cls.make_setup(**named)
        return DeviceVectorEnv(*given, **kept, device=device)

    def __init__(
        self,
        num_envs: int = 1,
        info: bool = True,
        threads: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        setup: Setup | None = None,
        *,
        device: str = "cpu",
        dtype: str = "float64",
        **arguments: Any,
    ) -> None:
        check_choice("dtype of a batch of device='cpu'", dtype, ("float64",))
        setup = self._configure(setup, arguments)
        self._configure_batch(num_envs, setup)
        check_choice("a batch's render_mode", setup.render_mode, (None, "rgb_array"))
        if setup.render_mode is not None and not info:
            raise ValueError("render_mode = 'rgb_array' needs info; leave info=True")
        check_choice("autoreset_mode", str(getattr(autoreset_mode, "value", autoreset_mode)), MODES)
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self.with_info = bool(info)
        self._renderers: list[Any] = []
        self._ended = np.zeros(self.num_envs, np.bool_)
        self._last_observation = np.zeros((self.num_envs, len(setup.signals)), np.float32)
        self._all = tuple(for_kernels(a) for a in setup.state(tiles_for(num_envs), LANES))
        self._shared = tuple(for_kernels(a) for a in setup.shared)
        self._keys = len(setup.info_keys)
        spread_out = COMPILED and threads != 1 and num_envs >= PARALLEL_FROM
        self._parallel = spread_out
        self._kernel = setup.kernels.parallel if spread_out else setup.kernels.batch

    @cached_property
    def hull(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Smallest and largest value of each parameter (:meth:`Setup.parameter_hull`)."""
        return self.setup.parameter_hull()

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start episodes; see Gymnasium. ``options["reset_mask"]`` resets some rows only."""
        mask = self._mask(options)
        self._seed_rows(self._seeds(seed), mask)
        outputs = self._outputs()
        observations, infos, flags = outputs
        observations[0], infos[0], flags[0], flags[1] = self._last_observation, 0.0, mask, False
        self._call(np.zeros((self.num_envs, len(self.action_signals))), outputs, BEGIN)
        self._seeded = True
        self._ended = self._ended & ~mask
        self._last_observation = observations[0].copy()
        if self.render_mode is not None:
            self._record(infos[0], np.flatnonzero(mask), mask)
        return observations[0], self._infos(infos[0])

    def _seed_rows(self, seeds: list[int | None] | None, mask: NDArray[np.bool_]) -> None:
        a, b, episode = self.setup.seed_rows
        for row in np.flatnonzero(mask).tolist():
            tile, lane = divmod(row, LANES)
            counts, seed = self._all[2][tile], None if seeds is None else seeds[row]
            if seed is None:
                counts[episode][lane] += 1
            else:
                counts[a][lane], counts[b][lane] = seed_words(seed)
                counts[episode][lane] = 0

    def _outputs(self) -> tuple[NDArray[Any], ...]:
        """Return fresh arrays: observations, reward with info (also of ended episodes), flags."""
        n, keys = self.num_envs, self._keys if self.with_info else 0
        return (
            np.empty((2, n, len(self.signals)), np.float32),
            np.empty((2, keys + 1, n)),
            np.empty((2, n), np.bool_),
        )

    def _call(self, actions: NDArray[Any], outputs: tuple[NDArray[Any], ...], mode: int) -> None:
        if COMPILED:
            if self._parallel:
                _THREADS_OF[:] = _THREADS_OF or [os.getpid()]
                if [os.getpid()] != _THREADS_OF:  # a fork: the same results on one core
                    self._kernel, self._parallel = self.setup.kernels.batch, False
            self._kernel(*self._all, *self._shared, actions, *outputs, self.num_envs, mode)
            return
        views = [a.tolist() for a in outputs]
        arguments = (actions.tolist(), *views, self.num_envs, mode)
        self._kernel(*self._all, *self._shared, *arguments)
        for array, view in zip(outputs, views, strict=True):
            array[...] = np.array(view, array.dtype).reshape(array.shape)

    def step(
        self, actions: NDArray[Any]
    ) -> tuple[
        NDArray[np.float32],
        NDArray[np.float64],
        NDArray[np.bool_],
        NDArray[np.bool_],
        dict[str, Any],
    ]:
        """Apply one action a row; see Gymnasium.

        Raises
        ------
        ValueError
            If the actions are anything but a finite, unmasked array or list of booleans, integers
            or floats of the shape of ``action_space``; nothing has changed then.
        """
        if not self._seeded:
            raise gym.error.ResetNeeded("call reset() before step()")
        before = self._ended
        if before.any() and self.autoreset_mode == AutoresetMode.DISABLED:
            raise gym.error.ResetNeeded(
                f"the episodes of rows {np.flatnonzero(before)[:8].tolist()} have ended; call "
                "reset(options={'reset_mask': terminated | truncated}) before step()"
            )
        actions = self._numbers(actions, (self.num_envs, len(self.action_signals)), "actions")
        outputs = self._outputs()
        observations, reports, flags = outputs
        if self.autoreset_mode == AutoresetMode.SAME_STEP:
            self._call(actions, outputs, STEP_AND_RESTART)
            starts = flags[0] | flags[1]
        else:
            self._call(actions, outputs, STEP)
            self._restart(before, outputs)
            starts, self._ended = before, flags[0] | flags[1]
        self._last_observation = observations[0].copy()
        infos = self._infos(reports[0])
        if self.render_mode is not None:
            self._record(reports[0], np.arange(self.num_envs), starts)
        if self.autoreset_mode == AutoresetMode.SAME_STEP and starts.any():
            self._add_final(infos, starts, observations[1], reports[1])
        return observations[0], reports[0, 0], flags[0], flags[1], infos

    def _restart(self, rows: NDArray[np.bool_], outputs: tuple[NDArray[Any], ...]) -> None:
        """Start the next episode of some rows; write their first observation and reward 0."""
        if not rows.any():
            return
        _, reports, flags = outputs
        kept = flags & ~rows
        flags[0], flags[1] = rows, False
        self._seed_rows(None, rows)
        self._call(np.zeros((self.num_envs, len(self.action_signals))), outputs, BEGIN)
        reports[0, 0, rows] = 0.0
        flags[...] = kept

    def _infos(self, info: NDArray[np.float64]) -> dict[str, Any]:
        return dict(zip(self.setup.info_keys, info[1:], strict=True)) if self.with_info else {}

    def _add_final(
        self,
        infos: dict[str, Any],
        ended: NDArray[np.bool_],
        final: NDArray[np.float32],
        final_info: NDArray[np.float64],
    ) -> None:
        last = np.full(self.num_envs, None, object)
        for row in np.flatnonzero(ended):
            last[row] = final[row].copy()
        infos["final_obs"], infos["_final_obs"] = last, ended
        if self.with_info:
            values = np.where(ended, final_info, 0.0)
            infos["final_info"] = self._infos(values)
            infos["_final_info"] = ended

    def _record(
        self, report: NDArray[np.float64], rows: NDArray[np.int64], starts: NDArray[np.bool_]
    ) -> None:
        """Record a step of some rows for pictures; ``starts`` marks rows that start an episode."""
        if not self._renderers:
            from pam_envs.envs.rendering.renderer import Renderer

            first = Renderer(self)
            others = [Renderer(self, first.canvas) for _ in range(self.num_envs - 1)]
            self._renderers = [first, *others]
        for row in rows.tolist():
            info = dict(zip(self.setup.info_keys, report[1:, row].tolist(), strict=True))
            self._renderers[row].record(info, bool(starts[row]))

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Return a picture of every row, each of shape (height, width, 3)."""
        if self.render_mode is None:
            gym.logger.warn("render() needs render_mode='rgb_array' in gym.make_vec")
            return None
        drawn = [renderer for renderer in self._renderers if renderer.info is not None]
        if len(drawn) < self.num_envs:
            raise gym.error.ResetNeeded("call reset() (after set_state: step()) before render()")
        return tuple(renderer.picture() for renderer in drawn)

    def close_extras(self, **kwargs: Any) -> None:
        """Discard the pictures."""
        self._renderers = []

    def parameters(self) -> NDArray[np.float64]:
        """Return the parameters [SI] of the present episodes, shape (num_envs, n_parameters).

        The columns are those of ``plant.names``. They include drawn values, which a controller does
        not know.
        """
        fixed = np.asarray(self._all[1], np.float64)[:, : len(self.plant.names)]
        lanes = np.moveaxis(fixed, 1, 2).reshape(-1, fixed.shape[1])
        return (
            lanes[: self.num_envs] if self.setup.drawn else np.repeat(lanes[:1], self.num_envs, 0)
        )

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Ranges [SI] in which episodes draw parameters, by name."""
        settings, choices = self.setup.shared[2:]
        table = settings[choices[CHOICE.at_spread] :][: choices[CHOICE.spread], :3].tolist()
        return {self.plant.names[int(row)]: (low, high) for row, low, high in table}

    @ranges.setter
    def ranges(self, ranges: Mapping[str, tuple[float, float]]) -> None:
        """Draw parameters in other ranges, from each row's next episode on.

        They replace those of ``randomize`` and must be within their hull with the nominal values,
        for which stability was checked.
        """
        tables, samples, settings, choices = self.setup.shared
        changed, names = settings.copy(), list(self.plant.names)
        rows = changed[choices[CHOICE.at_spread] :][: choices[CHOICE.spread]]
        if set(ranges) != set(self.ranges):
            raise ValueError(
                f"ranges of {', '.join(sorted(ranges)) or 'nothing'}; give one for each of "
                f"{', '.join(self.ranges) or 'nothing, with randomize = False'}"
            )
        for row in rows:
            name, (least, most) = names[int(row[0])], (end[int(row[0])] for end in self.hull)
            low, high = ranges[name]
            if not least <= low <= high <= most:
                raise ValueError(
                    f"the range of {name} is {low:g} to {high:g}; it must be ascending and within "
                    f"{least:g} to {most:g}"
                )
            row[1:3] = low, high
        self.setup = dataclasses.replace(self.setup, shared=(tables, samples, changed, choices))
        self._shared = tuple(for_kernels(a) for a in self.setup.shared)

    def get_state(self) -> dict[str, NDArray[Any]]:
        """Return the complete state of the batch, as arrays that own their data."""
        return sealed(
            {
                **saved(self._all),
                "last": self._last_observation.copy(),
                "seeded": np.array(self._seeded),
                "ended": self._ended.copy(),
            }
        )

    def set_state(self, state: dict[str, NDArray[Any]]) -> None:
        """Restore a state of :meth:`get_state`, to the last bit.

        Raises
        ------
        ValueError
            If the state is of another kind of batch, or has changed and was not sealed anew
            (:func:`pam_envs.envs.core.saved_state.sealed`); nothing has changed then.
        """
        seeded = bool(saved_part(state, "seeded", (), "b"))
        parts = check_state(state, self.setup, tiles_for(self.num_envs), LANES, seeded)
        last = saved_part(state, "last", self._last_observation.shape, "f").astype(np.float32)
        ended = saved_part(state, "ended", self._ended.shape, "b")
        restarts_later = seeded and self.autoreset_mode != AutoresetMode.SAME_STEP
        check_limits("ended", ended, 0, int(restarts_later))
        check_seal(state)
        self._all = tuple(map(for_kernels, parts))
        self._last_observation, self._seeded, self._ended = last, seeded, ended.copy()
        self._renderers = []
