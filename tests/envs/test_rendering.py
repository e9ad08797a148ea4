"""Pictures: of the right size, of the right thing, and without any effect on the simulation."""

from __future__ import annotations

import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from tests.envs.cases import IDS, actions_for

pytest.importorskip("pygame")
EVERY = pytest.mark.parametrize("name", IDS)


@EVERY
def test_a_picture_shows_the_state(name: str) -> None:
    env = gym.make(name, render_mode="rgb_array", load=2.55)
    env.reset(seed=0)
    first = env.render()
    assert first.shape == (600, 800, 3)
    assert first.dtype == np.uint8
    assert np.array_equal(first, env.render())  # looking changes nothing
    for _ in range(60):
        env.step(env.action_space.high)
    later = env.render()
    assert np.mean(first != later) > 0.01
    left = np.any(first[:, :280] != later[:, :280], axis=2)
    assert left.sum() > 2000  # the muscle itself has moved
    env.close()
    env.close()


@EVERY
def test_drawing_leaves_every_bit_alone(name: str) -> None:
    plain, drawn = gym.make(name), gym.make(name, render_mode="rgb_array")
    plain.reset(seed=3)
    drawn.reset(seed=3)
    for action in actions_for(plain.action_space, 40):
        a, b = plain.step(action), drawn.step(action)
        drawn.render()
        assert np.array_equal(a[0], b[0])
        assert a[1:4] == b[1:4]
        assert dict(a[4]) == dict(b[4])
    drawn.close()


@EVERY
def test_the_window(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gym.make(name, render_mode="human")
    env.reset(seed=0)
    for action in actions_for(env.action_space, 12):
        env.step(action)
    assert env.render() is None
    env.close()


@EVERY
def test_the_checker_with_rendering(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gym.make(name, render_mode="rgb_array").unwrapped)


@EVERY
def test_rendering_without_a_mode_warns_and_before_the_reset_says_so(name: str) -> None:
    env = gym.make(name).unwrapped
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.render() is None
    env = gym.make(name, render_mode="rgb_array").unwrapped
    with pytest.raises(gym.error.ResetNeeded):
        env.render()
