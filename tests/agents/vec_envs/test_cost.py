"""Cost of the training: quadratic errors, changes of the action, ended episodes."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from short_runs import ID

from agents.settings.parts import Cost
from agents.vec_envs.batch import make_batch_vec_env
from agents.vec_envs.cost import CostVecEnv

N, SEED, STEPS = 4, 60, 30
SHORT = {"episode_seconds": 0.2, "reference": "mixed", "load": None}


def terms_and_rewards(cost: Cost) -> tuple[dict[str, Any], np.ndarray, np.ndarray, np.ndarray]:
    """Return terms of the environment, rewards, actions and episode starts of the same steps."""
    env = CostVecEnv(make_batch_vec_env(ID, N, **SHORT), cost)
    other = gym.make_vec(ID, N, vectorization_mode="vector_entry_point", **SHORT)
    env.seed(SEED)
    env.reset()
    other.reset(seed=SEED)
    actions = np.random.default_rng(0).uniform(-1, 1, (STEPS, N, 1)).astype(np.float32)
    rewards, starts, terms = [], [], {"reward/tracking": [], "reward/effort": []}
    done = np.ones(N, bool)
    for action in actions:
        starts.append(done)
        _, reward, done, _ = env.step(action)
        _, _, _, _, infos = other.step(action)
        for name, values in terms.items():
            present = infos[name]
            values.append(
                np.where(done, infos["final_info"][name], present) if done.any() else present
            )
        rewards.append(reward)
    assert np.any(starts[1:])
    made = {name: np.array(values) for name, values in terms.items()}
    return made, np.array(rewards), actions, np.array(starts)


def test_errors_cost_their_square_up_to_the_limit_and_linearly_beyond():
    limit = 2.0
    terms, rewards, _, _ = terms_and_rewards(Cost(quadratic=limit))
    size = -terms["reward/tracking"]
    assert (size < limit).any()
    assert (size > limit).any()
    expected = np.where(size < limit, size**2, 2 * limit * size - limit**2)
    assert rewards == pytest.approx(terms["reward/effort"] - expected, rel=1e-6)


def test_errors_before_the_settled_time_cost_nothing():
    terms, rewards, _, starts = terms_and_rewards(Cost(settle_seconds=0.1))
    steps = np.zeros(N, int)
    for row, (reward, start) in enumerate(zip(rewards, starts, strict=True)):
        steps = np.where(start, 1, steps + 1)
        counted = steps > 10
        expected = terms["reward/effort"][row] + np.where(counted, terms["reward/tracking"][row], 0)
        assert reward == pytest.approx(expected, rel=1e-5)
    assert (rewards < 0.0).any()


def test_changes_of_the_action_cost_their_square_within_an_episode():
    terms, rewards, actions, starts = terms_and_rewards(Cost(action_rate=3.0))
    plain = sum(terms.values())
    change = np.square(np.diff(actions[..., 0], axis=0) / 2.0)
    expected = 3.0 * np.where(starts[1:], 0.0, change)
    assert rewards[0] == pytest.approx(plain[0], rel=1e-5)
    assert rewards[1:] == pytest.approx(plain[1:] - expected, rel=1e-5)


def test_ending_an_episode_costs_more_than_any_continuation():
    """The joint passes its limit; the environment's own term is for linear costs."""
    limit = 5.0
    pushed = {"episode_seconds": 10.0, "disturbance": 80.0}
    env = CostVecEnv(make_batch_vec_env("PAM/AntagonisticJoint-v0", 2, **pushed), Cost(limit))
    env.seed(1)
    env.reset()
    steps, ended = 0, None
    while ended is None:
        steps += 1
        _, reward, done, infos = env.step(np.zeros((2, 1), np.float32))
        ended = next((i for i in range(2) if done[i]), None)
    assert not infos[ended]["TimeLimit.truncated"]
    left = env.base.batches[0].unwrapped.setup.episode_steps - steps + 1
    lowest = env.base.last["reward/ended"][ended] / left
    assert lowest < -limit
    assert reward[ended] <= 2 * limit * lowest * left

    def cost(size: float) -> float:
        return float(env._error_cost(np.array([size]))[0])

    assert cost(-lowest) <= -2 * limit * lowest


def test_cut_off_periods_cost_where_the_environment_has_no_term():
    limits = {"reward": {"highest_contraction": 0.004}, "load": 0.0, "start": "rest"}
    plain = CostVecEnv(make_batch_vec_env(ID, 1, **limits), Cost(quadratic=1.0))
    costly = CostVecEnv(make_batch_vec_env(ID, 1, **limits), Cost(quadratic=1.0, ended=2.0))
    for env in (plain, costly):
        env.seed(SEED)
        env.reset()
    up = np.ones((1, 1), np.float32)
    steps = 0
    while True:
        steps += 1
        (_, free, done, _), (_, paid, _, _) = plain.step(up), costly.step(up)
        if done[0]:
            break
        assert free == paid
    left = 1001 - steps  # periods of an episode of 10 s, with the last one
    assert left > 100
    assert free[0] - paid[0] == pytest.approx(2.0 * left, rel=1e-3)


def test_relative_costs_are_shares_of_the_mean_of_each_kind_of_rows():
    kinds = ({"load": 0.35}, {"load": 3.5})
    own = {name: value for name, value in SHORT.items() if name != "load"}
    made: list[np.ndarray] = []
    for relative in (False, True):
        cost = Cost(relative=relative, action_rate=3.0)
        env = CostVecEnv(make_batch_vec_env(ID, N, *kinds, **own), cost)
        env.seed(SEED)
        env.reset()
        rewards, errors = [], []
        for _ in range(STEPS):
            action = np.full((2 * N, 1), len(errors) / STEPS, np.float32)
            rewards.append(env.step(action)[1])
            errors.append(-env.base.last["reward/tracking"])
        made.append(np.array(rewards) + np.array(errors))
    errors = np.array(errors)
    for rows in (slice(0, N), slice(N, 2 * N)):
        mean = np.cumsum(errors[:, rows].mean(axis=1)) / np.arange(1, STEPS + 1)
        dearer = errors[:, rows] * (1.0 - 1.0 / mean[:, None])
        assert made[1][:, rows] - made[0][:, rows] == pytest.approx(dearer, rel=1e-4, abs=1e-6)
