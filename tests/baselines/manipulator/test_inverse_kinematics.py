"""Inverse kinematics per period, and plans of a path."""

import numpy as np
import pytest

from baselines.core.entry import Spec
from baselines.manipulator.redundancy import POSE, compare, make_inverse_kinematics
from pam_envs.mechanics.redundancy.resolution import LIMIT, UnreachablePose, resolve
from pam_envs.parameters import Signal, Signals
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.references.path import PATHS

PLANT = RedundantManipulator.paper()
ARM = PLANT.chain
PATH = PATHS[-1]
NAMES = [*(f"angle_{k}" for k in range(6)), *(f"reference_{p}" for p in POSE)]
AHEAD = [f"reference_{p}_1" for p in POSE]
SIGNALS = Signals(
    Signal(name, "1", -2.0, 2.0, i, i % 2 == 0) for i, name in enumerate(NAMES + AHEAD)
)
ACTIONS = Signals(Signal(f"angle_set_point_{k}", "rad", -LIMIT, LIMIT, k) for k in range(6))
SPEC = Spec(PLANT, SIGNALS, ACTIONS)


def observation(angles: np.ndarray, pose: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    values = np.concatenate([angles, pose, ahead])
    return np.array([s.encode(v) for s, v in zip(SIGNALS, values, strict=True)])


def set_points(action: np.ndarray) -> np.ndarray:
    return np.array([ACTIONS[k].decode(action) for k in range(6)])


def test_setpoints_are_those_of_the_plan():
    line = PATH.angles()
    poses = ARM.pose(line)
    planned = resolve(ARM, poses, start=line[0])
    follower, state = make_inverse_kinematics(SPEC), None
    for k in range(40):
        seen = observation(line[0], poses[k], poses[k + 1])
        action, state = follower.predict(seen, state)
        assert action.shape == (6,) and action.dtype == np.float32
        np.testing.assert_allclose(set_points(action), planned.angles[k], atol=1e-6)
    assert state is not None and state.missed[0] == 0


def test_previewed_pose_is_the_target():
    line = PATH.angles()
    poses = ARM.pose(line[:2])
    seen = observation(line[0], poses[0], poses[1])
    action, _ = make_inverse_kinematics(SPEC, preview=1).predict(seen)
    desired = resolve(ARM, poses[1:], start=line[0]).angles[0]
    np.testing.assert_allclose(set_points(action), desired, atol=1e-6)


def test_rows_of_a_batch_are_independent():
    lines = [path.angles() for path in PATHS]
    poses = [ARM.pose(line) for line in lines]
    follower = make_inverse_kinematics(SPEC, weighted=False)
    state, alone = None, [None] * 3
    for k in range(4):
        rows = [observation(q[0], p[k], p[k]) for q, p in zip(lines, poses, strict=True)]
        start = np.array([k == 0, k in (0, 2), k == 0])  # row 1 begins anew at k = 2
        actions, state = follower.predict(np.array(rows), state, start)
        for i, row in enumerate(rows):
            action, alone[i] = follower.predict(row, alone[i], np.array([start[i]]))
            np.testing.assert_array_equal(action, actions[i])


def test_pose_out_of_reach_keeps_the_setpoints_and_is_counted():
    line = PATH.angles()
    good, far = ARM.pose(line[0]), np.array([0.0, 0.0, 1.7, 0.0, 0.0, 1.0])
    follower = make_inverse_kinematics(SPEC)
    first, state = follower.predict(observation(line[0], good, good))
    held, state = follower.predict(observation(line[0], far, far), state)
    np.testing.assert_array_equal(held, first)
    assert state.missed[0] == 1
    again, state = follower.predict(observation(line[0], good, good), state)
    np.testing.assert_allclose(again, first, atol=1e-6)
    assert state.missed[0] == 1


def test_weighted_plan_keeps_joints_within_their_limits():
    line = PATH.angles()
    both = compare(ARM, ARM.pose(line), start=line[0])
    assert both.unweighted.peak > LIMIT > both.weighted.peak
    squares = [np.sum(plan.angles[-1] ** 2) for plan in (both.weighted, both.unweighted)]
    assert both.price == pytest.approx(squares[0] / squares[1]) and both.price > 1.0
    with pytest.raises(UnreachablePose):
        compare(ARM, [[0.0, 0.0, 1.7, 0.0, 0.0, 1.0]])
