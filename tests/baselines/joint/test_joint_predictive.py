"""Predictive inverse of joint and arm, and its model."""

import control
import numpy as np
import pytest

from baselines.joint import predictive
from baselines.joint.model_following import ModelFollowing
from baselines.joint.pair_model import LinearMotion, PairModel
from baselines.joint.predictive import StraightMotion
from baselines.predictive.regulator import RegulatorBank
from pam_envs.constants import GRAVITY
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from tests.baselines.conftest import built, last_state, make_env, rms, rollout

JOINT, ARM = "PAM/AntagonisticJoint-v0", "PAM/RedundantManipulator-v0"
STOCK = AntagonisticJoint.paper()
QUIET = STOCK.without_noise()


def joint_error(name: str, plant: AntagonisticJoint = QUIET, **arguments: object) -> np.ndarray:
    """Return the error [rad] with the stock joint as model, after 1 s."""
    env = make_env(JOINT, plant=plant, **arguments)
    record = rollout(env, built(name, env, STOCK))
    return np.asarray(record["output"] - record["reference"])[100:]


@pytest.mark.parametrize("hysteresis", ["maxwell_slip_length", "preisach_length", "none"])
def test_pull_is_that_of_the_plant(hysteresis):
    plant = AntagonisticJoint.paper(hysteresis).replace(
        {"muscle.gain": 1.1, "muscle.imbalance": 0.05}
    )
    model, draws = PairModel(plant), np.random.default_rng(0)
    angles, pressures = draws.uniform(-0.5, 0.5, 40), draws.uniform(1e5, 6e5, (40, 2))
    sliders = model.initial(np.zeros(1), pressures[:1])
    state = plant.hysteresis.model.initial_state((2,))
    straight = plant.lever.contraction(0.0, plant.muscle.rest_length)
    gains = 1.0 + plant.muscle.imbalance * np.array([1.0, -1.0])
    for angle, pressure in zip(angles, pressures, strict=True):
        found, sliders = model.pull(np.array([angle]), pressure[None], sliders)
        x = plant.lever.contraction(angle, plant.muscle.rest_length)
        drag, state = plant.hysteresis.friction(x - straight, pressure, state)
        law = plant.muscle.gain * gains * plant.muscle.law(pressure, x)
        exact = -np.sum(np.maximum(law - drag, 0.0) * plant.lever.rate(angle))
        assert found.torque[0] == pytest.approx(exact, abs=2e-3)


def test_linear_motion_rests_where_the_stiffness_holds_the_torque():
    mass = np.array([[0.4, 0.1], [0.1, 0.2]])
    stiffness = np.array([[15.0, 1.0], [1.0, 12.0]])
    motion = LinearMotion.make(mass, np.array([1.0, 2.0]), stiffness, 0.01)
    rest = np.linalg.solve(np.eye(4) - motion.a, motion.b)
    held = np.linalg.inv(stiffness)
    np.testing.assert_allclose(rest, np.vstack([held, np.zeros((2, 2))]), atol=1e-9)
    gains, _, _ = control.dlqr(motion.a, motion.b, np.diag([900.0, 900.0, 0, 0]), np.eye(2))
    np.testing.assert_allclose(motion.regulator(30.0), gains, rtol=1e-6)


@pytest.mark.parametrize(("factor", "lag"), [(1.0, 0.24), (0.5, 0.39)])
def test_estimate_of_a_torque_ramp_lags_by_a_quarter_of_a_second_in_an_arm(factor, lag):
    plant = RedundantManipulator.paper()
    straight = StraightMotion(plant, PairModel(plant), observer=factor, feedback=1.0)
    motion, (observer, _), n = straight.linear(0.0), straight.gains(0.0), plant.stages
    whole = np.block([[motion.a, motion.b], [np.zeros((n, 2 * n)), np.eye(n)]])
    true, found, step = np.zeros(3 * n), np.zeros(3 * n), 0.01  # N m per period
    for _ in range(1000):
        true = whole @ true
        true[2 * n :] += step
        expected = whole @ found
        found = expected + observer @ (true[:n] - expected[:n])
    periods = (true - found)[2 * n :] / step
    assert np.max(np.abs(periods)) * plant.control_period == pytest.approx(lag, abs=0.02)


def test_setpoint_exerts_the_torque_at_an_angle():
    plant = STOCK.replace({"muscle.gain": 1.1, "muscle.imbalance": 0.05})
    model, angle = PairModel(plant), np.array([-0.3, 0.0, 0.2])
    torque = np.array([1.0, -0.5, 0.8])
    free = np.zeros((3, 2))
    found = model.pressures(model.set_point(angle, torque, free))
    np.testing.assert_allclose(plant.torque(angle, *found.T), torque, atol=2e-3)
    far = model.set_point(angle, np.array([90.0, -90.0, 90.0]), free)
    np.testing.assert_array_equal(far, STOCK.angle_range[1] * np.array([1.0, -1.0, 1.0]))


