"""Adapter of the batched environment to stable-baselines3: one kernel call a step.

There are no processes and no loop over environments. stable-baselines3 expects a list of ``info``
dictionaries; here all rows whose episode continues share one empty dictionary.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvStepReturn

import pam_envs  # noqa: F401  (registers the environments)

FINAL_KEYS = ("final_obs", "final_info")


class NoInfo(dict[str, Any]):
    """The empty ``info`` that rows share, which refuses writes."""

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError("this info is shared by all rows and stays empty; copy it to add to it")

    __setitem__ = update = setdefault = __ior__ = _refuse


NO_INFO = NoInfo()


def make_batch_vec_env(env_id: str, num_envs: int, **kwargs: Any) -> BatchVecEnv:
    """Return ``num_envs`` environments for stable-baselines3.

    Parameters
    ----------
    env_id : str
        A registered environment, for example ``"PAM/MusclePositioning-v0"``.
    num_envs : int
        Number of rows.
    **kwargs
        Arguments of the environment. ``info=True`` makes each step report ``info``, which is
        slower and which learning does not need.
    """
    made = gym.make_vec(
        env_id,
        num_envs=num_envs,
        vectorization_mode="vector_entry_point",
        **{"info": False, **kwargs},
    )
    return BatchVecEnv(made)


class BatchVecEnv(VecEnv):
    """``VecEnv`` over a batched Gymnasium environment that resets in the same step.

    Row ``i`` after ``seed(s)`` is the single environment reset with ``s + i``, bit for bit.
    ``infos[i]`` is empty unless an episode ended in row ``i``; then it holds
    ``terminal_observation`` and ``TimeLimit.truncated``.

    Parameters
    ----------
    env : gymnasium.vector.VectorEnv
        With ``AutoresetMode.SAME_STEP``.

    Raises
    ------
    ValueError
        If the environment has another reset mode.
    """

    def __init__(self, env: VectorEnv[Any, Any, Any]) -> None:
        mode = env.metadata.get("autoreset_mode")
        if mode != AutoresetMode.SAME_STEP:
            raise ValueError(
                f"the batched environment has autoreset_mode = {mode}, but stable-baselines3 needs "
                "AutoresetMode.SAME_STEP; make it with vectorization_mode='vector_entry_point'"
            )
        self.env = env
        self.spec = env.spec
        self._actions: NDArray[Any] | None = None
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> NDArray[np.float32]:
        """Start all episodes, with the seeds and options set before; see stable-baselines3."""
        seeds = None if all(s is None for s in self._seeds) else list(self._seeds)
        observation, infos = self.env.reset(
            seed=seeds,  # type: ignore[arg-type]
            options=self._common_options(),
        )
        self.reset_infos = self._rows_of(infos)
        self._reset_seeds()
        self._reset_options()
        return np.asarray(observation)

    def _common_options(self) -> dict[str, Any] | None:
        first = self._options[0]
        if any(options != first for options in self._options):
            raise ValueError("the rows are reset by one call; give the same options for all rows")
        return first or None

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions for :meth:`step_wait`."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Step all rows; see stable-baselines3."""
        if self._actions is None:
            raise RuntimeError("call step_async(actions) before step_wait()")
        actions, self._actions = self._actions, None
        observation, reward, terminated, truncated, infos = self.env.step(actions)
        done = terminated | truncated
        rows = self._rows_of(infos)
        if done.any():
            for i in np.flatnonzero(done).tolist():
                rows[i] = self._last_info(infos, i, bool(truncated[i] and not terminated[i]))
        return observation, reward.astype(np.float32), done, rows

    def _rows_of(self, infos: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Return the infos by row; rows without any share one."""
        keys = [k for k in infos if not k.startswith("_") and k not in FINAL_KEYS]
        if not keys:
            return [NO_INFO] * self.num_envs
        columns = [np.asarray(infos[k]).tolist() for k in keys]
        return [dict(zip(keys, row, strict=True)) for row in zip(*columns, strict=True)]

    @staticmethod
    def _last_info(infos: Mapping[str, Any], row: int, truncated: bool) -> dict[str, Any]:
        last = infos.get("final_info", {})
        made = {k: v[row].item() for k, v in last.items() if not k.startswith("_")}
        made["terminal_observation"] = infos["final_obs"][row]
        made["TimeLimit.truncated"] = truncated
        return made

    def close(self) -> None:
        """Close the batched environment."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of the batched environment, which the rows share, for each row."""
        return [getattr(self.env.unwrapped, attr_name)] * len(self._indices(indices))

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of the batched environment.

        Raises
        ------
        ValueError
            If ``indices`` are only some rows: the rows share their attributes.
        """
        self._all_rows(f"set_attr({attr_name!r})", indices)
        setattr(self.env.unwrapped, attr_name, value)

    def env_method(
        self,
        method_name: str,
        *method_args: Any,
        indices: VecEnvIndices = None,
        **method_kwargs: Any,
    ) -> list[Any]:
        """Call a method of the batched environment once; every row gets the result.

        Raises
        ------
        ValueError
            If ``indices`` are only some rows: a method acts on all.
        """
        self._all_rows(f"env_method({method_name!r})", indices)
        result = getattr(self.env.unwrapped, method_name)(*method_args, **method_kwargs)
        return [result] * self.num_envs

    def env_is_wrapped(
        self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Return False for each row: wrappers of single environments do not apply."""
        return [False] * len(self._indices(indices))

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """Return an image of each row that the batched environment renders."""
        drawn: Any = self.env.render()
        return list(drawn) if drawn is not None else [None] * self.num_envs

    def _indices(self, indices: VecEnvIndices) -> list[int]:
        rows = list(self._get_indices(indices))
        for row in rows:
            if not -self.num_envs <= row < self.num_envs:
                raise IndexError(f"row {row} is not among the {self.num_envs} environments")
        return rows

    def _all_rows(self, what: str, indices: VecEnvIndices) -> None:
        rows = self._indices(indices)
        if sorted(r % self.num_envs for r in rows) != list(range(self.num_envs)):
            raise ValueError(
                f"{what} for rows {rows}: the {self.num_envs} rows are one batch and share it; "
                "leave indices out, or use single environments (gym.make) for differing rows"
            )

    def get_state(self) -> dict[str, NDArray[Any]]:
        """Return all that the future depends on; see the batched environment."""
        base: Any = self.env.unwrapped
        state: dict[str, NDArray[Any]] = base.get_state()
        return state

    def set_state(self, state: dict[str, NDArray[Any]]) -> None:
        """Return to a state of :meth:`get_state`, bit for bit."""
        base: Any = self.env.unwrapped
        base.set_state(state)
