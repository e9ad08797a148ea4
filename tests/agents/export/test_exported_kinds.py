"""Exported policies of every kind: recurrent, with history, with controller."""

import dataclasses
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from short_runs import ID, KINDS, kind, tiny
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from agents.export.export import facts, layer, policy_bytes
from agents.policies.policy import OnnxPolicy
from agents.policies.residual import with_controller
from agents.settings import presets as configs
from agents.settings.schema import SettingsError
from agents.training import evaluation
from agents.training.building import make_env, signals_of
from agents.vec_envs.residual import ResidualVecEnv, parts_of
from baselines.core.catalogue import make_controller

Run = Callable[[str], tuple[Any, Path]]
REMEMBERS = (
    *("recurrent", "plain_recurrent", "history", "residual_sac", "residual_recurrent"),
    *("strided", "privileged_recurrent", "residual_in_proportion"),
)
CORRECTS = ("residual", "residual_in_proportion", "residual_sac", "residual_recurrent")
ROOT = Path(__file__).resolve().parents[3]


def seen_and_done(name: str, model: Any, steps: int) -> Iterator[tuple[Any, Any, Any, VecEnv]]:
    """Yield raw observations, applied actions and ends while torch acts in the training's env."""
    env = make_env(kind(name))
    trained = model.get_vec_normalize_env()
    if isinstance(env, VecNormalize) and env.norm_obs:
        env.obs_rms, env.training = trained.obs_rms, False
    base, record = env.unwrapped, {}
    send, receive, begin = base.step_async, base.step_wait, base.reset

    def step_async(actions: Any) -> None:
        record["action"] = np.array(actions)
        send(actions)

    def step_wait() -> Any:
        made = receive()
        record["after"], record["done"] = made[0], made[2]
        return made

    def reset() -> Any:
        record["after"] = begin()
        return record["after"]

    base.step_async, base.step_wait, base.reset = step_async, step_wait, reset
    env.seed(77)
    observation, state, done = env.reset(), None, np.ones(env.num_envs, bool)
    for _ in range(steps):
        raw, starts = record["after"], done
        action, state = model.predict(observation, state, starts, deterministic=True)
        observation, _, done, _ = env.step(action)
        yield raw, record["action"], starts, env


@pytest.mark.parametrize("name", KINDS)
def test_exported_actions_equal_those_of_torch_over_whole_episodes(name, short_run):
    model, folder = short_run(name)
    file = OnnxPolicy.load(folder / "policy.onnx")
    policies: list[Any] = []
    states: list[Any] = []
    largest, moved = 0.0, []
    for raw, applied, starts, env in seen_and_done(name, model, 70):
        parts = parts_of(env)
        if not policies:
            policies = [with_controller(file, plant) for _, plant in parts]
            states = [None] * len(parts)
        for i, (rows, _) in enumerate(parts):
            action, states[i] = policies[i].predict(raw[rows], states[i], starts[rows])
            largest = max(largest, float(np.abs(action - applied[rows]).max()))
            moved.append(np.ptp(action))
    assert largest <= 2e-6
    assert max(moved) > 1e-3


@pytest.mark.parametrize("name", REMEMBERS)
def test_state_is_explicit_and_reset_at_episode_start(name, short_run):
    file = OnnxPolicy.load(short_run(name)[1] / "policy.onnx")
    given = np.zeros((4, 1), np.float32) if file.corrects else None
    seen = np.random.default_rng(2).uniform(-1, 1, (6, 4, len(file.signals))).astype(np.float32)
    state = None
    for observation in seen[:5]:
        _, state = file.answer(observation, state, None, given)
    assert state.shape == (4, file.memory)
    starts = np.array([True, False, False, True])
    mixed, _ = file.answer(seen[5], state, starts, given)
    fresh, _ = file.answer(seen[5], None, None, given)
    going, _ = file.answer(seen[5], state, None, given)
    assert np.array_equal(mixed[starts], fresh[starts])
    assert np.array_equal(mixed[~starts], going[~starts])
    assert not np.array_equal(fresh, going)
    with pytest.raises(ValueError, match=rf"expected \(4, {file.memory}\)"):
        file.answer(seen[5], state[:3], None, given)


