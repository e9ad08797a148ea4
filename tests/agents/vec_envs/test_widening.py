"""Automatic domain randomisation: ranges widen with success and never narrow."""

from typing import Any

import numpy as np
import pytest
from short_runs import ID
from stable_baselines3.common.vec_env import VecMonitor

from agents.settings.parts import Widening
from agents.settings.schema import SettingsError
from agents.vec_envs.batch import make_batch_vec_env
from agents.vec_envs.widening import WideningVecEnv

SHORT = {"episode_seconds": 0.05, "reference": "mixed"}
MIX = ({}, {"randomize": True})
ROWS = 32


def made(ratio: float, *kinds: dict[str, Any]) -> WideningVecEnv:
    batch = make_batch_vec_env(ID, ROWS, *(kinds or MIX), **SHORT)
    env = WideningVecEnv(VecMonitor(batch), Widening(start=0.2, step=0.3, ratio=ratio, episodes=4))
    env.seed(3)
    env.reset()
    return env


def drawn(env: WideningVecEnv) -> Any:
    return env.base.batches[1].unwrapped


def advance(env: WideningVecEnv, steps: int) -> None:
    for _ in range(steps):
        env.step(np.zeros((env.num_envs, 1), np.float32))


def test_ranges_begin_around_the_nominal_plant():
    env = made(1.0)
    whole = make_batch_vec_env(ID, 1, MIX[1], **SHORT).batches[0].unwrapped
    plant = whole.plant
    for name, (low, high) in whole.ranges.items():
        nominal = plant.value(name)
        least, most = min(low, nominal), max(high, nominal)
        expected = (nominal + 0.2 * (least - nominal), nominal + 0.2 * (most - nominal))
        assert drawn(env).ranges[name] == pytest.approx(expected)
    names = list(plant.names)
    for name, (low, high) in drawn(env).ranges.items():
        values = env.base.parameters()[ROWS:, names.index(name)]
        assert values.min() >= low
        assert values.max() <= high


def test_cheap_bounds_move_outwards_up_to_the_declared_range():
    env = made(100.0)
    widths = [env.widths.copy()]
    for _ in range(12):
        advance(env, 5)
        widths.append(env.widths.copy())
    assert (np.diff(widths, axis=0) >= 0.0).all()
    assert widths[-1].max() == 1.0
    whole = make_batch_vec_env(ID, 1, MIX[1], **SHORT).batches[0].unwrapped
    plant = whole.plant
    for k, name in enumerate(env.names):
        if (env.widths[:, k] == 1.0).all():
            low, high = whole.ranges[name]
            nominal = plant.value(name)
            expected = min(low, nominal), max(high, nominal)
            assert env.ranges()[name] == pytest.approx(expected)


def test_costly_bounds_stay():
    env = made(0.1)
    advance(env, 60)
    assert env.seen.max() > 4
    assert (env.widths == 0.2).all()


def test_widening_needs_nominal_and_drawn_rows():
    with pytest.raises(SettingsError, match="nominal plants and rows with drawn ones"):
        made(1.0, {"randomize": True})


def test_ranges_beyond_those_checked_are_refused():
    env = made(1.0)
    name, (low, high) = next(iter(drawn(env).ranges.items()))
    with pytest.raises(ValueError, match=f"the range of {name} is"):
        drawn(env).ranges = {**drawn(env).ranges, name: (low, high + 1e6)}
    with pytest.raises(ValueError, match="give one for each of"):
        drawn(env).ranges = {name: (low, high)}
