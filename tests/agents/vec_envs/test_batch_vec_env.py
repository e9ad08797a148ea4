"""Adapter of batched environments to stable-baselines3."""

import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from short_runs import ID
from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecMonitor

from agents.vec_envs.batch import BatchVecEnv, make_batch_vec_env

N, SEED = 5, 40
SHORT = {"episode_seconds": 0.12, "reference": "mixed", "load": None}


def actions(steps: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(-1, 1, (steps, N, 1)).astype(np.float32)


def test_single_environment_passes_the_checker_without_a_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gym.make(ID).unwrapped)
        check_env(gym.make(ID, normalize=True, reference="mixed", load=None).unwrapped)


def test_stable_baselines_trains_on_environments_made_by_id():
    """The way of rl-zoo3."""
    envs = make_vec_env(ID, n_envs=2, seed=0, env_kwargs=SHORT)
    model = PPO("MlpPolicy", envs, n_steps=32, batch_size=32, n_epochs=1, seed=0, device="cpu")
    before = model.policy.state_dict()["mlp_extractor.policy_net.0.weight"].clone()
    model.learn(64)
    assert model.num_timesteps == 64
    assert not before.equal(model.policy.state_dict()["mlp_extractor.policy_net.0.weight"])


def test_rows_equal_batched_and_single_environments():
    env = make_batch_vec_env(ID, N, **SHORT)
    batch = gym.make_vec(ID, N, vectorization_mode="vector_entry_point", **SHORT)
    singles = [gym.make(ID, **SHORT) for _ in range(N)]
    env.seed(SEED)
    first = env.reset()
    assert np.array_equal(first, batch.reset(seed=SEED)[0])
    assert np.array_equal(first, [e.reset(seed=SEED + i)[0] for i, e in enumerate(singles)])
    resets = 0
    for action in actions(60):
        observation, reward, done, infos = env.step(action)
        theirs = batch.step(action)
        assert np.array_equal(observation, theirs[0])
        assert np.array_equal(reward, theirs[1].astype(np.float32))
        assert np.array_equal(done, theirs[2] | theirs[3])
        for i, single in enumerate(singles):
            last, value, terminated, truncated, _ = single.step(action[i])
            assert reward[i] == np.float32(value)
            assert done[i] == (terminated or truncated)
            if done[i]:
                resets += 1
                assert np.array_equal(infos[i]["terminal_observation"], last)
                assert infos[i]["TimeLimit.truncated"] == (truncated and not terminated)
                last, _ = single.reset()
            assert np.array_equal(observation[i], last)
    assert resets >= 4 * N


def test_termination_is_not_called_a_truncation():
    limits = {"highest_contraction": 0.004}
    env = make_batch_vec_env(ID, N, reward=limits, load=0.0, start="rest")
    env.seed(SEED)
    env.reset()
    seen = []
    for _ in range(300):
        _, _, done, infos = env.step(np.ones((N, 1), np.float32))
        seen += [infos[i]["TimeLimit.truncated"] for i in np.flatnonzero(done)]
    assert seen
    assert not any(seen)


def test_only_ended_rows_have_an_info_of_their_own():
    env = make_batch_vec_env(ID, N, **SHORT)
    env.reset()
    for action in actions(30):
        _, _, done, infos = env.step(action)
        for i in range(N):
            assert set(infos[i]) == (
                {"terminal_observation", "TimeLimit.truncated"} if done[i] else set()
            )


def test_requested_infos_are_reported_by_row():
    env = make_batch_vec_env(ID, N, info=True, **SHORT)
    env.seed(SEED)
    env.reset()
    assert env.reset_infos[2]["time"] == 0.0
    single = gym.make(ID, **SHORT)
    single.reset(seed=SEED + 2)
    for action in actions(12):
        _, _, done, infos = env.step(action)
        last, _, _, _, expected = single.step(action[2])
        extra = {"terminal_observation", "TimeLimit.truncated"} if done[2] else set()
        assert {k: v for k, v in infos[2].items() if k not in extra} == expected
    assert done[2]
    assert np.array_equal(infos[2]["terminal_observation"], last)


def test_returned_arrays_are_not_overwritten():
    env = make_batch_vec_env(ID, N, **SHORT)
    env.reset()
    kept = [env.step(action) for action in actions(15)]
    held = [(o.copy(), r.copy()) for o, r, _, _ in kept]
    for action in actions(15):
        env.step(action)
    for (o, r, _, _), (old_o, old_r) in zip(kept, held, strict=True):
        assert np.array_equal(o, old_o)
        assert np.array_equal(r, old_r)


def test_seeds_repeat_and_unseeded_resets_continue():
    env = make_batch_vec_env(ID, N, **SHORT)
    env.seed(7)
    first, second = env.reset(), env.reset()
    assert not np.array_equal(first, second)
    env.seed(7)
    assert np.array_equal(env.reset(), first)
    assert np.array_equal(env.reset(), second)


def test_monitor_reports_the_return_of_whole_episodes():
    env = VecMonitor(make_batch_vec_env(ID, N, **SHORT))
    env.reset()
    total, reported = np.zeros(N), []
    for action in actions(24):
        _, reward, done, infos = env.step(action)
        total += reward
        for i in np.flatnonzero(done):
            assert infos[i]["episode"]["r"] == pytest.approx(total[i], rel=1e-5)
            assert infos[i]["episode"]["l"] == 12
            reported.append(i)
            total[i] = 0.0
    assert len(reported) == 2 * N


def test_attributes_and_methods_are_those_of_the_batch():
    env = make_batch_vec_env(ID, N, **SHORT)
    assert env.get_attr("plant", indices=[0, 3]) == [env.batches[0].unwrapped.plant] * 2
    assert len(env.get_attr("signals")) == N
    assert env.has_attr("plant")
    assert not env.has_attr("nonsense")
    assert env.env_is_wrapped(gym.Wrapper) == [False] * N
    env.set_attr("note", "here")
    assert env.get_attr("note", 1) == ["here"]
    with pytest.raises(ValueError, match="one batch"):
        env.set_attr("note", "there", indices=[1])
    with pytest.raises(ValueError, match="one batch"):
        env.env_method("get_state", indices=0)
    with pytest.raises(IndexError, match="row 9"):
        env.get_attr("plant", indices=[9])


def test_restored_state_continues_bit_for_bit():
    env = make_batch_vec_env(ID, N, **SHORT)
    env.seed(SEED)
    env.reset()
    moves = actions(40)
    for action in moves[:20]:
        env.step(action)
    state = env.get_state()
    first = [env.step(action)[0] for action in moves[20:]]
    env.set_state(state)
    again = [env.step(action)[0] for action in moves[20:]]
    assert np.array_equal(first, again)


def test_other_reset_mode_is_refused():
    other = SyncVectorEnv([lambda: gym.make(ID)], autoreset_mode=AutoresetMode.NEXT_STEP)
    with pytest.raises(ValueError, match="SAME_STEP"):
        BatchVecEnv(other)


def test_rows_cannot_be_reset_with_differing_options():
    env = make_batch_vec_env(ID, 2, **SHORT)
    env.set_options([{"a": 1}, {}])
    with pytest.raises(ValueError, match="same options"):
        env.reset()