@pytest.mark.parametrize("name", KINDS)
def test_row_with_its_state_is_independent_of_its_batch(name, short_run):
    file = OnnxPolicy.load(short_run(name)[1] / "policy.onnx")
    assert bool(file.memory) == (name in REMEMBERS)
    rng = np.random.default_rng(4)

    def drawn(width: int) -> Any:
        return rng.uniform(-1, 1, (65, width)).astype(np.float32) if width else None

    given = [drawn(len(file.signals)), drawn(file.memory), None, drawn(int(bool(file.corrects)))]
    whole = file.answer(*given)
    for size in (1, 2, 3, 64):
        for at in range(0, 65, size):
            rows = slice(at, at + size)
            part = file.answer(*(None if values is None else values[rows] for values in given))
            for mine, all_of_them in zip(part, whole, strict=True):
                assert all_of_them is None or np.array_equal(mine, all_of_them[rows])


# --- residuals --------------------------------------------------------------------------------


def test_untrained_residual_equals_its_controller():
    from agents.training.building import make_model

    config = kind("residual")
    env = make_env(config)
    model = make_model(config, 0, env)
    card = facts(model)
    plant = parts_of(env)[0][1]
    made = with_controller(OnnxPolicy(policy_bytes(model, card), card), plant)
    alone = make_controller("inverse_pid", plant, *signals_of(env))
    single = gym.make(ID, **config.env_kwargs)
    observation, _ = single.reset(seed=900_001)
    state = inner = None
    for step in range(25):
        action, state = made.predict(observation, state, step == 0)
        desired, inner = alone.predict(observation, inner, step == 0)
        assert np.array_equal(action, desired)
        observation, *_ = single.step(action)


@pytest.mark.parametrize("name", CORRECTS)
def test_residual_changes_the_action_by_its_scale_at_most(name, short_run):
    file = OnnxPolicy.load(short_run(name)[1] / "policy.onnx")
    scale = file.card["baseline"]["scale"]
    rng = np.random.default_rng(3)
    seen = 50.0 * rng.normal(size=(200, len(file.signals))).astype(np.float32)
    given = rng.uniform(-1, 1, (200, 1)).astype(np.float32)
    action, _ = file.answer(seen, None, None, given)
    change = np.abs(action - given)
    assert change.max() <= scale * (1 + 1e-5)
    assert np.abs(action).max() <= 1.0
    assert change.max() > 0.0


def test_a_residual_does_not_act_without_its_controller(short_run):
    file = OnnxPolicy.load(short_run("residual")[1] / "policy.onnx")
    with pytest.raises(ValueError, match="corrects the controller 'inverse_pid'"):
        file.predict(np.zeros(len(file.signals), np.float32))


def test_a_residual_needs_a_known_controller_and_the_plain_range():
    with pytest.raises(SettingsError, match="did you mean 'inverse_pid'"):
        make_env(tiny(residual={"controller": "inverse_pd"}, network={"hidden": [4]}))
    physical = {"residual": {"controller": "inverse"}, "env_kwargs": {"normalize": False}}
    with pytest.raises(SettingsError, match="from -1 to 1"):
        make_env(tiny(network={"hidden": [4]}, **physical))


