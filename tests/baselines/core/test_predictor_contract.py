"""Contract of a policy predictor, over every controller and environment of the catalogue."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from baselines.core.catalogue import PUBLISHED
from baselines.core.checks import check_controller
from baselines.core.entry import ELBOW, KNEE, POSITIONING
from tests.baselines.conftest import ID, built, make_env, observations_of

PAIRS = [(name, env) for name, entry in PUBLISHED.items() for env in entry.envs]
VARIANTS: dict[str, list[dict[str, Any]]] = {
    POSITIONING[0]: [
        {"hysteresis": hysteresis, "load": None, "reference": "sines"}
        for hysteresis in ("maxwell_slip", "preisach", "none")
    ],
    ELBOW[0]: [
        {"valves": "proportional", "hysteresis": "preisach"},
        {"valves": "on_off", "hysteresis": "preisach"},
    ],
}
CASES = [
    (name, env, {**variant, "normalize": normalize})
    for name, env in PAIRS
    for k, variant in enumerate(VARIANTS.get(env, [{}]))
    for normalize in ((True, False) if k == 0 and env in (*POSITIONING, *KNEE, *ELBOW) else (True,))
]


@cache
def observed(env: str, variant: tuple[tuple[str, Any], ...], steps: int = 16) -> Any:
    made = make_env(env, **dict(variant))
    return made, observations_of(made, steps=steps, rows=3)


@pytest.mark.parametrize(("name", "env", "variant"), CASES)
def test_controller_satisfies_the_predictor_contract(name, env, variant):
    made, observations = observed(env, tuple(variant.items()))
    if variant.get("load", 0.0) is None:
        assert len(np.unique(made.signals.decode(observations[0], "load").round(3))) > 1
    check_controller(built(name, made), observations, made.action_signals)


@pytest.mark.parametrize(("name", "env"), PAIRS)
def test_extreme_observations_give_actions_in_the_space(name, env):
    made, _ = observed(env, ())
    controller = built(name, made)
    for value in (-1.0, 1.0):
        observation, state = np.full(made.observation_space.shape, value, np.float32), None
        for _ in range(5):
            action, state = controller.predict(observation, state)
            assert action in made.action_space


@pytest.mark.parametrize(("name", "env"), PAIRS)
def test_entry_is_complete_and_its_preview_flag_correct(name, env):
    entry = PUBLISHED[name]
    assert entry.summary and entry.kind == "classical"
    assert entry.knowledge in ("nothing", "tables", "nominal model", "true model")
    made, _ = observed(env, ())
    shape = (12, 3, len(made.signals))
    observations = np.random.default_rng(3).uniform(-0.5, 0.5, shape).astype("f4")
    hidden, names = observations.copy(), list(made.signals.names())
    for k, name_of_signal in enumerate(names):
        base, _, sample = name_of_signal.rpartition("_")
        if base in names and sample.isdigit():
            hidden[..., k] = hidden[..., names.index(base)]
    answers = []
    for sequence in (observations, hidden):
        state, actions, controller = None, [], built(name, made)
        for observation in sequence:
            action, state = controller.predict(observation, state)
            actions.append(action)
        answers.append(np.array(actions))
    assert entry.preview == (not np.array_equal(*answers))


@pytest.mark.parametrize("name", ["random", "elbow_random", "joint_random"])
def test_random_is_a_function_of_seed_episode_and_draw(name):
    env = make_env(PUBLISHED[name].envs[0])
    batch = np.array([env.reset(seed=s)[0] for s in range(200)])
    a, state = built(name, env).predict(batch)
    b, _ = built(name, env).predict(batch)
    np.testing.assert_array_equal(a, b)
    assert np.all(built(name, env, seed=1).predict(batch)[0] != a)
    assert len(np.unique(a)) == a.size
    np.testing.assert_array_equal(built(name, env).predict(batch[::-1])[0], a[::-1])
    later, _ = built(name, env).predict(batch, state)
    assert np.all(later != a)
    assert abs(a.mean()) < 0.12 and abs(a.std() - 3**-0.5) < 0.06  # uniform over [-1, 1]


@pytest.mark.parametrize("preview", [0, 1, 20])
@pytest.mark.parametrize("name", [name for name, env in PAIRS if env == ID])
def test_controller_runs_with_any_number_of_preview_samples(name, preview):
    env = make_env(preview=preview)
    action, _ = built(name, env).predict(env.reset(seed=1)[0])
    assert action in env.action_space


@pytest.mark.parametrize("name", [name for name, env in PAIRS if env == ID])
def test_stable_baselines_evaluates_it_unchanged(name):
    pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.env_util import make_vec_env
    from stable_baselines3.common.evaluation import evaluate_policy

    def made() -> Any:
        return make_env(episode_seconds=0.5, load=None)

    envs = make_vec_env(made, n_envs=2, seed=1)
    mean, _ = evaluate_policy(built(name, made()), envs, n_eval_episodes=4)
    assert -1000.0 < mean < 0.0
