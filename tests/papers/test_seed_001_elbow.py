"""Seed 001: the figures of the elbow orthosis, each within its tolerance."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from benchmarks import papers
from benchmarks import papers_elbow as figures


@pytest.mark.parametrize("group", figures.GROUPS, ids=lambda group: group.__name__)
def test_every_figure_is_met(group: Callable[[], list[papers.Figure]]) -> None:
    made = group()
    assert made
    assert [f.name for f in made if f.passed is False] == []
    judged = [f for f in made if f.tolerance is not None]
    assert judged or group is figures.filling
    assert all(f.published == f.published for f in judged)


def test_the_figures_are_in_the_table_of_all_papers() -> None:
    assert set(figures.GROUPS) <= set(papers.groups())


def test_the_tolerances_can_fail() -> None:
    """With the law as printed the torques are far off, and the sign changes elsewhere."""
    wrong = figures.printed_bundle(3)
    assert abs(float(wrong.law(4e5, 0.0)) - figures.READ[3]) > 100.0
    assert figures.sign_change(figures.bundle(1, 0.33)) == pytest.approx(0.33, abs=1e-3)


def test_a_valve_takes_longer_at_high_contraction() -> None:
    low, high = (figures.time_to_force(figures.bundle(1), s) for s in (0.08, 0.24))
    assert 0.3 < low < high < 2.0


def test_the_picture_shows_every_bundle_at_both_pressures() -> None:
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
