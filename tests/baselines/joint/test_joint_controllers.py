"""Joint controllers: one joint and many, limits, starts, signals."""

import warnings

import numpy as np
import pytest

from baselines.core.catalogue import PUBLISHED, make_controller
from baselines.core.entry import JOINT, Spec
from baselines.joint.base import Gravity, make_joint_signal_map
from baselines.joint.model import FREQUENCIES, joint_model, phase
from benchmarks.papers.joint_studies import (
    ACTIONS,
    DEGREE,
    RANGE,
    SIGNALS,
    ReducedRig,
    controller,
    run,
)
from pam_envs.envs.manipulator import env as redundant_manipulator
from pam_envs.parameters import Signal, Signals
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator

BOUND = ("_gravity", "_ahead", "_kinematics", "_dob", "_predictive")
"""Suffixes of controllers that need the weight or the chain of the plant."""
NAMES = [n for n, e in PUBLISHED.items() if JOINT[0] in e.envs and not n.endswith(BOUND)]
RIG = ReducedRig()


def _signals(names, normalized=False):
    return Signals(Signal(n, "rad", -RANGE, RANGE, k, normalized) for k, n in enumerate(names))


def _two(name):
    names = ["angle_0", "angle_1", "set_point_0", "set_point_1"]
    names += ["joint_reference_0", "joint_reference_1"]
    actions = _signals(["angle_set_point_0", "angle_set_point_1"], True)
    made = PUBLISHED[name].make(Spec(RIG, _signals(names), actions))
    return made, actions


def _observations(rows=3, steps=40):
    draw = np.random.default_rng(1)
    return RANGE * draw.uniform(-1.0, 1.0, (steps, rows, 3))


@pytest.mark.parametrize("name", [n for n in NAMES if n != "joint_random"])
def test_controller_of_two_joints_equals_two_single_ones(name):
    pair, actions = _two(name)
    one, seen = controller(name, RIG), _observations(rows=2)
    states, state = [None, None], None
    for batch in seen:
        both, state = pair.predict(batch.T.ravel(), state)
        for k in range(2):
            action, states[k] = one.predict(batch[k], states[k])
            assert actions[k].decode(both) == pytest.approx(float(action[0]), abs=1e-6)


def test_arm_without_a_plan_is_refused_except_by_inverse_kinematics():
    setup, plant = redundant_manipulator.make_setup(plan=False), RedundantManipulator.paper()
    signals = setup.signals, setup.action_signals
    with pytest.raises(ValueError, match="make the environment with plan=True"):
        make_joint_signal_map(*signals)
    made = make_controller("joint_inverse_kinematics", plant, *signals)
    assert made.limit == plant.angle_range[1]
    nowhere = np.zeros(len(setup.signals), np.float32)  # a pose without a direction
    action, state = made.predict(nowhere)
    np.testing.assert_array_equal(action, np.zeros(6))
    assert state.missed[0] == 1


def test_actions_other_than_angles_are_refused():
    actions = Signals([Signal("pressure_a_set_point", "Pa", 0.0, 6e5, 0)])
    with pytest.raises(ValueError, match="action='angle'"):
        make_joint_signal_map(SIGNALS, actions)


def test_co_contraction_keeps_its_observed_value():
    names = ("angle", "set_point", "reference", "prestress")
    signals = Signals(Signal(n, "", -1.0, 99.0, k, False) for k, n in enumerate(names))
    low, high = 20.0, 120.0
    actions = Signals([ACTIONS[0], Signal("prestress", "N", low, high, 1)])
    made = make_joint_signal_map(signals, actions)
    action = made.write(np.array([[0.1]]), np.array([0.0, 0.0, 0.0, 45.0]))
    assert actions[1].decode(action) == pytest.approx(45.0)


@pytest.mark.parametrize("name", ["joint_pi", "joint_pid", "joint_mfc_mu", "joint_mfc_hinf"])
def test_joint_returns_from_a_limit_without_windup(name):
    reference = np.concatenate([np.full(300, 1.3 * RANGE), np.full(200, 5.0 * DEGREE)])
    found = run(controller(name, RIG), reference, RIG)
    at_limit = found.set_point[299]
    assert at_limit == pytest.approx(RANGE, abs=1e-6)
    fallen = found.angle[3600:]  # 0.6 s after the reference has come back into reach
    assert np.max(np.abs(fallen - 5.0 * DEGREE)) < 1.0 * DEGREE


@pytest.mark.parametrize(
    "name", ["joint_pi", "joint_pi_slow", "joint_pid", "joint_pid_smooth", "joint_mfc_mu"]
)
def test_start_at_rest_elsewhere_has_no_bump(name):
    made, command = controller(name, RIG), 12.0 * DEGREE
    rest = float(RIG.rest_angles(np.array([command]))[0])
    seen, state = np.array([rest, command, rest]), None
    for _ in range(5):
        action, state = made.predict(seen, state)
        assert float(action[0]) == pytest.approx(command, abs=1e-3 * DEGREE)


def test_joint_with_the_models_hysteresis_follows_the_model():
    found = run(controller("joint_mfc_mu", ReducedRig(0.0)), np.full(100, 0.1), ReducedRig(0.0))
    np.testing.assert_allclose(found.angle[9::10], found.model, atol=1e-6)


def test_feedback_removes_a_constant_error():
    for name in ("joint_pi", "joint_pi_slow", "joint_pid", "joint_mfc_mu", "joint_mfc_mu_wrong"):
        found = run(
            controller(name, RIG), np.full(400, 7.0 * DEGREE), RIG, lambda t: 0.02 + 0.0 * t
        )
        assert abs(found.angle[-1] - 7.0 * DEGREE) < 0.02 * DEGREE


def test_gravity_feedforward_is_the_shift_of_the_plant():
    plant = AntagonisticJoint.paper()
    angles, payload = np.array([[0.3], [-0.2], [0.05]]), np.array([0.0, 0.1, 0.2])
    found = Gravity(plant).shift(angles, payload)
    np.testing.assert_allclose(found, plant.gravity_shift(angles, payload), atol=2e-3)
    assert np.all(Gravity().shift(angles, payload) == 0.0)
    assert np.abs(found).max() > 5e-3


def test_phase_of_a_double_lag_is_90_degrees_at_its_pole():
    time = 0.01 * np.arange(1, 400)
    angle = 1.0 - np.exp(-6.0 * time) * (1.0 + 6.0 * time)
    found = phase(np.diff(np.append(0.0, angle)), 0.01)
    assert np.interp(6.0, FREQUENCIES, found) == pytest.approx(-0.5 * np.pi, abs=0.01)


def test_asymmetric_hysteresis_warns_with_value_and_bound():
    joint = AntagonisticJoint.paper(muscle__imbalance=0.08)
    with pytest.warns(UserWarning, match=r"fails the symmetry: symmetry 0\.0\d\d \(bound 0.03\)"):
        model = joint_model(joint)
    assert model.hysteresis is not None and model.hysteresis.start == "low"


@pytest.mark.parametrize("preset", ["paper", "measured", "reduced"])
def test_presets_raise_no_warning(preset):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model = joint_model(getattr(AntagonisticJoint, preset)())
    assert model.hysteresis is not None and model.hysteresis.start == "virgin"
