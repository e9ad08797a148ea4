"""fluidic_muscles, section 2: three paths, planned without and with the weight (2.1)."""

import numpy as np
import pytest

from benchmarks.papers import manipulator as figures
from benchmarks.papers.published import compared
from pam_envs.mechanics.redundancy.resolution import LIMIT
from pam_envs.references.path import PATHS, POINTS

PUBLISHED = {"path_1": (34.2, 27.6), "path_2": (33.2, 26.2), "path_3": (37.1, 27.8)}


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.name)
def test_weighted_plan_keeps_limits_that_unweighted_plan_exceeds(path) -> None:
    both = figures.plans(path)
    assert len(both.weighted.angles) == POINTS == 41
    unweighted, weighted = PUBLISHED[path.name]
    assert np.rad2deg(both.unweighted.peak) == pytest.approx(unweighted, abs=0.05)
    assert np.rad2deg(both.weighted.peak) == pytest.approx(weighted, abs=0.05)
    assert both.unweighted.peak > np.deg2rad(33.0)
    assert np.all(np.abs(both.weighted.angles) < LIMIT)
    assert np.median(both.weighted.iterations) <= 16
    assert both.weighted.longest_step < np.deg2rad(2.0)
    assert 1.25 <= both.price <= 1.3401


def test_example_path_is_a_straight_line_of_the_joints() -> None:
    """Of its ends only: as a straight line of the tool the peaks are others than stated."""
    both = figures.plans(PATHS[-1])
    peaks = np.rad2deg([both.unweighted.peak, both.weighted.peak])
    np.testing.assert_allclose(peaks, [37.12, 27.77], atol=0.005)
    other = [ours for _, ours in figures.other_reading()]
    np.testing.assert_allclose(other, [39.00, 28.22], atol=0.005)


def test_straight_poses_are_straight() -> None:
    poses = figures.straight_poses(PATHS[-1])
    steps = np.diff(poses, axis=0)
    np.testing.assert_allclose(steps[:, :3], np.broadcast_to(steps[0, :3], (40, 3)), atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(poses[:, 3:], axis=1), 1.0, atol=1e-14)
    turns = np.sum(poses[1:, 3:] * poses[:-1, 3:], axis=1)
    np.testing.assert_allclose(turns, turns[0], atol=1e-14)


def test_calibrated_paths_are_inputs_and_the_known_one_is_judged() -> None:
    made = [f for group in figures.GROUPS for f in compared("fluidic_muscles", group)]
    found = {figure.name: figure for figure in made}
    given = {name for name, f in found.items() if f.given}
    assert len(given) == 6
    assert all(name.startswith(("path_1", "path_2")) for name in given)
    assert all(found[name].remark.startswith("an input, not a result") for name in given)
    assert {n for n, f in found.items() if f.passed and "median iterations" in n} == {
        f"path_{k}: median iterations" for k in (1, 2, 3)
    }
    judged = [n for n, f in found.items() if f.passed and "largest angle" in n]
    assert judged == ["path_3, unweighted: largest angle", "path_3, weighted: largest angle"]


def test_one_ninth_of_unweighted_drawn_paths_exceeds_the_limit() -> None:
    found = figures.held_out()
    assert found.paths == 500
    assert found.crossed == pytest.approx(0.112)
    assert found.crossed_weighted == 0.0
    assert found.leapt < found.leapt_weighted == pytest.approx(0.26)
    assert found.iterations <= 16
    other = figures.held_out(number=100, seed=1)
    assert 0.0 < other.crossed < 0.25
    assert other.crossed_weighted == 0.0
