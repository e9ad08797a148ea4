"""The lazily filled info behaves like a dict."""

import copy
import json
import pickle
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import pam_envs  # noqa: F401
from pam_envs.envs.core.info import Info

PLAIN = {"a": 1.0, "b": 2.0}


def fresh() -> Info:
    return Info(("a", "b"), 1.0, np.array([1.0, 2.0]).tobytes())


def keywords(**given: float) -> dict[str, float]:
    return given


USES: dict[str, Callable[[Any], Any]] = {
    "item": lambda d: d["a"],
    "get": lambda d: d.get("b"),
    "in": lambda d: ("a" in d, "c" in d),
    "len": len,
    "bool": bool,
    "list": list,
    "reversed": lambda d: list(reversed(d)),
    "keys": lambda d: list(d.keys()),
    "items": lambda d: list(d.items()),
    "values": lambda d: list(d.values()),
    "dict": dict,
    "unpacked": lambda d: {**d},
    "call": lambda d: keywords(**d),
    "json": json.dumps,
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "pickle": lambda d: pickle.loads(pickle.dumps(d)),
    "repr": repr,
    "equal": lambda d: (d == PLAIN, d != PLAIN),
    "equal from the left": lambda d: PLAIN == d,  # noqa: SIM300
    "or": lambda d: d | {"c": 3.0},
    "ror": lambda d: {"c": 3.0} | d,
    "update": lambda d: {"c": 3.0, **d},
    "merge": lambda d: [e := {"c": 3.0}, e.update(d), e][2],
    "pop": lambda d: (d.pop("a"), dict(d)),
    "setdefault": lambda d: (d.setdefault("a", 5.0), d.setdefault("z", 5.0), dict(d)),
    "set": lambda d: (d.__setitem__("z", 0.0), dict(d))[1],
    "delete": lambda d: (d.__delitem__("a"), dict(d))[1],
    "clear": lambda d: (d.clear(), dict(d))[1],
    "fromkeys": dict.fromkeys,
    "sorted": sorted,
    "max": max,
}


@pytest.mark.parametrize("use", USES)
def test_untouched_info_behaves_as_a_dict(use: str) -> None:
    assert USES[use](fresh()) == USES[use](dict(PLAIN))


def test_two_untouched_infos_compare() -> None:
    assert fresh() == fresh()
    assert isinstance(fresh(), dict)


def test_wrappers_can_write_into_info() -> None:
    env = gym.wrappers.RecordEpisodeStatistics(
        gym.make("PAM/MusclePositioning-v0", episode_seconds=0.1)
    )
    env.reset(seed=0)
    over = False
    while not over:
        *_, truncated, info = env.step(env.action_space.sample())
        over = truncated
    assert info["episode"]["l"] == 10
    assert "output" in info
    envs = gym.vector.SyncVectorEnv([lambda: gym.make("PAM/MusclePositioning-v0")] * 2)
    envs.reset(seed=0)
    assert envs.step(envs.action_space.sample())[4]["output"].shape == (2,)
