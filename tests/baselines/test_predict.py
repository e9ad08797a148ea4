"""Every controller of the catalogue keeps the contract of a policy predictor."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from baselines.core.catalogue import PUBLISHED, make_controller
from tests.baselines.conftest import ID, built, check_form, make_env, observations_of

CONTROLLERS = {name: entry for name, entry in PUBLISHED.items() if ID in entry.envs}
SOME = ("random", "table", "pid", "inverse", "inverse_pid")


def _arrays(state: Any) -> list[np.ndarray]:
    if state is None:
        return []
    return [a for part in state for a in (_arrays(part) if isinstance(part, tuple) else [part])]


@pytest.fixture(scope="module", params=["maxwell_slip", "preisach", "none"])
def env(request: pytest.FixtureRequest) -> Any:
    return make_env(hysteresis=request.param, load=None, reference="sines")


@pytest.mark.parametrize("normalize", [True, False])
@pytest.mark.parametrize("name", CONTROLLERS)
def test_action_is_in_the_space_and_has_the_form_of_the_observation(name, normalize):
    env = make_env(normalize=normalize, load=None)
    check_form(built(name, env), env)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_extreme_observations_give_actions_in_the_space(name):
    env = make_env()
    controller = built(name, env)
    for value in (-1.0, 1.0):
        observation, state = np.full(env.observation_space.shape, value, np.float32), None
        for _ in range(5):
            action, state = controller.predict(observation, state)
            assert action in env.action_space


@pytest.mark.parametrize("name", [n for n in CONTROLLERS if n != "random"])
def test_a_row_of_a_batch_is_what_it_is_alone(name, env):
    controller = built(name, env)
    observations = observations_of(env)
    loads = env.signals.decode(observations[0], "load")
    assert len(np.unique(loads.round(3))) > 1
    state, alone = None, [None] * observations.shape[1]
    start = np.ones(observations.shape[1], bool)
    for k, batch in enumerate(observations):
        start[:] = k == 0 or (k == 20) & (np.arange(len(start)) == 2)
        actions, state = controller.predict(batch, state, start)
        for i, observation in enumerate(batch):
            action, alone[i] = controller.predict(observation, alone[i], start[i])
            np.testing.assert_array_equal(action, actions[i])
    for mine, whole in zip(zip(*map(_arrays, alone), strict=True), _arrays(state), strict=True):
        np.testing.assert_allclose(np.concatenate(mine), whole, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", SOME)
def test_episode_start_forgets_and_only_those_rows(name, env):
    controller = built(name, env)
    observations = observations_of(env)
    state = None
    for batch in observations[:20]:
        _, state = controller.predict(batch, state)
    start = np.array([False, True, False, False])
    actions, _ = controller.predict(observations[20], state, start)
    kept, _ = controller.predict(observations[20], state)
    fresh, _ = controller.predict(observations[20], None)
    np.testing.assert_array_equal(actions[1], fresh[1])
    np.testing.assert_array_equal(actions[~start], kept[~start])


@pytest.mark.parametrize("name", SOME)
def test_the_callers_state_is_left_alone(name, env):
    controller = built(name, env)
    observations = observations_of(env, steps=12)
    state = None
    for batch in observations[:10]:
        _, state = controller.predict(batch, state)
    before = copy.deepcopy(_arrays(state))
    first, _ = controller.predict(observations[10], state)
    again, _ = controller.predict(observations[10], state, np.array([1, 0, 0, 0], bool))
    for old, now in zip(before, _arrays(state), strict=True):
        np.testing.assert_array_equal(old, now)
    np.testing.assert_array_equal(first[1:], again[1:])


def test_random_is_a_function_of_seed_row_and_draw():
    env = make_env()
    batch = np.array([env.reset(seed=s)[0] for s in range(200)])
    a, state = built("random", env).predict(batch)
    b, _ = built("random", env).predict(batch)
    other = make_controller("random", env.plant, env.signals, env.action_signals, seed=1)
    np.testing.assert_array_equal(a, b)
    assert np.all(other.predict(batch)[0] != a)
    assert len(np.unique(a)) == len(a)
    later, _ = built("random", env).predict(batch, state)
    assert np.all(later != a)
    assert abs(a.mean()) < 0.12 and abs(a.std() - 3**-0.5) < 0.06  # evenly over [-1, 1]


def test_unknown_name_lists_the_known_ones():
    env = make_env()
    with pytest.raises(ValueError, match="inverse_pid"):
        built("pdi", env)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_entry_is_complete_and_true_about_the_preview(name):
    entry = CONTROLLERS[name]
    assert entry.summary and entry.envs and entry.kind == "classical"
    assert entry.knowledge in ("nothing", "tables", "nominal model", "true model")
    env = make_env(reference="sines")
    controller = built(name, env)
    observations = observations_of(env, steps=40, rows=2)[:, 1]
    hidden = observations.copy()
    hidden[:, 5:] = hidden[:, [4]]
    answers = []
    for sequence in (observations, hidden):
        state, actions = None, []
        for observation in sequence:
            action, state = controller.predict(observation, state)
            actions.append(action)
        answers.append(np.array(actions))
    assert entry.preview == (not np.array_equal(*answers))


@pytest.mark.parametrize("preview", [0, 1, 20])
@pytest.mark.parametrize("name", CONTROLLERS)
def test_runs_with_any_preview(name, preview):
    env = make_env(preview=preview)
    action, _ = built(name, env).predict(env.reset(seed=1)[0])
    assert action in env.action_space


@pytest.mark.parametrize("name", CONTROLLERS)
def test_stable_baselines_evaluates_it_as_it_is(name):
    pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.env_util import make_vec_env
    from stable_baselines3.common.evaluation import evaluate_policy

    def made() -> Any:
        return make_env(episode_seconds=0.5, load=None)

    envs = make_vec_env(made, n_envs=2, seed=1)
    mean, _ = evaluate_policy(built(name, made()), envs, n_eval_episodes=4)
    assert -1000.0 < mean < 0.0
