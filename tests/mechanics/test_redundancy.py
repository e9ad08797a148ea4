"""Redundancy resolution: conditions of an optimum, limits, straight and unreachable poses."""

import numpy as np
import pytest

from pam_envs.kernels.build import interpreted
from pam_envs.mechanics.redundancy import resolution as redundancy
from pam_envs.mechanics.redundancy.newton import (
    across,
    bends_upwards,
    set_curvature,
    set_equations,
    slope_and_curvature,
    solve_equations,
    weight_of,
)
from pam_envs.mechanics.redundancy.resolution import (
    LIMIT,
    UnreachablePose,
    nearest,
    resolve,
)
from pam_envs.mechanics.serial_chain.chain import SerialChain
from pam_envs.mechanics.serial_chain.kernels import work_rows
from pam_envs.references.path import joint_line

ARM = SerialChain.uniform()
H = 1e-6
START = np.deg2rad([-5.65, 7.18, -12.57, -10.03, -12.03, 7.89])
END = np.deg2rad([-10.53, 12.52, -26.49, -26.45, -25.94, 21.0])


def weight(angles: np.ndarray, weighted: bool) -> float:
    if not weighted:
        return float(angles @ angles)
    return float(np.sum(4.0 * angles**2 - np.log(1.0 - (angles / LIMIT) ** 2)))


def gradient(angles: np.ndarray, weighted: bool) -> np.ndarray:
    if not weighted:
        return 2.0 * angles
    share = angles / LIMIT
    return 8.0 * angles + 2.0 * share / (LIMIT * (1.0 - share**2))


