"""Adapter of batched environments to stable-baselines3: one kernel call per step and batch.

There are no processes and no loop over environments.
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvStepReturn

import pam_envs  # noqa: F401  (registers the environments)

FINAL_KEYS = ("final_obs", "final_info")


def make_batch_vec_env(env_id: str, num_envs: int, *kinds: Mapping[str, Any], **kwargs: Any) -> Any:
    """Return ``num_envs`` environments of each kind, or of one kind, for stable-baselines3.

    ``kinds`` are arguments of each kind of rows, ``kwargs`` those of all rows. ``info=True`` makes
    each step report ``info``, which is slower and which learning does not need.
    """
    return BatchVecEnv(
        *(
            gym.make_vec(
                env_id,
                num_envs=num_envs,
                vectorization_mode="vector_entry_point",
                **{"info": False, **kwargs, **kind},
            )
            for kind in kinds or ({},)
        )
    )


def nominal_plant(env_id: str, arguments: Mapping[str, Any]) -> Any:
    """Return the nominal plant of an environment with these arguments."""
    made: Any = gym.make_vec(env_id, 1, vectorization_mode="vector_entry_point", **arguments)
    return made.unwrapped.plant


class BatchVecEnv(VecEnv):
    """``VecEnv`` over the rows of batched Gymnasium environments, one batch after the other.

    The batches have the same spaces and ``AutoresetMode.SAME_STEP``, or a ValueError is raised. Row
    ``i`` after ``seed(s)`` is the single environment reset with ``s + i``, bit for bit.
    ``infos[i]`` is empty unless an episode ended in row ``i``; then it holds
    ``terminal_observation`` and ``TimeLimit.truncated``.

    ``present`` and ``last`` hold the entries of ``info`` named by :meth:`watch`, shape (num_envs,)
    each. They differ in rows whose episode has just ended: ``last`` has its last values,
    ``present`` those of the next episode.
    """

    def __init__(self, *batches: VectorEnv[Any, Any, Any]) -> None:
        for batch in batches:
            mode = batch.metadata.get("autoreset_mode")
            if mode != AutoresetMode.SAME_STEP:
                raise ValueError(
                    f"the batched environment has autoreset_mode = {mode}, but stable-baselines3 "
                    "needs AutoresetMode.SAME_STEP; make it with "
                    "vectorization_mode='vector_entry_point'"
                )
        self.batches = batches
        ends = np.cumsum([batch.num_envs for batch in batches]).tolist()
        self.slices = tuple(slice(a, b) for a, b in zip([0, *ends[:-1]], ends, strict=True))
        self.spec = batches[0].spec
        self._actions: NDArray[Any] | None = None
        self._watched: tuple[str, ...] = ()
        self._by_row = all(getattr(batch.unwrapped, "with_info", True) for batch in batches)
        self.present: dict[str, NDArray[Any]] = {}
        self.last: dict[str, NDArray[Any]] = {}
        super().__init__(
            ends[-1], batches[0].single_observation_space, batches[0].single_action_space
        )

    def parts(self, plants: Sequence[Any] = ()) -> Iterator[tuple[slice, Any]]:
        """Yield the rows of each plant; adjacent batches of equal plants are one entry.

        ``plants`` replaces the nominal plants of the batches, one for each.
        """
        own = plants or [self._base(i).plant for i in range(len(self.batches))]
        plants = list(zip(self.slices, own, strict=True))
        for _, group in itertools.groupby(plants, key=lambda pair: pair[1].digest()):
            pairs = list(group)
            yield slice(pairs[0][0].start, pairs[-1][0].stop), pairs[0][1]

    def _base(self, batch: int) -> Any:
        return self.batches[batch].unwrapped

    def reset(self) -> NDArray[np.float32]:
        """Start all episodes, with the seeds and options set before; see stable-baselines3."""
        made = [
            self._reset(batch, rows) for batch, rows in zip(self.batches, self.slices, strict=True)
        ]
        self._keep([infos for _, infos in made])
        pairs = zip(made, self.batches, strict=True)
        self.reset_infos = [
            info
            for (_, infos), batch in pairs
            for info in _rows_of(infos if self._by_row else {}, batch.num_envs)
        ]
        self._reset_seeds()
        self._reset_options()
        return _joined([observation for observation, _ in made])

    def _reset(self, batch: Any, rows: slice) -> tuple[Any, dict[str, Any]]:
        seeds, options = self._seeds[rows], self._options[rows]
        if any(own != options[0] for own in options):
            raise ValueError("the rows are reset by one call; give the same options for all rows")
        seeded = any(seed is not None for seed in seeds)
        return batch.reset(seed=seeds if seeded else None, options=options[0] or None)  # type: ignore[no-any-return]

    def watch(self, names: Sequence[str]) -> None:
        """Report entries of ``info`` in ``present`` and ``last`` from the next step or reset on."""
        self._watched = tuple(dict.fromkeys((*self._watched, *names)))
        for i in range(len(self.batches)):
            self._base(i).with_info = True

    def reported(self) -> tuple[str, ...]:
        """Return the names of all entries of ``info``."""
        return tuple(self._base(0).setup.info_keys)

    def parameters(self) -> NDArray[np.float64]:
        """Return the parameters [SI] of the present episodes, as in ``plant.names``."""
        return _joined([self._base(i).parameters() for i in range(len(self.batches))])

    def _keep(self, infos: Sequence[Mapping[str, Any]]) -> None:
        """Keep the watched entries of a step's or reset's infos, one of each batch."""
        for name in self._watched:
            self.present[name] = _joined([np.asarray(info[name]) for info in infos])
            ends = [
                np.where(info["_final_info"], info["final_info"][name], info[name])
                if "final_info" in info
                else np.asarray(info[name])
                for info in infos
            ]
            self.last[name] = _joined(ends)

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions for :meth:`step_wait`."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Step all rows; see stable-baselines3."""
        if self._actions is None:
            raise RuntimeError("call step_async(actions) before step_wait()")
        actions, self._actions = self._actions, None
        made = [
            batch.step(actions[rows]) for batch, rows in zip(self.batches, self.slices, strict=True)
        ]
        observations, rewards, terminated, truncated, infos = zip(*made, strict=True)
        self._keep(infos)
        rows = [
            info
            for t, u, reported in zip(terminated, truncated, infos, strict=True)
            for info in _step_infos(reported, t, u, self._by_row)
        ]
        done = _joined(terminated) | _joined(truncated)
        return _joined(observations), _joined(rewards).astype(np.float32), done, rows

    def close(self) -> None:
        """Close all batches."""
        for batch in self.batches:
            batch.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of each row's batch, which its rows share."""
        whole = [
            getattr(batch.unwrapped, attr_name)
            for batch in self.batches
            for _ in range(batch.num_envs)
        ]
        return [whole[row] for row in self._indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of all batches; their rows share it, so ``indices`` must be all."""
        self._check_all_rows(f"set_attr({attr_name!r})", indices)
        for batch in self.batches:
            setattr(batch.unwrapped, attr_name, value)

    def env_method(
        self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any
    ) -> list[Any]:
        """Call a method of all batches once; every row gets its batch's result."""
        self._check_all_rows(f"env_method({method_name!r})", indices)
        made = [getattr(batch.unwrapped, method_name)(*args, **kwargs) for batch in self.batches]
        rows = zip(made, self.batches, strict=True)
        return [value for value, batch in rows for _ in range(batch.num_envs)]

    def env_is_wrapped(
        self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Return False for each row: wrappers of single environments do not apply."""
        return [False] * len(self._indices(indices))

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """Return an image of each row that the batches render."""
        drawn: list[Any] = [(batch.render(), batch.num_envs) for batch in self.batches]
        return [image for made, rows in drawn for image in (made or [None] * rows)]

    def _indices(self, indices: VecEnvIndices) -> list[int]:
        rows = list(self._get_indices(indices))
        for row in rows:
            if not -self.num_envs <= row < self.num_envs:
                raise IndexError(f"row {row} is not among the {self.num_envs} environments")
        return rows

    def _check_all_rows(self, call: str, indices: VecEnvIndices) -> None:
        rows = self._indices(indices)
        if sorted(r % self.num_envs for r in rows) != list(range(self.num_envs)):
            raise ValueError(
                f"{call} for rows {rows}: the rows of one batch share it; leave indices out, or "
                "use single environments (gym.make) for differing rows"
            )

    def get_state(self) -> dict[str, NDArray[Any]]:
        """Return the complete state; see the batched environment."""
        states = [self._base(i).get_state() for i in range(len(self.batches))]
        return {f"{i}/{name}": v for i, state in enumerate(states) for name, v in state.items()}

    def set_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Return to a state of :meth:`get_state`, bit for bit."""
        for i in range(len(self.batches)):
            own = {k.removeprefix(f"{i}/"): v for k, v in state.items() if k.startswith(f"{i}/")}
            self._base(i).set_state(own)


def _joined(arrays: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Return the rows of all batches; the array itself for one batch."""
    return np.asarray(arrays[0]) if len(arrays) == 1 else np.concatenate(arrays)


def _step_infos(
    infos: Mapping[str, Any], terminated: NDArray[Any], truncated: NDArray[Any], by_row: bool
) -> list[dict[str, Any]]:
    """Return the infos of a batch's step by row; only those of ended episodes unless ``by_row``."""
    rows = _rows_of(infos if by_row else {}, len(terminated))
    for i in np.flatnonzero(terminated | truncated).tolist():
        rows[i] = _last_info(infos, i, bool(truncated[i] and not terminated[i]), by_row)
    return rows


def _rows_of(infos: Mapping[str, Any], rows: int) -> list[dict[str, Any]]:
    """Return the infos by row."""
    keys = [k for k in infos if not k.startswith("_") and k not in FINAL_KEYS]
    if not keys:
        return [{} for _ in range(rows)]
    columns = [np.asarray(infos[k]).tolist() for k in keys]
    return [dict(zip(keys, row, strict=True)) for row in zip(*columns, strict=True)]


def _last_info(infos: Mapping[str, Any], row: int, truncated: bool, by_row: bool) -> dict[str, Any]:
    last = infos.get("final_info", {}) if by_row else {}
    made = {k: v[row].item() for k, v in last.items() if not k.startswith("_")}
    made["terminal_observation"] = infos["final_obs"][row]
    made["TimeLimit.truncated"] = truncated
    return made
