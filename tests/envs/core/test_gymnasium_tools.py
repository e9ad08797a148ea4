"""Wrappers of Gymnasium, recorders and reset options on single environments and batches."""

import gc
import importlib.util
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import RecordVideo, TimeAwareObservation
from gymnasium.wrappers import vector as wrappers

import pam_envs  # noqa: F401
from pam_envs.wrappers import Cost, PlainInfo, VectorCost

ID = "PAM/MusclePositioning-v0"
ROWS, STEPS = 3, 10  # a batch, and the control periods of an episode
SHORT = {"episode_seconds": 0.1}


def batch(mode: AutoresetMode | str = AutoresetMode.NEXT_STEP, **given: Any) -> Any:
    arguments = {**SHORT, "autoreset_mode": mode, **given}
    return gym.make_vec(ID, ROWS, vectorization_mode="vector_entry_point", **arguments)


def actions(steps: int) -> np.ndarray:
    return np.random.default_rng(1).uniform(-1.0, 1.0, (steps, ROWS, 1)).astype(np.float32)


def test_next_step_mode_starts_the_same_episodes_one_step_later():
    same, later = batch(AutoresetMode.SAME_STEP), batch("NextStep")
    first, begun = same.reset(seed=5)[0], later.reset(seed=5)[0]
    np.testing.assert_array_equal(first, begun)
    for action in actions(3 * STEPS):
        observation, reward, _, truncated, infos = same.step(action)
        other, earned, _, over, told = later.step(action)
        np.testing.assert_array_equal(earned, reward)
        np.testing.assert_array_equal(over, truncated)
        if truncated.all():
            np.testing.assert_array_equal(other, np.stack(infos["final_obs"]))
            assert "final_obs" not in told
            other, earned, terminated, over, told = later.step(np.ones_like(action))
            assert not earned.any()
            assert not (terminated | over).any()
            assert (told["time"] == 0.0).all()
        np.testing.assert_array_equal(other, observation)


def test_next_step_mode_restarts_single_rows():
    env = batch(episode_seconds=1.0)
    env.reset(seed=0)
    for _ in range(STEPS):
        env.step(np.zeros((ROWS, 1), np.float32))
    env.reset(options={"reset_mask": np.array([False, True, False])})
    ends = {}
    for step in range(101):
        *_, truncated, infos = env.step(np.zeros((ROWS, 1), np.float32))
        for row in np.flatnonzero(truncated):
            ends[int(row)] = step
    assert ends == {0: 89, 2: 89, 1: 99}
    np.testing.assert_allclose(infos["time"], [0.1, 0.0, 0.1])


def test_state_of_a_batch_in_next_step_mode_includes_the_ended_rows():
    env, other = batch(), batch()
    env.reset(seed=0)
    for action in actions(STEPS):
        env.step(action)
    other.set_state(env.get_state())
    zeros = np.zeros((ROWS, 1), np.float32)
    np.testing.assert_array_equal(other.step(zeros)[0], env.step(zeros)[0])
    assert (other.step(zeros)[4]["time"] == 0.01).all()


def test_state_with_ended_rows_is_refused_where_no_row_can_have_ended():
    env, other = batch(), batch(AutoresetMode.SAME_STEP)
    env.reset(seed=0)
    for action in actions(STEPS):
        env.step(action)
    state = env.get_state()
    assert state["ended"].all()
    before = other.get_state()
    for refuses, given in (
        (other, state),
        (batch(), {**before, "ended": state["ended"]}),
        (batch(), {**state, "ended": state["ended"].astype(float)}),
        (batch(), {**state, "ended": state["ended"][:2]}),
    ):
        with pytest.raises(ValueError, match="the state's 'ended'"):
            refuses.set_state(given)
    assert all((other.get_state()[key] == value).all() for key, value in before.items())


def test_disabled_mode_refuses_steps_of_ended_rows():
    env = batch(AutoresetMode.DISABLED)
    env.reset(seed=0)
    for action in actions(STEPS):
        *_, truncated, _ = env.step(action)
    assert truncated.all()
    with pytest.raises(gym.error.ResetNeeded, match=r"rows \[0, 1, 2\] have ended"):
        env.step(action)
    env.reset(options={"reset_mask": truncated})
    assert (env.step(action)[4]["time"] == 0.01).all()


def test_unknown_autoreset_mode_is_refused():
    with pytest.raises(ValueError, match="autoreset_mode = 'Later' is not known; choose one of"):
        batch("Later")


