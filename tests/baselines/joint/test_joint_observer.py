"""Disturbance observer of the joint."""

import numpy as np

from tests.baselines.conftest import built, make_env, rollout


def test_observer_removes_the_static_error_of_another_joint():
    env = make_env("PAM/AntagonisticJoint-v0")
    nominal = env.plant.without_noise()
    other = nominal.replace({"link.mass": 1.5 * nominal.link.mass})
    hold = np.r_[np.full(50, 0.0), np.full(550, 0.35)]
    errors = {}
    for name in ("joint_inverse_ahead", "joint_inverse_dob"):
        env = make_env("PAM/AntagonisticJoint-v0", plant=other, reference=hold, episode_seconds=6.0)
        record = rollout(env, built(name, env, nominal))
        errors[name] = np.abs(record["output"] - record["reference"])[-50:].mean()
    assert errors["joint_inverse_dob"] < 0.2 * errors["joint_inverse_ahead"]