def test_terminal_observation_includes_the_controllers_action():
    """The bootstrap value of a truncated episode needs the controller's action."""
    config = dataclasses.replace(
        kind("residual"), plants=configs.from_mapping({"env": ID}).plants, num_envs=3
    )
    env = make_env(configs.from_mapping({**config.as_dict(), "normalize": {"reward": False}}))
    controller = make_controller("inverse_pid", parts_of(env)[0][1], *signals_of(env))
    env.seed(5)
    observation = env.reset()
    state, starts = None, np.ones(3, bool)
    for _ in range(31):
        given, state = controller.predict(observation[:, :-1], state, starts)
        assert np.array_equal(given, observation[:, -1:])
        observation, _, done, infos = env.step(np.zeros((3, 1), np.float32))
        if done.any():
            break
        starts = done
    last = np.array([info["terminal_observation"] for info in infos])
    desired, _ = controller.predict(last[:, :-1], state, np.zeros(3, bool))
    assert np.array_equal(last[:, -1:], desired)
    fresh, _ = controller.predict(observation[:, :-1], None, np.ones(3, bool))
    assert np.array_equal(observation[:, -1:], fresh)


# --- history and mixtures ---------------------------------------------------------------------


def test_history_holds_past_signals_of_the_episode():
    env = make_env(tiny(history={"frames": 3, "signals": ["contraction", "pressure"]}))
    names = list(signals_of(env)[0].names())
    columns = [names.index("contraction"), names.index("pressure")]
    env.seed(5)
    rng = np.random.default_rng(0)
    seen = [env.reset()]
    ended_at = None
    for step in range(40):
        observation, _, done, infos = env.step(rng.uniform(-1, 1, (8, 1)).astype(np.float32))
        seen.append(observation)
        if done[0]:
            ended_at = step + 1
            break
    assert ended_at
    width = len(names)
    assert np.array_equal(seen[0][:, width:], np.tile(seen[0][:, columns], 3))
    for back in (1, 2, 3):
        part = slice(width + 2 * (back - 1), width + 2 * back)
        assert np.array_equal(seen[7][:, part], seen[7 - back][:, columns])
        last = infos[0]["terminal_observation"]
        assert np.array_equal(last[part], seen[ended_at - back][0, columns])
    assert np.array_equal(seen[-1][0, width:], np.tile(seen[-1][0, columns], 3))


def test_history_with_a_stride_holds_every_third_period():
    env = make_env(kind("strided", normalize={"reward": False}))
    names = list(signals_of(env)[0].names())
    columns = [names.index("contraction"), names.index("pressure")]
    env.seed(5)
    rng = np.random.default_rng(0)
    seen = [env.reset()]
    for _ in range(20):
        seen.append(env.step(rng.uniform(-1, 1, (8, 1)).astype(np.float32))[0])
    width = len(names)
    assert seen[0].shape[1] == width + 4
    for now in (1, 7, 20):
        for k, back in enumerate((3, 6)):
            part = seen[now][:, width + 2 * k : width + 2 * (k + 1)]
            assert np.array_equal(part, seen[max(now - back, 0)][:, columns])


def test_controllers_of_rows_with_a_wrong_model_know_another_plant():
    entry = {"model": {"hysteresis": "maxwell_slip"}}
    look = {"episodes": 4, "settle_seconds": 0.1}
    plants = {"hysteresis": ["preisach"]}
    config = kind("residual", plants=plants, mix=[{}, entry], evaluation=look)
    env = make_env(config)
    wrapper: Any = layer(env, ResidualVecEnv)
    laws = [
        gym.make(ID, hysteresis=law).unwrapped.plant.digest()
        for law in ("preisach", "maxwell_slip")
    ]
    assert [plant.digest() for plant in wrapper.plants] == laws
    assert [rows for rows, _ in wrapper.controllers] == [slice(0, 4), slice(4, 8)]
    assert [plant.digest() for _, plant in env.unwrapped.parts()] == laws[:1]
    for i, kwargs in enumerate(config.models()):
        assert kwargs.get("hysteresis") == (None, "maxwell_slip")[i]
        assert "model" not in config.kinds()[i]
    right, wrong = evaluation.evaluate("inverse", config).kinds
    assert (
        right
        == evaluation.evaluate("inverse", kind("residual", plants=plants, evaluation=look), 2).rms
    )
    assert wrong != right


