"""Predictive allocation of the elbow."""

import numpy as np
import pytest

from baselines.elbow.allocation import ElbowAllocation
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
from tests.baselines.conftest import built, make_env, rms, rollout

ID = "PAM/ElbowOrthosis-v0"
STOCK = make_env(ID).plant


def torque_error(name: str, plant: ElbowOrthosis, reference: str, motion: str) -> float:
    """Return the RMS error of the torque [N m] with the stock orthosis as model, after 1 s."""
    env = make_env(ID, plant=plant, reference=reference, motion=motion, episode_seconds=6.0)
    record = rollout(env, built(name, env, STOCK))
    return rms((record["output"] - record["reference"])[100:])


def test_torque_is_exact_with_exact_model_and_sensors():
    quiet = STOCK.without_noise()
    found = torque_error("elbow_predictive", quiet, "weight", "sines")
    assert found < 0.01
    assert found < 0.2 * torque_error("elbow_allocation_early", quiet, "weight", "sines")


@pytest.mark.parametrize(("reference", "motion"), [("weight", "sines"), ("free", "reaches")])
def test_dead_time_is_compensated_with_noise(reference, motion):
    early = torque_error("elbow_allocation_early", STOCK, reference, motion)
    assert torque_error("elbow_predictive", STOCK, reference, motion) < 0.8 * early


def test_prediction_follows_a_longer_dead_time():
    late = STOCK.replace({"regulator.dead_time": 0.09})
    found = torque_error("elbow_predictive", late, "weight", "sines")
    assert found < 0.4 * torque_error("elbow_allocation_early", late, "weight", "sines")


def test_slopes_of_the_references_are_those_of_the_object():
    env = make_env(ID, reference="weight", motion="sines", episode_seconds=3.0)
    controller = built("elbow_predictive", env)
    observation, _ = env.reset(seed=1)
    state, over, off = None, False, []
    while not over:
        action, state = controller.predict(observation, state, state is None)
        view = controller.signals.read(observation)
        slope = state.spread[0, 1] / (state.spread[0, 0] + 1e-9)
        exact = view.torque_reference[0] / np.tan(view.angle[0])  # Q = -m g l sin(q)
        off.append((slope - exact) / max(1.0, abs(exact)))
        observation, _, _, over, _ = env.step(action)
    assert np.median(np.abs(off[100:])) < 0.1


def test_valves_that_take_pulses_have_the_allocation():
    env = make_env(ID, plant=ElbowOrthosis.paper(valves="on_off"))
    assert isinstance(built("elbow_predictive", env, lead=2.0), ElbowAllocation)
