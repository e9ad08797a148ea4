"""Predictive inverse of joint and arm, and its model."""

import control
import numpy as np
import pytest

from baselines.joint import predictive
from baselines.joint.disturbance_observer import JointObserver
from baselines.joint.pair_model import LinearMotion, PairModel
from baselines.predictive.regulator import RegulatorBank
from pam_envs.constants import GRAVITY
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from tests.baselines.conftest import built, make_env, rms, rollout

JOINT, ARM = "PAM/AntagonisticJoint-v0", "PAM/RedundantManipulator-v0"
NOMINAL = AntagonisticJoint.paper().without_noise()


def joint_error(name: str, plant: AntagonisticJoint = NOMINAL, **arguments: object) -> np.ndarray:
    """Return the error [rad] with the stock joint as model, after 1 s."""
    env = make_env(JOINT, plant=plant, **arguments)
    record = rollout(env, built(name, env, NOMINAL))
    return np.asarray(record["output"] - record["reference"])[100:]


@pytest.mark.parametrize("hysteresis", ["maxwell_slip_length", "preisach_length"])
def test_pull_is_that_of_the_plant(hysteresis):
    plant = AntagonisticJoint.paper(hysteresis)
    model, draws = PairModel(plant), np.random.default_rng(0)
    angles, pressures = draws.uniform(-0.5, 0.5, 40), draws.uniform(1e5, 6e5, (40, 2))
    sliders = model.initial(np.zeros(1), pressures[:1])
    state = plant.hysteresis.model.initial_state((2,))
    straight = plant.lever.contraction(0.0, plant.muscle.rest_length)
    for angle, pressure in zip(angles, pressures, strict=True):
        found, sliders = model.pull(np.array([angle]), pressure[None], sliders)
        x = plant.lever.contraction(angle, plant.muscle.rest_length) - straight
        drag, state = plant.hysteresis.friction(x, pressure, state)
        exact = plant.torque(angle, *pressure) + np.sum(drag * plant.lever.rate(angle))
        assert found.torque[0] == pytest.approx(exact, abs=2e-3)


def test_linear_motion_rests_where_the_stiffness_holds_the_torque():
    mass = np.array([[0.4, 0.1], [0.1, 0.2]])
    motion = LinearMotion.make(mass, np.array([1.0, 2.0]), 15.0, 0.01)
    rest = np.linalg.solve(np.eye(4) - motion.a, motion.b)
    np.testing.assert_allclose(rest, np.vstack([np.eye(2) / 15.0, np.zeros((2, 2))]), atol=1e-9)
    gains, _, _ = control.dlqr(motion.a, motion.b, np.diag([900.0, 900.0, 0, 0]), np.eye(2))
    np.testing.assert_allclose(motion.regulator(2.0), gains, rtol=1e-6)


def test_command_leads_to_the_difference_of_both_pressures():
    model, bank = PairModel(NOMINAL), RegulatorBank.make(NOMINAL)
    later = model.pressures(np.array([0.1, -0.2]))
    start = later[:, 0] - later[:, 1]
    wanted = start + np.array([4e3, -1e4])  # below twice the rate limit in a period: 13.6 kPa
    laws = (np.full(2, bank.lag[0]), np.full(2, bank.rate[0]))
    found = model.pressures(model.command(later, wanted, *laws, bank.period))
    flat = bank.start(later.ravel())._replace(commands=np.repeat(found.reshape(-1, 1), 12, axis=1))
    state = bank.advance(flat, found.ravel())
    after = bank.now(state).reshape(2, 2)
    np.testing.assert_allclose(after[:, 0] - after[:, 1], wanted, atol=20.0)


def test_smooth_reference_is_tracked_closer_than_by_model_following():
    smooth = {"reference": "sine", "episode_seconds": 6.0, "start": "straight"}
    found = rms(joint_error("joint_predictive", **smooth))
    assert found < np.radians(0.1)
    assert found < 0.3 * rms(joint_error("joint_mfc_mu_ahead", **smooth))


def test_observed_torque_is_the_weight_of_an_undeclared_payload():
    hold = np.r_[np.full(50, 0.0), np.full(350, 0.35)]
    heavier = NOMINAL.replace({"link.mass": 1.5 * NOMINAL.link.mass})
    env = make_env(JOINT, plant=heavier, reference=hold, episode_seconds=4.0)
    controller = built("joint_predictive", env, NOMINAL)
    observation, _ = env.reset(seed=1)
    state, over = None, False
    while not over:
        action, state = controller.predict(observation, state, state is None)
        observation, _, _, over, info = env.step(action)
    moment = 0.5 * NOMINAL.link.mass * NOMINAL.link.centre
    expected = -moment * GRAVITY * np.sin(info["output"])
    assert state.disturbance[0, 0] == pytest.approx(expected, rel=0.1)
    assert abs(info["output"] - info["reference"]) < np.radians(0.1)


def test_both_muscles_of_a_joint_are_at_the_rate_limit_in_a_step():
    step = np.r_[np.full(120, -0.35), np.full(180, 0.35)]
    env = make_env(JOINT, plant=NOMINAL, reference=step, episode_seconds=3.0)
    record = rollout(env, built("joint_predictive", env, NOMINAL))
    moved = [np.abs(np.diff(record[f"state/pressure_{m}"])) / 0.01 for m in "ab"]
    both = np.minimum(*moved)[100:150] / NOMINAL.regulator.slew_rate
    assert np.sum(both > 0.95) >= 10


def test_other_joints_make_up_for_one_at_the_end_of_its_range(monkeypatch):
    def tool_error() -> float:
        env = make_env(ARM, reference="path_3", episode_seconds=6.0)
        record = rollout(env, built("joint_predictive", env))
        off = [record[f"state/{k}"] - record[f"state/reference_{k}"] for k in "xyz"]
        return float(np.sqrt(np.mean(np.sum(np.square(off), axis=0)[-100:])))

    found = tool_error()
    monkeypatch.setattr(predictive, "LEAST", 1.0)
    assert found < 0.4 * tool_error()


def test_joint_without_muscles_has_the_inverse_with_an_observer():
    env = make_env(JOINT, plant=AntagonisticJoint.reduced())
    assert isinstance(built("joint_predictive", env, lead=2.0), JointObserver)
