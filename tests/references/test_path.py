"""Paths of a tool: ends, draws, and the law of time."""

import numpy as np
import pytest

from pam_envs.references.path import PATHS, POINTS, along, draw_ends, joint_line, least_jerk

LIMIT = np.deg2rad(30.0)


def test_presets_are_lines_of_six_joints_within_their_limits():
    assert [path.name for path in PATHS] == ["path_1", "path_2", "path_3"]
    assert [path.calibrated for path in PATHS] == [True, True, False]
    for path in PATHS:
        angles = path.angles()
        assert angles.shape == (POINTS, 6)
        assert np.abs(angles).max() < LIMIT
        np.testing.assert_allclose(np.rad2deg(angles[0]), path.start_degrees, atol=1e-12)
        np.testing.assert_allclose(np.rad2deg(angles[-1]), path.end_degrees, atol=1e-12)


def test_line_has_equal_steps():
    line = joint_line([0.1, -0.2], [0.4, 0.2], 5)
    np.testing.assert_allclose(np.diff(line, axis=0), [[0.075, 0.1]] * 4, atol=1e-15)


@pytest.mark.parametrize(
    ("start", "end", "points", "words"),
    [([0.1, 0.2], [0.1], 5, "do not fit"), ([0.1], [0.2], 1, "too few"), (0.1, 0.2, 5, "shapes")],
)
def test_invalid_line_is_refused(start, end, points, words):
    with pytest.raises(ValueError, match=words):
        joint_line(start, end, points)


def test_drawn_paths_depend_on_the_seed_alone():
    starts, ends = draw_ends(3, 8, 6, LIMIT)
    fewer = draw_ends(3, 5, 6, LIMIT)
    np.testing.assert_array_equal(fewer[0], starts[:5])
    np.testing.assert_array_equal(fewer[1], ends[:5])
    assert not np.array_equal(draw_ends(4, 8, 6, LIMIT)[0], starts)
    assert len(np.unique(starts[:, 0])) == 8


@pytest.mark.parametrize("stages", [5, 6, 8])
def test_drawn_paths_keep_limits_and_avoid_the_straight_arm(stages):
    starts, ends = draw_ends(0, 60, stages, LIMIT)
    assert max(np.abs(starts).max(), np.abs(ends).max()) < 0.9 * LIMIT
    assert max(np.abs(starts).max(), np.abs(ends).max()) > 0.8 * LIMIT
    for start, end in zip(starts, ends, strict=True):
        assert np.linalg.norm(end - start) > 0.8 * LIMIT
        assert np.linalg.norm(joint_line(start, end), axis=1).min() > 0.6 * LIMIT


def test_motion_along_a_path_begins_and_ends_smoothly():
    h = 1e-3
    share = np.arange(0.0, 1.0 + h / 2, h)
    way = np.array([least_jerk(u) for u in share.tolist()])
    speed, curvature = np.gradient(way, h), np.gradient(np.gradient(way, h), h)
    assert way[0] == 0.0 and way[-1] == pytest.approx(1.0, abs=1e-15)
    assert np.all(np.diff(way) > 0.0)
    np.testing.assert_allclose(speed[[0, -1]], 0.0, atol=2e-5)
    np.testing.assert_allclose(curvature[[0, -1]], 0.0, atol=0.06)
    assert speed.max() == pytest.approx(1.875, abs=1e-4)
    assert (least_jerk(-0.5), least_jerk(1.5)) == (0.0, 1.0)


def test_tool_rests_moves_rests_and_returns():
    rest, move = 0.5, 2.0
    at = [along(t, rest, move) for t in (0.0, 0.5, 1.5, 2.5, 3.0, 4.0, 5.0, 5.25, 6.5)]
    np.testing.assert_allclose(at, [0.0, 0.0, 0.5, 1.0, 1.0, 0.5, 0.0, 0.0, 0.5], atol=1e-12)
    times = np.arange(0.0, 12.0, 1e-3).tolist()
    shares = np.array([along(t, rest, move) for t in times])
    assert shares.min() >= 0.0 and shares.max() <= 1.0
    assert np.abs(np.diff(shares)).max() < 1.9e-3 / move