def test_kinds_of_plants_share_the_rows():
    env = make_env(kind("residual", normalize={"reward": False}))
    base = env.unwrapped
    assert len(base.batches) == 2
    assert [plant.digest() for _, plant in base.parts()] == [
        gym.make(ID, hysteresis=law).unwrapped.plant.digest()
        for law in ("maxwell_slip", "preisach")
    ]
    env.seed(11)
    observation = env.reset()
    for row, law in ((0, "maxwell_slip"), (3, "maxwell_slip"), (4, "preisach"), (7, "preisach")):
        single = gym.make(ID, hysteresis=law, randomize=True, **kind("residual").env_kwargs)
        alone, _ = single.reset(seed=11 + row)
        assert np.array_equal(alone, observation[row, :-1])


def test_rows_on_equal_plants_have_one_controller():
    config = kind("residual", share={"reference": ["sines", "steps"]}, env_kwargs={})
    env = make_env(config)
    base = env.unwrapped
    assert [batch.num_envs for batch in base.batches] == [2, 2, 2, 2]
    assert [rows for rows, _ in base.parts()] == [slice(0, 4), slice(4, 8)]


def test_evaluation_counts_the_settled_instants_of_tuning_seeds(short_run):
    config = tiny(evaluation={"episodes": 3, "settle_seconds": 0.1})
    file = OnnxPolicy.load(short_run("ppo")[1] / "policy.onnx")
    score = evaluation.evaluate(file, config)
    squares, returns, travel = [], [], []
    for seed in (900_000, 900_001, 900_002):
        env = gym.make(ID, **config.env_kwargs)
        observation, _ = env.reset(seed=seed)
        total, over = 0.0, False
        while not over:
            observation, reward, ended, out, info = env.step(file.predict(observation)[0])
            total, over = total + reward, ended or out
            if info["time"] > 0.1 and not over:
                squares.append((info["output"] - info["reference"]) ** 2)
                travel.append(info["effort/pressure_travel"])
        returns.append(total)
    assert score.rms == pytest.approx(np.sqrt(np.mean(squares)), rel=1e-12)
    assert score.travel == pytest.approx(np.mean(travel), rel=1e-12)
    assert score.mean_return == pytest.approx(np.mean(returns), rel=1e-12)
    assert score.failures == 0


def test_policies_act_without_torch(short_run):
    """The file of a residual with memory, in a process in which torch cannot be imported."""
    place = short_run("residual_recurrent")[1] / "policy.onnx"
    code = f"""
import sys
class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("torch", "stable_baselines3", "sb3_contrib"):
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Missing())
import gymnasium as gym, pam_envs
from agents.policies.policy import OnnxPolicy
from agents.policies.residual import with_controller
import agents.policies.catalogue
env = gym.make({ID!r})
policy = with_controller(OnnxPolicy.load({str(place)!r}), env.unwrapped.plant)
observation, _ = env.reset(seed=900_000)
state = None
for step in range(3):
    action, state = policy.predict(observation, state, step == 0)
    observation, *_ = env.step(action)
print(action)
"""
    made = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert made.returncode == 0, made.stderr
    assert made.stdout.startswith("[")


def test_kinds_of_rows_are_evaluated_on_the_same_seeds(short_run):
    file = OnnxPolicy.load(short_run("ppo")[1] / "policy.onnx")
    both = tiny(
        plants={"hysteresis": ["maxwell_slip", "preisach"]},
        evaluation={"episodes": 5, "settle_seconds": 0.1},
    )
    made = evaluation.evaluate(file, both)
    for law, rms in zip(both.plants.hysteresis, made.kinds, strict=True):
        look = {"episodes": 2, "settle_seconds": 0.1}
        alone = tiny(env_kwargs={**both.env_kwargs, "hysteresis": law}, evaluation=look)
        assert evaluation.evaluate(file, alone).rms == rms
