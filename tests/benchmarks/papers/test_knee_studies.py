"""Studies of the knee reproduce the figures of yeh2010, or known ones."""

from __future__ import annotations

import pytest

from benchmarks.papers import knee_studies as studies


@pytest.mark.parametrize(
    ("width", "feedback", "line", "over_line"),
    [(0.0, 5.06, 0.95, 1.0), (0.25e5, 5.20, 1.31, 1.3), (0.5e5, 5.37, 1.69, 1.6)],
)
def test_printed_feedback_with_two_feed_forwards(
    width: float, feedback: float, line: float, over_line: float
) -> None:
    errors = studies.tension_errors(width)
    assert errors.with_inverse < 1.33
    assert errors.feedback / errors.with_inverse > 3.5
    assert errors.feedback == pytest.approx(feedback, abs=0.2)
    assert errors.with_line == pytest.approx(line, abs=0.2)
    assert errors.with_line / errors.with_inverse == pytest.approx(over_line, abs=0.1)


def test_designed_feedback_does_no_worse_than_the_printed_one() -> None:
    assert studies.tension_errors(feedback="designed").with_inverse < 1.05


def test_switch_with_and_without_bumpless_transfer() -> None:
    smooth, bumpy = (studies.switching(10.0, bumpless=b) for b in (True, False))
    assert smooth.tension < 15.0 < 40.0 < bumpy.tension
    assert smooth.excess < 0.5 * bumpy.excess
    assert smooth.tension <= smooth.at_switch + smooth.excess + 1e-9
    assert smooth.command < 0.3e5 < 1e5 < bumpy.command
    assert studies.switching(10.0, preview=True).tension < 15.0


@pytest.mark.parametrize(
    ("activity", "expected"),
    [
        ("walk", (0.884, 1.004, 0.754, 0.733)),
        ("stairs_up", (0.821, 0.886, 0.689, 0.693)),
        ("stairs_down", (0.800, 0.850, 0.729, 0.731)),
    ],
)
def test_emg_as_delivered_in_the_environment(activity, expected) -> None:
    ratios = studies.emg_ratios(activity)
    names = ("extensors_ratio", "ratio", "extensors_ratio_fitted_a", "extensors_ratio_fitted_b")
    assert [ratios[f"emg_{name}"] for name in names] == pytest.approx(expected, abs=0.01)
