"""Snapshot of a training at the start of a rollout, from which it continues bit for bit.

It holds the complete state: policy, optimisers, normalisation, replay buffer,
environment, random generators and counters. The bits are equal for the same libraries, the same
type of processor and one torch thread.
"""

import json
import random
from collections import deque
from collections.abc import Iterator
from operator import attrgetter
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize

from agents.training.checkpoint import tensors
from agents.vec_envs.cost import CostVecEnv
from agents.vec_envs.history import HistoryVecEnv
from agents.vec_envs.privileged import PrivilegedVecEnv
from agents.vec_envs.residual import ResidualVecEnv
from agents.vec_envs.widening import WideningVecEnv
from pam_envs.wording import shown

COUNTERS = ("num_timesteps", "_n_updates", "_episode_num", "_current_progress_remaining")
LAST = ("_last_obs", "_last_episode_starts", "_last_original_obs")
ARRAYS: dict[type[VecEnv], tuple[str, ...]] = {
    VecMonitor: ("episode_returns", "episode_lengths"),
    VecNormalize: ("returns", "old_obs", "old_reward"),
    HistoryVecEnv: ("past", "last"),
    CostVecEnv: ("before", "started", "totals", "periods"),
}
"""Arrays of the wrappers' states."""
OWN = (ResidualVecEnv, WideningVecEnv, PrivilegedVecEnv)
"""Wrappers with a snapshot of their own."""
ADAM = {"step", "exp_avg", "exp_avg_sq"}
"""State of a parameter in the optimiser of every algorithm."""
BUFFER = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")


MOST = 2**53
"""Largest number of a snapshot; whole ones are counts from 0."""


def take(model: BaseAlgorithm) -> dict[str, Any]:
    """Return a snapshot of arrays, tensors, numbers and text."""
    env = model.get_env()
    assert env is not None
    tensors = model._get_torch_save_params()[1]
    return {
        "parameters": model.get_parameters(),
        "tensors": {name: getattr(model, name).detach().clone() for name in tensors},
        "counters": {name: getattr(model, name) for name in COUNTERS},
        "last": {name: getattr(model, name) for name in LAST},
        "episodes": _episodes(model),
        "replay": _replay(model),
        "lstm": [part.clone() for pair in _lstm(model) for part in pair],
        "layers": {type(layer).__name__: _layer(layer) for layer in _layers(env)},
        "env": env.unwrapped.get_state(),  # type: ignore[attr-defined]
        "random": _random_state(model),
    }


def restore(model: BaseAlgorithm, snapshot: dict[str, Any]) -> None:
    """Restore a snapshot in a model that was built with the same settings.

    Raises ValueError, before anything is restored, if the snapshot has other keys, types or shapes
    than the model, or a number that is not finite.
    """
    env = model.get_env()
    assert env is not None
    if snapshot["counters"]["num_timesteps"] > 0:  # the wrappers have all their arrays then
        _begin(model, env)
    own = tensors(take(model))
    check(snapshot, own, "snapshot")
    _check_groups(snapshot["parameters"], own["parameters"])
    _check_replay(model, snapshot["replay"])
    model.set_parameters(snapshot["parameters"], exact_match=True, device="cpu")
    _check_optimizers(model)
    for name, tensor in snapshot["tensors"].items():
        getattr(model, name).data.copy_(tensor)
    for name, value in snapshot["counters"].items():
        setattr(model, name, value)
    for name, value in snapshot["last"].items():
        setattr(model, name, None if value is None else value.numpy().copy())
    rows = snapshot["episodes"].tolist()
    model.ep_info_buffer = deque(
        ({"r": r, "l": int(length), "t": t} for r, length, t in rows), maxlen=100
    )
    model.ep_success_buffer = deque(maxlen=100)
    _restore_replay(model, snapshot["replay"])
    places = [part for pair in _lstm(model) for part in pair]
    for place, tensor in zip(places, snapshot["lstm"], strict=True):
        place.copy_(tensor)
    for layer in _layers(env):
        _restore_layer(layer, snapshot["layers"][type(layer).__name__])
    state = {name: value.numpy().copy() for name, value in snapshot["env"].items()}
    env.unwrapped.set_state(state)  # type: ignore[attr-defined]
    _restore_random_state(model, snapshot["random"])