@pytest.mark.parametrize(
    "wrap",
    [
        wrappers.NormalizeObservation,
        wrappers.FlattenObservation,
        lambda env: wrappers.TransformObservation(
            env, lambda seen: 0.5 * seen, single_observation_space=env.single_observation_space
        ),
        wrappers.NormalizeReward,
        wrappers.RecordEpisodeStatistics,
    ],
    ids=["normalize", "flatten", "transform", "reward", "statistics"],
)
def test_vector_wrappers_of_gymnasium_run_over_the_end_of_episodes(wrap):
    env = wrap(batch())
    env.reset(seed=0)
    for action in actions(2 * STEPS + 2):
        observation, reward, *_ = env.step(action)
        assert observation.shape == (ROWS, 10)
        assert np.isfinite(observation).all()
        assert np.isfinite(reward).all()


def test_specification_has_the_length_of_an_episode():
    env = gym.make(ID, **SHORT)
    assert env.spec is not None
    assert env.spec.max_episode_steps == STEPS
    assert gym.spec(ID).max_episode_steps is None
    assert gym.make(ID, max_episode_steps=7, **SHORT).spec.max_episode_steps == 7
    assert batch().spec.max_episode_steps == STEPS
    again = gym.make(env.spec)
    again.reset(seed=0)
    ended = [again.step(np.zeros(1, np.float32))[3] for _ in range(STEPS)]
    assert ended == [False] * (STEPS - 1) + [True]


def test_time_aware_observation_reaches_the_end_of_the_episode():
    env = TimeAwareObservation(gym.make(ID, **SHORT), normalize_time=True)
    env.reset(seed=0)
    for _ in range(STEPS):
        observation, *_, truncated, _ = env.step(np.zeros(1, np.float32))
    assert truncated
    assert observation[-1] == 1.0


def test_reset_refuses_unknown_options():
    env = gym.make(ID)
    with pytest.raises(ValueError, match=r"'load'.*there are none; give load to gymnasium\.make"):
        env.reset(seed=0, options={"load": 3.0})
    env.reset(seed=0, options={})
    with pytest.raises(ValueError, match="the only option is reset_mask"):
        batch().reset(seed=0, options={"load": 3.0})


def test_cost_counts_the_exceeded_limits():
    env = Cost(gym.make(ID, load=0.0, episode_seconds=3.0))
    _, info = env.reset(seed=0)
    assert type(info) is dict
    costs = []
    for _ in range(300):
        *_, info = env.step(np.ones(1, np.float32))
        exceeded = [key for key in info if key.startswith("cost/") and info[key] > 0.0]
        assert info["cost"] == len(exceeded)
        costs.append(info["cost"])
    assert min(costs) == 0.0
    assert max(costs) >= 1.0


def test_cost_of_a_batch_equals_that_of_its_rows():
    arguments = {"load": 0.0, "episode_seconds": 2.0}
    mode = AutoresetMode.SAME_STEP
    many, single = VectorCost(batch(mode, **arguments)), Cost(gym.make(ID, **arguments))
    many.reset(seed=4)
    single.reset(seed=5)
    for _ in range(200):
        infos = many.step(np.ones((ROWS, 1), np.float32))[4]
        cost = single.step(np.ones(1, np.float32))[4]["cost"]
        last = infos.get("final_info", infos)
        assert last["cost"][1] == cost
    assert cost >= 1.0
    with pytest.raises(ValueError, match="make the batch with info=True"):
        VectorCost(batch(info=False))


def test_gymnasium_records_a_video(tmp_path):
    pytest.importorskip("moviepy")
    pytest.importorskip("pygame")
    env = RecordVideo(
        gym.make(ID, render_mode="rgb_array", **SHORT),
        str(tmp_path / "films"),
        episode_trigger=lambda _: True,
        disable_logger=True,
    )
    env.reset(seed=0)
    for _ in range(STEPS):
        env.step(np.zeros(1, np.float32))
    env.close()
    (film,) = (tmp_path / "films").glob("*.mp4")
    assert film.stat().st_size > 0


@pytest.mark.filterwarnings(
    "ignore:`(code_permalink|author|author_email|algorithm_name|description|requirements|eval_env)`:UserWarning:minari"
)
@pytest.mark.filterwarnings("ignore:Implicitly cleaning up:ResourceWarning")
@pytest.mark.skipif(importlib.util.find_spec("jax") is None, reason="minari[create] needs jax")
def test_minari_records_an_episode_with_its_info(tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    env = minari.DataCollector(PlainInfo(gym.make(ID, **SHORT)), record_infos=True)
    _, info = env.reset(seed=3)
    outputs = [info["output"]]
    for _ in range(STEPS):
        outputs.append(env.step(np.zeros(1, np.float32))[4]["output"])
    made = env.create_dataset(dataset_id="pam/short-v0")
    (episode,) = made.iterate_episodes()
    np.testing.assert_array_equal(episode.infos["output"], outputs)
    assert episode.truncations[-1]
    recovered = made.recover_environment()
    assert recovered.spec.max_episode_steps == STEPS
    del env  # leaves the removal of its temporary folder to the garbage collector
    gc.collect()
