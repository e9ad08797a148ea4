"""Named signals: SI values to vectors and back; hints of messages."""

import gymnasium as gym
import numpy as np
import pytest

import pam_envs  # noqa: F401
from pam_envs.__main__ import env_ids
from pam_envs.wording import near

ESTIMATES = {"sensor/torque", "sensor/stiffness"}
"""Observed values that are computed from readings, without a sensor of their own."""


@pytest.mark.parametrize("name", env_ids())
@pytest.mark.parametrize("normalize", [True, False])
def test_encoded_values_are_decoded(name, normalize):
    env = gym.make(name, normalize=normalize).unwrapped
    for signals, space in (
        (env.signals, env.observation_space),
        (env.action_signals, env.action_space),
    ):
        inside = np.random.default_rng(0).uniform(0.0, 1.0, (len(signals), 4))
        values = {s.name: s.low + (s.high - s.low) * inside[s.index] for s in signals}
        vectors = signals.encode(values)
        assert vectors.shape == (4, len(signals))
        assert all(space.contains(vector) for vector in vectors)
        for s in signals:
            decoded = signals.decode(vectors, s.name)
            np.testing.assert_allclose(decoded, values[s.name], atol=1e-6 * (s.high - s.low))


def test_encoded_action_is_clipped_to_its_range():
    env = gym.make("PAM/MusclePositioning-v0").unwrapped
    assert env.action_signals.encode({"pressure_set_point": 9e5}) == 1.0
    assert env.action_signals.encode({"pressure_set_point": 3e5}) == 0.0


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({}, "no value of pressure_set_point; give SI values of exactly: pressure_set_point"),
        ({"pressure_set_point": 1.0, "load": 2.0}, "no signal named 'load'"),
    ],
)
def test_missing_and_unknown_signals_are_refused(values, message):
    with pytest.raises(ValueError, match=message):
        gym.make("PAM/MusclePositioning-v0").unwrapped.action_signals.encode(values)


@pytest.mark.parametrize("name", env_ids())
def test_sensors_without_noise_show_true_values(name):
    plant = gym.make(name).unwrapped.plant
    quiet = gym.make(name, plant=plant.without_noise())
    quiet.reset(seed=3)
    compared = 0
    for _ in range(20):
        *_, info = quiet.step(quiet.action_space.sample())
        for key in (key for key in info if key.startswith("sensor/")):
            true = info.get(key.replace("sensor/", "state/"))
            if true is not None and key not in ESTIMATES:
                assert info[key] == pytest.approx(true, rel=1e-12, abs=1e-12), key
                compared += 1
    assert compared


def test_empty_list_of_known_names_is_not_printed():
    assert near("a", []) == "; there are none"
    assert near("a", ["x", "y"]) == "; known: x, y"
