"""chakarov2018: the figures of the elbow orthosis, met or named as missed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from benchmarks.papers import elbow as figures
from benchmarks.papers import figures as papers
from benchmarks.papers.published import Figure

MISSED = {"softest without torque at 20 degrees"}
"""2.71 N m/rad against 2.75: not a figure of the paper's."""
INPUTS = (figures.filling, figures.hysteresis, figures.small_motions)


@pytest.mark.parametrize("group", figures.GROUPS, ids=lambda group: group.__name__)
def test_every_figure_is_met_or_named_here(group: Callable[[], list[Figure]]) -> None:
    made = list(group())
    assert made
    assert {f.name for f in made if f.passed is False} <= MISSED
    assert all(f.verdict == "MISSED" for f in made if f.name in MISSED)
    assert any(f.passed for f in made) != (group in INPUTS)
    for figure in made:  # nothing but the paper's own figures is called published
        printed = "section 3" in figure.source and figure.unit in ("m", "%")
        assert (figure.published == figure.published) == (printed or "input" in figure.note)


def test_torques_of_the_table_are_judged_within_two_hundredths() -> None:
    torques = [f for f in figures.torque_table() if f.unit == "N m"]
    assert len(torques) == 9
    assert all(f.passed and f.tolerance == 0.02 for f in torques)


def test_elbow_figures_are_in_the_table_of_all_papers() -> None:
    assert set(figures.GROUPS) <= set(papers.GROUPS)


def test_tolerances_of_elbow_can_fail() -> None:
    """With the law as printed the torques are far off, and the sign changes elsewhere."""
    wrong = figures.printed_bundle(3)
    assert abs(float(wrong.law(4e5, 0.0)) - figures.READ[3]) > 100.0
    assert figures.sign_change(figures.bundle(1, 0.33)) == pytest.approx(0.33, abs=1e-3)


def test_filling_is_slower_at_high_contraction() -> None:
    low, high = (figures.time_to_pressure(figures.bundle(1), s, 5e5, 4.5e5) for s in (0.08, 0.24))
    assert 0.3 < low < high < 2.0


def test_picture_shows_every_bundle_at_both_pressures() -> None:
    left, right = figures.bundle_figure().axes
    for ax, pressure in ((left, 4e5), (right, 0.0)):
        solid = [
            line for line in ax.lines if line.get_linestyle() == "-" and len(line.get_xdata()) > 9
        ]
        starts = [float(line.get_ydata()[0]) for line in solid]
        expected = [float(figures.bundle(n).law(pressure, 0.0)) for n in range(1, 7)]
        assert starts == pytest.approx(expected)
        ends = [float(line.get_ydata()[-1]) for line in solid]
        assert np.abs(ends).max() < 1e-9