def test_setpoint_counts_neither_force_nor_friction_of_a_slack_muscle():
    plant = AntagonisticJoint.paper("maxwell_slip_length")
    model, angle = PairModel(plant), np.radians([27.5])
    pressures = model.pressures(np.radians([26.5]))
    drag = np.array([[12.0, -4.0]])  # N; muscle a exerts less than 12 N at this angle
    x = plant.lever.contraction(angle[0], plant.muscle.rest_length)
    law = plant.muscle.law(pressures[0], x)
    assert 0.0 < law[0] < drag[0, 0]
    lever = plant.lever.rate(angle[0])
    torque = -np.sum(np.maximum(law - drag[0], 0.0) * lever)
    found = model.set_point(angle, np.array([torque]), drag)
    assert found == pytest.approx(np.radians(26.5), abs=1e-3)
    counted = torque - np.sum(drag[0] * lever)  # the slack muscle's friction as well
    other = model.set_point(angle, np.array([counted]), np.zeros((1, 2)))
    assert abs(other[0] - np.radians(26.5)) > 5e-3


def test_command_leads_to_the_difference_of_both_pressures():
    model, bank = PairModel(QUIET), RegulatorBank.make(QUIET)
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
    smooth = {"reference": "sine", "frequency": 1.0, "amplitude": 0.2, "episode_seconds": 5.0}
    found = rms(joint_error("joint_predictive", **smooth))
    assert found < np.radians(0.15)
    assert found < 0.4 * rms(joint_error("joint_mfc_mu_ahead", **smooth))


def test_without_preview_the_delay_is_that_of_the_other_controllers():
    blind = {"reference": "sines", "preview": 0, "episode_seconds": 5.0}
    other = rms(joint_error("joint_mfc_mu_ahead", **blind))
    assert rms(joint_error("joint_predictive", **blind)) < 1.1 * other


def test_observed_torque_is_the_weight_of_a_heavier_link():
    hold = np.r_[np.full(50, 0.0), np.full(350, 0.35)]
    heavier = QUIET.replace({"link.mass": 1.5 * QUIET.link.mass})
    env = make_env(JOINT, plant=heavier, reference=hold, episode_seconds=4.0)
    controller = built("joint_predictive", env, STOCK)
    state, info = last_state(env, controller)
    moment = 0.5 * QUIET.link.mass * QUIET.link.centre
    expected = -moment * GRAVITY * np.sin(info["output"])
    assert state.disturbance[0, 0] == pytest.approx(expected, rel=0.1)
    assert abs(info["output"] - info["reference"]) < np.radians(0.1)


def test_step_is_crossed_in_its_middle_at_the_rate_limit():
    step = np.r_[np.full(120, -0.3), np.full(180, 0.3)]
    found = joint_error("joint_predictive", reference=step, episode_seconds=3.0)
    other = joint_error("joint_mfc_mu_ahead", reference=step, episode_seconds=3.0)
    assert rms(found) < 0.9 * rms(other)
    late = slice(120, None)  # 1 s after the step
    assert np.abs(found[late]).max() < np.radians(0.1)


def test_exact_model_of_the_arm_leaves_no_static_error():
    quiet = RedundantManipulator.paper().without_noise()
    env = make_env(ARM, plant=quiet, reference="path_1", episode_seconds=11.0)
    record = rollout(env, built("joint_predictive", env, RedundantManipulator.paper()))
    names = range(quiet.stages)
    off = [record[f"state/angle_{k}"] - record[f"state/joint_reference_{k}"] for k in names]
    assert np.abs(np.array(off)[:, -20:]).max() < np.radians(0.08)


def test_other_joints_make_up_for_one_at_the_end_of_its_range(monkeypatch):
    def tool_error() -> float:
        env = make_env(ARM, reference="path_3", episode_seconds=6.0)
        record = rollout(env, built("joint_predictive", env))
        off = [record[f"state/{k}"] - record[f"state/reference_{k}"] for k in "xyz"]
        return float(np.sqrt(np.mean(np.sum(np.square(off), axis=0)[-100:])))

    found = tool_error()
    monkeypatch.setattr(predictive, "SMALLEST_SHORTFALL", 1.0)
    assert found < 0.15 * tool_error()


def test_joint_without_muscles_has_the_model_following_controller():
    env = make_env(JOINT, plant=AntagonisticJoint.reduced())
    assert isinstance(built("joint_predictive", env, lead=2.0), ModelFollowing)