GROWING = ("snapshot/episodes", "snapshot/replay")
"""Parts whose sizes depend on how far a training is; so does the state of an optimiser."""
ANY = object()


def check(given: Any, like: Any, place: str) -> None:
    """Raise ValueError unless a part of a snapshot has the structure of a model's own, ``like``.

    Where that is ``ANY``, numbers need only be finite.
    """
    free = like is ANY or place.startswith(GROWING) or place.endswith("optimizer/state")
    if isinstance(given, dict) and (free or isinstance(like, dict)):
        own: dict[Any, Any] = {} if free else like
        if not free and given.keys() != own.keys():
            raise ValueError(f"{place} has other keys than the model")
        for key, value in given.items():
            check(value, own.get(key, ANY), f"{place}/{key}")
    elif isinstance(given, list) and (free or isinstance(like, list)):
        if not free and len(given) != len(like):
            raise ValueError(f"{place} has another length than in the model")
        for i, value in enumerate(given):
            check(value, ANY if free else like[i], f"{place}/{i}")
    elif not free and (
        type(given) is not type(like) or getattr(given, "dtype", 0) != getattr(like, "dtype", 0)
    ):
        raise ValueError(f"{place} is a {type(given).__name__}, in the model {type(like).__name__}")
    elif isinstance(given, torch.Tensor):
        if not free and given.shape != like.shape:
            raise ValueError(
                f"{place} has the shape {[*given.shape]}, in the model {[*like.shape]}"
            )
        if not torch.isfinite(given).all():
            raise ValueError(f"{place} has a value that is not finite")
    elif (
        isinstance(given, (int, float)) and not (0 if type(like) is int else -MOST) <= given <= MOST
    ):
        raise ValueError(f"{place} = {shown(given)} is out of range")


def _begin(model: BaseAlgorithm, env: VecEnv) -> None:
    """Give the model first observations, as its learning does."""
    first: Any = env.reset()
    model._last_obs, model._last_episode_starts = first, np.ones(env.num_envs, bool)
    normaliser = model.get_vec_normalize_env()
    if normaliser is not None:
        normaliser.old_reward = np.zeros(env.num_envs, np.float32)
    known = normaliser is not None or isinstance(model, OffPolicyAlgorithm)
    model._last_original_obs = first if known else None


def _check_groups(given: dict[str, Any], own: dict[str, Any]) -> None:
    """Raise ValueError unless the settings of each optimiser, but its rate, are the model's own."""
    for name, state in own.items():
        for mine, theirs in zip(
            state.get("param_groups", ()), given[name].get("param_groups", ()), strict=True
        ):
            if {**theirs, "lr": 0.0} != {**mine, "lr": 0.0} or not 0.0 <= theirs["lr"] <= 1.0:
                raise ValueError(f"snapshot/parameters/{name} has other settings than the model")


def _check_optimizers(model: BaseAlgorithm) -> None:
    """Raise ValueError unless the moments of each optimiser have the shapes of its parameters."""
    for name in model._get_torch_save_params()[0]:
        part = attrgetter(name)(model)
        states = getattr(part, "state", {})
        for parameter, state in states.items():
            good = [torch.is_tensor(m) and m.shape in (parameter.shape, ()) for m in state.values()]
            if not all(good) or state.keys() != ADAM:
                raise ValueError(f"the moments of {name} do not have the shapes of its parameters")
            if not 0.0 <= float(state["step"]) <= MOST:
                raise ValueError(f"the number of steps of {name} is out of range")


def _check_replay(model: BaseAlgorithm, saved: dict[str, Any] | None) -> None:
    """Raise ValueError unless a saved replay buffer fits the model's and its own counters."""
    if not isinstance(model, OffPolicyAlgorithm):
        if saved is not None:
            raise ValueError("snapshot/replay is that of another algorithm")
        return
    if not isinstance(saved, dict) or model.replay_buffer is None:
        raise ValueError("snapshot/replay is missing")
    buffer, position = model.replay_buffer, saved["pos"]
    size = buffer.buffer_size
    filled = size if saved["full"] is True else position
    if not 0 <= position < size + (saved["full"] is False):
        raise ValueError(f"snapshot/replay/pos = {position} is outside the buffer of {size}")
    for name in BUFFER:
        if saved[name].shape != (filled, *getattr(buffer, name).shape[1:]):
            raise ValueError(f"snapshot/replay/{name} has another shape than its counters say")


