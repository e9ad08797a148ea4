"""Every registered environment, and keyword arguments that reach its branches.

The folder of a family holds its own in ``variants.py``, by id: ``OWN`` runs always, ``PLAIN`` only
uncompiled (each hysteresis, mounting and regulator has machine code of its own, which takes half a
minute to make), ``LIVELY`` makes every signal of the observation vary over episodes.
"""

import importlib
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import pam_envs  # noqa: F401 (registers)
from pam_envs.kernels.build import COMPILED

IDS = sorted(name for name in gym.registry if name.startswith("PAM/"))

COMMON: dict[str, dict[str, Any]] = {
    "default": {},
    "random": {"randomize": True, "preview": 2, "preview_stride": 7},
    "flow": {"air": "flow"},
}
"""Arguments that every environment takes."""


def _declared(name: str) -> dict[str, Any]:
    """Return a mapping of all families' ``variants.py``, by id."""
    found: dict[str, Any] = {}
    for path in sorted(Path(__file__).parent.glob("*/variants.py")):
        module = importlib.import_module(f"{__package__}.{path.parent.name}.variants")
        found |= getattr(module, name, {})
    return found


OWN, PLAIN, LIVELY = _declared("OWN"), _declared("PLAIN"), _declared("LIVELY")
ALWAYS = {name: {**COMMON, **OWN.get(name, {})} for name in IDS}
VARIANTS = {name: {**ALWAYS[name], **({} if COMPILED else PLAIN.get(name, {}))} for name in IDS}
CASES = [(name, variant) for name in IDS for variant in VARIANTS[name]]
"""Every registered environment in every variant."""
SHARED = [(name, variant) for name in IDS for variant in ALWAYS[name]]
"""Those that run compiled and uncompiled."""


def actions_for(space: gym.spaces.Box, steps: int, seed: int = 0) -> np.ndarray:
    """Return held random actions, shape (steps, n)."""
    random = np.random.default_rng(seed)
    held = random.uniform(space.low, space.high, (-(-steps // 5), *space.shape))
    return np.repeat(held, 5, axis=0)[:steps].astype(np.float32)


def trajectory(env: gym.Env, seed: int, steps: int = 60) -> list[str]:
    """Return everything that a fixed drive of an environment gives, to the last bit."""
    observation, info = env.reset(seed=seed)
    lines = [observation.tobytes().hex(), str([v.hex() for v in info.values()])]
    for action in actions_for(env.action_space, steps, seed):
        observation, reward, terminated, truncated, info = env.step(action)
        values = [float(v).hex() for v in (reward, *info.values())]
        lines.append(f"{observation.tobytes().hex()} {values} {terminated} {truncated}")
        if terminated or truncated:
            observation, info = env.reset()
            lines.append(observation.tobytes().hex())
    return lines


def record(env: gym.Env, actions: Any, seed: int = 0) -> dict[str, np.ndarray]:
    """Return ``info`` as arrays, the reset first, and the observations as ``seen``."""
    observation, info = env.reset(seed=seed)
    infos, seen = [dict(info)], [observation]
    for action in actions:
        observation, _, ended, truncated, info = env.step(np.asarray(action, np.float32))
        infos.append(dict(info))
        seen.append(observation)
        if ended or truncated:
            break
    found = {key: np.array([row[key] for row in infos]) for key in infos[0]}
    return found | {"seen": np.array(seen)}


def check_rows(batch: Any, singles: dict[int, gym.Env], steps: int, seed: int) -> int:
    """Assert that rows of a batch are single environments bit for bit; return their restarts."""
    observations, infos = batch.reset(seed=seed)
    for i, env in singles.items():
        observation, info = env.reset(seed=seed + i)
        assert np.array_equal(observation, observations[i])
        assert {k: v[i] for k, v in infos.items()} == info
    restarts = 0
    for actions in actions_for(batch.action_space, steps, 2):
        observations, rewards, terminated, truncated, infos = batch.step(actions)
        for i, env in singles.items():
            observation, reward, ended, cut, info = env.step(actions[i])
            assert (reward, ended, cut) == (rewards[i], terminated[i], truncated[i])
            if ended or cut:
                restarts += 1
                assert np.array_equal(observation, infos["final_obs"][i])
                assert {k: infos["final_info"][k][i] for k in info} == info
                observation, info = env.reset()
            assert np.array_equal(observation, observations[i])
            assert {k: infos[k][i] for k in info} == info
    return restarts
