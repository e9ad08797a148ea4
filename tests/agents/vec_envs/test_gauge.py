"""Correction in proportion to the recent error."""

import math
from typing import Any

import numpy as np
import pytest
from short_runs import kind

from agents.export.export import layer as wrapper
from agents.settings.parts import Gauge
from agents.settings.schema import SettingsError
from agents.training.building import make_env
from agents.vec_envs.gauge import error_mean
from agents.vec_envs.residual import ResidualVecEnv

PERIOD = 0.01


def followed(gauge: Gauge, errors: np.ndarray) -> np.ndarray:
    """Return the factor after each of some errors, shape (steps, n_errors), of one row."""
    identity = tuple(tuple(float(i == j) for j in range(errors.shape[1])) for i in range(2))
    mean = error_mean(gauge, identity[: errors.shape[1]], PERIOD)
    state = np.zeros((1, mean.width), np.float32)
    factors = []
    for error in errors.astype(np.float32):
        state = mean.after(state, error[None])
        factors.append(mean.factor(state)[0, 0])
    return np.array(factors)


def test_lasting_error_gives_its_share_of_the_full_correction():
    gauge = Gauge(errors=("a - b",), full=0.05, least=0.0)
    factors = followed(gauge, np.full((1000, 1), -0.02))
    assert factors[-1] == pytest.approx(0.4, rel=1e-3)
    first = round(gauge.mean_seconds / PERIOD)
    assert factors[first] < 0.4 * (1.0 - math.exp(-1.0))  # smoothed before it is averaged


def test_factor_stays_between_its_bounds():
    gauge = Gauge(errors=("a - b",), full=0.05, least=0.1)
    errors = np.concatenate([np.zeros((50, 1)), np.full((500, 1), 1.0)])
    factors = followed(gauge, errors)
    assert np.all(factors[:50] == np.float32(0.1))
    assert factors[-1] == 1.0


def test_noise_counts_less_than_an_error_of_its_size():
    noise = np.random.default_rng(0).normal(0.0, 0.02, (2000, 1))
    gauge = Gauge(errors=("a - b",), full=0.05, least=0.0)
    lasting = followed(gauge, np.full((2000, 1), np.abs(noise).mean()))
    assert followed(gauge, noise)[-500:].mean() < 0.35 * lasting[-1]


def test_several_errors_count_by_their_mean():
    gauge = Gauge(errors=("a - b", "c - d"), full=0.1, least=0.0, smooth_seconds=0.0)
    errors = np.tile([0.06, -0.02], (2000, 1))
    assert followed(gauge, errors)[-1] == pytest.approx(0.4, rel=1e-3)


def test_environment_scales_the_correction_and_starts_each_episode_at_the_least():
    env = make_env(kind("residual_in_proportion"))
    layer: Any = wrapper(env, ResidualVecEnv)
    sent: list[Any] = []
    send = layer.venv.step_async
    layer.venv.step_async = lambda actions: (sent.append(np.array(actions)), send(actions))[1]
    env.seed(5)
    env.reset()
    ended = False
    for _ in range(70):
        given, errors = layer.given.copy(), layer.errors.copy()
        _, _, done, _ = env.step(np.ones((env.num_envs, 1), np.float32))
        gauge = layer.gauge
        expected = given + layer.scale * gauge.factor(errors)
        assert sent[-1] == pytest.approx(np.clip(expected, -1.0, 1.0), abs=1e-6)
        if done.any():
            ended = True
            first = gauge.after(np.zeros_like(layer.errors), layer.seen)
            assert np.array_equal(layer.errors[done], first[done])
    assert ended
    assert np.ptp(layer.gauge.factor(layer.errors)) > 0.0


@pytest.mark.parametrize("text", ["reference", "reference - contractoin"])
def test_unknown_errors_are_refused(text):
    residual = {"controller": "pid", "gauge": {"errors": [text]}}
    with pytest.raises(SettingsError, match=r"residual\.gauge\.errors"):
        make_env(kind("residual_in_proportion", residual=residual))