def _episodes(model: BaseAlgorithm) -> np.ndarray[Any, Any]:
    rows = [(e["r"], e["l"], e["t"]) for e in model.ep_info_buffer or ()]
    return np.array(rows, np.float64).reshape(-1, 3)


def _lstm(model: BaseAlgorithm) -> tuple[Any, ...]:
    """Return the recurrent states of actor and critic at the rollout's start."""
    states = getattr(model, "_last_lstm_states", None)
    return () if states is None else (states.pi, states.vf)


def _layers(env: VecEnv) -> Iterator[VecEnv]:
    """Yield the wrappers with a state."""
    while hasattr(env, "venv"):
        if isinstance(env, (*OWN, *ARRAYS)):
            yield env
        env = env.venv


def _layer(layer: VecEnv) -> dict[str, Any]:
    if isinstance(layer, OWN):
        return layer.snapshot()
    made: dict[str, Any] = {n: np.array(getattr(layer, n)) for n in ARRAYS[type(layer)]}
    for name, moments in _moments(layer):
        made[name] = [np.array(moments.mean), np.array(moments.var), moments.count]
    if isinstance(layer, VecMonitor):
        made["count"] = layer.episode_count
    return made


def _restore_layer(layer: VecEnv, saved: dict[str, Any]) -> None:
    if isinstance(layer, OWN):
        layer.restore(saved)
        return
    for name in ARRAYS[type(layer)]:
        setattr(layer, name, saved[name].numpy().copy())
    for name, moments in _moments(layer):
        mean, var, moments.count = saved[name]
        moments.mean, moments.var = mean.numpy().copy(), var.numpy().copy()
    if isinstance(layer, VecMonitor):
        layer.episode_count = saved["count"]


def _moments(layer: VecEnv) -> Iterator[tuple[str, Any]]:
    """Yield the running moments of a normaliser."""
    if isinstance(layer, VecNormalize):
        yield "ret_rms", layer.ret_rms
        if layer.norm_obs:
            yield "obs_rms", layer.obs_rms


def _replay(model: BaseAlgorithm) -> dict[str, Any] | None:
    """Return the filled part of the replay buffer."""
    if not isinstance(model, OffPolicyAlgorithm):
        return None
    buffer = model.replay_buffer
    assert buffer is not None
    filled = buffer.buffer_size if buffer.full else buffer.pos
    made: dict[str, Any] = {name: getattr(buffer, name)[:filled] for name in BUFFER}
    made["pos"], made["full"] = buffer.pos, buffer.full
    return made


def _restore_replay(model: BaseAlgorithm, saved: dict[str, Any] | None) -> None:
    if saved is None:
        return
    assert isinstance(model, OffPolicyAlgorithm)
    buffer = model.replay_buffer
    assert buffer is not None
    for name in BUFFER:
        getattr(buffer, name)[: len(saved[name])] = saved[name].numpy()
    buffer.pos, buffer.full = saved["pos"], saved["full"]


def _random_state(model: BaseAlgorithm) -> dict[str, Any]:
    """Return the state of every random generator of a training."""
    _, keys, position, has_gauss, cached = np.random.get_state(legacy=True)  # noqa: NPY002
    return {
        "torch": torch.get_rng_state(),
        "numpy": [np.asarray(keys, np.int64), int(position), int(has_gauss), float(cached)],
        "python": json.dumps(random.getstate()),
        "actions": json.dumps(model.action_space.np_random.bit_generator.state),
    }


def _restore_random_state(model: BaseAlgorithm, saved: dict[str, Any]) -> None:
    torch.set_rng_state(saved["torch"])
    keys, position, has_gauss, cached = saved["numpy"]
    if not 0 <= position <= len(keys):  # numpy does not check it
        raise ValueError(f"the random generator is at {position} of {len(keys)} words")
    state = ("MT19937", keys.numpy().astype(np.uint32), position, has_gauss, cached)
    np.random.set_state(state)  # noqa: NPY002
    version, words, gauss = json.loads(saved["python"])
    random.setstate((version, tuple(words), gauss))
    model.action_space.np_random.bit_generator.state = json.loads(saved["actions"])
