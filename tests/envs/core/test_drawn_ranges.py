"""Drawn parameters of a batch: present values, ranges, and their change."""

import gymnasium as gym
import numpy as np
import pytest

ID = "PAM/MusclePositioning-v0"
SPAN = {"regulator.time_constant": (0.04, 0.06)}


def batch(number: int, **arguments):
    made = gym.make_vec(ID, number, vectorization_mode="vector_entry_point", **arguments)
    return made.unwrapped


def test_parameters_are_the_nominal_ones_without_randomization():
    env = batch(3)
    env.reset(seed=0)
    column = [env.plant.value(name) for name in env.plant.names]
    assert np.array_equal(env.parameters(), np.tile(column, (3, 1)))
    assert env.ranges == {}


def test_parameters_are_drawn_within_the_ranges_and_over_tiles():
    env = batch(70, randomize=SPAN)
    env.reset(seed=0)
    assert env.ranges == SPAN
    values = env.parameters()[:, env.plant.names.index("regulator.time_constant")]
    assert values.shape == (70,)
    assert values.min() >= 0.04
    assert values.max() <= 0.06
    assert len(set(values)) == 70
    alone = batch(1, randomize=SPAN)
    alone.reset(seed=50)
    assert np.array_equal(alone.parameters()[0], env.parameters()[50])


def test_changed_ranges_hold_from_the_next_episode_on():
    env = batch(40, randomize=SPAN, episode_seconds=0.05)
    env.reset(seed=0)
    before = env.parameters()
    env.ranges = {"regulator.time_constant": (0.049, 0.05)}
    assert np.array_equal(env.parameters(), before)
    for _ in range(5):
        env.step(np.zeros((40, 1)))
    values = env.parameters()[:, env.plant.names.index("regulator.time_constant")]
    assert values.min() >= 0.049
    assert values.max() <= 0.05


@pytest.mark.parametrize("span", [(0.05, 0.045), (0.01, 0.05), (0.05, 0.5)])
def test_ranges_outside_those_of_the_arguments_are_refused(span):
    env = batch(1, randomize=SPAN)
    with pytest.raises(ValueError, match=r"regulator\.time_constant is .* ascending and within"):
        env.ranges = {"regulator.time_constant": span}
