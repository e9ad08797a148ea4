"""Privileged observation: parameters and noise-free state for the critic."""

import numpy as np
import pytest
from short_runs import ID

from agents.vec_envs.batch import make_batch_vec_env
from agents.vec_envs.privileged import CLIP, PrivilegedVecEnv

ROWS = 3
KINDS = ({}, {"randomize": True}, {"randomize": "everyday"})
SHORT = {"episode_seconds": 0.1, "reference": "mixed"}


def made() -> PrivilegedVecEnv:
    env = PrivilegedVecEnv(make_batch_vec_env(ID, ROWS, *KINDS, **SHORT))
    env.seed(5)
    return env


def test_parameters_are_those_drawn_scaled_by_their_ranges():
    env = made()
    observation = env.reset()
    base = env.base
    drawn = {name for batch in base.batches for name in batch.unwrapped.ranges}
    assert drawn <= set(env.names)
    first = observation.shape[1] - len(env.names) - len(env.states)
    shown = observation[:, first : first + len(env.names)]
    names = list(base.batches[0].unwrapped.plant.names)
    for k, name in enumerate(env.names):
        values = base.parameters()[:, names.index(name)]
        assert env.low[k] + (shown[:, k] + 1.0) / 2.0 * env.span[k] == pytest.approx(
            values, rel=1e-4
        )
    assert np.abs(shown).max() <= 1.0 + 1e-6
    assert np.allclose(shown[:ROWS], env.nominal)
    assert np.ptp(shown[ROWS : 2 * ROWS], axis=0).max() > 0.1


def test_terminal_observation_has_the_parameters_of_its_own_episode():
    env = made()
    observation = env.reset()
    first = observation.shape[1] - len(env.names) - len(env.states)
    columns = slice(first, first + len(env.names))
    before = observation[:, columns]
    for _ in range(20):
        observation, _, done, infos = env.step(np.zeros((len(before), 1), np.float32))
        if done.all():
            break
        assert np.array_equal(observation[:, columns], before)
    last = np.array([info["terminal_observation"] for info in infos])
    assert last.shape == observation.shape
    assert np.array_equal(last[:, columns], before)
    assert not np.array_equal(observation[ROWS:, columns], before[ROWS:])
    assert np.array_equal(observation[:ROWS, columns], before[:ROWS])


def test_state_is_normalised_and_free_of_noise():
    env = made()
    env.reset()
    shown = []
    random = np.random.default_rng(0)
    for _ in range(40):
        observation, _, _, _ = env.step(random.uniform(-1, 1, (env.num_envs, 1)).astype(np.float32))
        shown.append(observation[:, -len(env.states) :])
    values = env._values(env.base.present)
    deviation = np.sqrt(env.moments.var + 1e-8)
    expected = np.clip((values - env.moments.mean) / deviation, -CLIP, CLIP)
    assert shown[-1] == pytest.approx(expected, abs=1e-5)
    assert np.abs(np.concatenate(shown)).max() <= CLIP
    assert "state/contraction" in env.states