def free_direction(angles: np.ndarray, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the change of angles that keeps the pose, and an orthonormal basis of the rest."""
    sides = np.linalg.svd(pose[None, 3:])[2][1:]
    jacobian = ARM.jacobian(angles)
    rows = np.vstack([jacobian[:3], sides @ jacobian[3:]])
    basis = np.linalg.svd(rows)[2]
    return basis[5], basis[:5]


def back_on_pose(angles: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """Return angles nearby that give the pose, by Gauss and Newton."""
    for _ in range(20):
        off = ARM.pose(angles) - pose
        angles = angles - np.linalg.lstsq(ARM.jacobian(angles), off, rcond=None)[0]
    return angles


@pytest.mark.parametrize("weighted", [True, False])
def test_solution_is_a_minimum_on_the_pose(weighted):
    """No slope along the joint motion that keeps the pose, and more weight to either side."""
    poses = ARM.pose(joint_line(START, END, 9))
    found = resolve(ARM, poses, weighted=weighted, start=START)
    for angles, pose in zip(found.angles, poses, strict=True):
        np.testing.assert_allclose(ARM.pose(angles), pose, atol=1e-14)
        free, _ = free_direction(angles, pose)
        assert abs(free @ gradient(angles, weighted)) < 1e-9
        least = weight(angles, weighted)
        for way in (0.02, -0.02):
            aside = back_on_pose(angles + way * free, pose)
            assert np.linalg.norm(aside - angles) > 0.01
            assert weight(aside, weighted) > least + 1e-5


@pytest.mark.parametrize(
    "start",
    [
        (-0.308, 0.43, 0.123, -0.286, -0.328, 0.262),
        (0.389, 0.095, -0.191, -0.274, 0.201, 0.254),
        (0.298, -0.376, 0.003, 0.014, 0.204, -0.382),
    ],
)
def test_iteration_leaves_a_nearby_saddle(start):
    """Starts from which Newton's plain method increases the weight or ends at a saddle."""
    pose = ARM.pose(start)
    found = resolve(ARM, pose[None], start=start).angles[0]
    free, _ = free_direction(found, pose)
    for way in (0.01, -0.01):
        assert weight(back_on_pose(found + way * free, pose), True) > weight(found, True)
    assert weight(found, True) < weight(np.array(start), True) - 1e-3


def test_multipliers_are_those_of_the_lagrangian():
    """They are the slope of the weight over a change of the desired pose."""
    pose = ARM.pose(END)
    found = resolve(ARM, pose[None], start=END)
    for i in range(3):
        moved = [pose + H * way * np.eye(6)[i] for way in (1.0, -1.0)]
        ends = [resolve(ARM, p[None], start=found.angles[0]).angles[0] for p in moved]
        differenced = (weight(ends[0], True) - weight(ends[1], True)) / (2.0 * H)
        assert -found.multipliers[0][i] == pytest.approx(differenced, rel=1e-5)


@pytest.mark.parametrize("weighted", [True, False])
def test_slope_and_curvature_are_derivatives_of_the_weight(weighted):
    for angle in np.linspace(-0.5, 0.5, 11).tolist():
        slope, curvature = slope_and_curvature(angle, LIMIT, weighted)
        sides = [slope_and_curvature(angle + h, LIMIT, weighted)[0] for h in (H, -H)]
        assert curvature == pytest.approx((sides[0] - sides[1]) / (2 * H), rel=1e-7)
        one = np.array([angle])
        sides = [weight(one + h, weighted) for h in (H, -H)]
        assert slope == pytest.approx((sides[0] - sides[1]) / (2 * H), abs=3e-8)
    function = interpreted(weight_of, {"N_STAGES": 6})
    angles = np.linspace(-0.4, 0.5, 6)
    value = function([[a] for a in angles.tolist()], LIMIT, weighted)
    assert value == pytest.approx(weight(angles, weighted), abs=1e-9)


def test_equations_contain_the_second_derivative_of_the_lagrangian():
    """Of weight and constraint, both differenced; the multipliers' block is the Jacobian."""
    pose, multipliers = ARM.pose(END), np.array([3.0, -2.0, 1.5, 0.7, -1.1])
    work, system = np.zeros((work_rows(6), 1)).tolist(), np.zeros((11, 12)).tolist()
    names = {"N_STAGES": 6, "LANES": 1}
    q, fixed = START[:, None].tolist(), ARM.rows()[:, None].tolist()
    interpreted(set_equations, names)(q, fixed, work, system, pose.tolist(), LIMIT, True)
    interpreted(set_curvature, names)(multipliers.tolist(), work, system, pose.tolist())
    got = np.array(system)
    np.testing.assert_allclose(-got[:6, 11], gradient(START, True), rtol=1e-12)
    jacobian = got[6:, :6]
    np.testing.assert_array_equal(got[:6, 6:11], jacobian.T)
    np.testing.assert_allclose(jacobian[:3], ARM.jacobian(START)[:3], atol=1e-14)
    first = np.array(across(*pose[3:].tolist()))
    aside = np.array([first, np.cross(pose[3:], first)])
    np.testing.assert_allclose(jacobian[3:], aside @ ARM.jacobian(START)[3:], atol=1e-14)
    spread = np.concatenate([multipliers[:3], multipliers[3:] @ aside])

    def slope(angles: np.ndarray) -> np.ndarray:
        return np.asarray(gradient(angles, True) + ARM.jacobian(angles).T @ spread)

    curved = [(slope(START + d) - slope(START - d)) / (2 * H) for d in H * np.eye(6)]
    np.testing.assert_allclose(got[:6, :6], curved, atol=3e-8)


def test_equations_are_solved_with_row_exchange():
    rng = np.random.default_rng(0)
    matrix, right = rng.normal(size=(7, 7)), rng.normal(size=7)
    matrix[0, 0] = matrix[3, 3] = 0.0
    system = np.column_stack([matrix, right]).tolist()
    solve_equations(system, 7)
    np.testing.assert_allclose(
        [row[7] for row in system], np.linalg.solve(matrix, right), rtol=1e-10
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_saddle_is_distinguished_from_a_minimum(sign):
    """Of a form that is negative along constrained directions, and ``sign`` along the free one."""
    rng = np.random.default_rng(1)
    basis = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    form = basis @ np.diag([-3.0, -1.0, -2.0, -5.0, -1.0, sign]) @ basis.T
    system = np.zeros((11, 12))
    system[:6, :6], system[6:, :6] = form, rng.normal(size=(5, 5)) @ basis[:, :5].T
    convex = interpreted(bends_upwards, {"N_STAGES": 6})
    assert convex(system.tolist(), np.zeros((6, 6)).tolist()) is (sign > 0.0)


def test_without_a_start_bent_poses_are_tried():
    rng = np.random.default_rng(4)
    for _ in range(25):
        drawn = rng.uniform(-0.93, 0.93, 6) * LIMIT
        pose = ARM.pose(drawn)
        found = resolve(ARM, pose[None])
        np.testing.assert_allclose(ARM.pose(found.angles[0]), pose, atol=1e-12)
        assert found.within_limits
        assert weight(found.angles[0], True) <= weight(drawn, True) + 1e-9


def test_straight_start_is_bent_first():
    """The Jacobian has lost rank there: rows of position and direction along the arm are 0."""
    straight = np.zeros(6)
    assert np.linalg.matrix_rank(ARM.jacobian(straight)) == 4
    pose = ARM.pose(END)
    found = resolve(ARM, pose[None], start=straight)
    np.testing.assert_allclose(ARM.pose(found.angles[0]), pose, atol=1e-12)


def test_almost_straight_pose_is_reached():
    found = resolve(ARM, [[0.0, 0.0, 1.4999, 0.0, 0.0, 1.0]])
    np.testing.assert_allclose(ARM.pose(found.angles[0])[:3], [0.0, 0.0, 1.4999], atol=1e-9)


def test_path_follows_one_branch():
    found = resolve(ARM, ARM.pose(joint_line(START, END)), start=START)
    assert found.longest_step < np.deg2rad(1.0)
    assert found.angles.shape == (41, 6) and found.multipliers.shape == (41, 5)
    assert np.all(found.iterations > 0)


def test_unweighted_angles_may_pass_a_limit_that_weighted_ones_keep():
    pose = ARM.pose(END)[None]
    free, kept = (resolve(ARM, pose, weighted=w, start=END) for w in (False, True))
    assert free.peak > LIMIT and not free.within_limits
    assert kept.peak < LIMIT and kept.within_limits
    assert np.sum(free.angles**2) < np.sum(kept.angles**2)


def test_narrower_limit_is_kept():
    limit = np.deg2rad(27.6)
    found = resolve(ARM, ARM.pose(END)[None], limit=limit, start=0.9 * END)
    assert found.peak < limit
    assert found.peak > np.deg2rad(26.0)


def test_chain_with_more_redundant_joints_is_solved(monkeypatch):
    uncompiled(monkeypatch)
    chain = SerialChain.uniform("zxyxyxyz", length=0.2)
    angles = np.array([0.2, -0.3, 0.25, 0.1, -0.2, 0.3, 0.15, -0.1])
    pose = chain.pose(angles)
    found = resolve(chain, pose[None], start=angles).angles[0]
    np.testing.assert_allclose(chain.pose(found), pose, atol=1e-13)
    sides = np.linalg.svd(pose[None, 3:])[2][1:]
    jacobian = chain.jacobian(found)
    rows = np.vstack([jacobian[:3], sides @ jacobian[3:]])
    free = np.linalg.svd(rows)[2][5:]
    assert free.shape == (3, 8)
    np.testing.assert_allclose(free @ gradient(found, True), 0.0, atol=1e-9)


# --- refusals -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pose", "distance"), [([0, 0, 1.6, 0, 0, 1], 0.1), ([0, 0, 2.5, 0, 0, 1], 1.0)]
)
def test_unreachable_pose_is_refused_by_name(pose, distance):
    poses = np.array([ARM.pose(START), pose, ARM.pose(START)])
    with pytest.raises(UnreachablePose, match="bring the path") as caught:
        resolve(ARM, poses, start=START)
    assert caught.value.index == 1
    assert caught.value.distance == pytest.approx(distance, rel=1e-3)
    assert f"pose 1 at (0, 0, {pose[2]:g}) m" in str(caught.value)
    assert f"{1e3 * distance:g} mm" in str(caught.value)


def test_pose_within_the_length_of_the_arm_may_exceed_joint_limits():
    bent = np.deg2rad([40.0, 0.0, 40.0, 0.0, 40.0, 0.0])
    pose = ARM.pose(bent)
    with pytest.raises(UnreachablePose) as caught:
        resolve(ARM, pose[None])
    assert 0.01 < caught.value.distance < 0.5
    assert resolve(ARM, pose[None], limit=np.deg2rad(45.0)).peak < np.deg2rad(45.0)


def test_missed_reachable_pose_requests_a_starting_point():
    far, near = (UnreachablePose(0, ARM.pose(START), d, 0.0, LIMIT) for d in (1e-3, 1e-9))
    assert "out of reach" in str(far) and "1 mm" in str(far)
    assert "give start angles" in str(near)


def test_nearest_pose_of_a_reachable_pose_is_itself():
    distance, turn = nearest(ARM, ARM.pose(START))
    assert distance < 1e-6 and turn < 1e-5


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"poses": np.zeros((3, 5))}, r"shape \(3, 5\)"),
        ({"poses": np.full((1, 6), np.nan)}, "finite"),
        ({"poses": np.zeros((1, 6))}, "direction 0"),
        ({"limit": 30.0}, "limit = 30.0 rad"),
        ({"start": np.zeros(5)}, "6 finite joint angles"),
        ({"start": np.full(6, 0.6)}, "begin between the limits"),
        ({"chain": SerialChain.uniform("xyxy")}, "4 joints"),
    ],
)
def test_invalid_arguments_are_refused(arguments, words):
    with pytest.raises(ValueError, match=words):
        resolve(**{"chain": ARM, "poses": ARM.pose(START)[None], **arguments})


# --- compiled and not ---------------------------------------------------------------------------


def uncompiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let kernels run as plain Python."""
    monkeypatch.setattr(redundancy, "COMPILED", False)
