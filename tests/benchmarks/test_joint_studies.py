"""The studies of the joint give the figures of seed 002, or known ones."""

from __future__ import annotations

import pytest

from benchmarks import joint_studies as studies
from benchmarks import papers_joint, plots_joint
from benchmarks.joint_inverses import width_ratio
from benchmarks.joint_studies import Setting, step


@pytest.mark.parametrize("group", papers_joint.GROUPS, ids=lambda g: g.__name__)
def test_no_figure_fails(group):
    figures = group()
    assert [f.name for f in figures if f.passed is False] == []
    assert any(f.passed for f in figures)


def test_exact_figures_of_the_pi():
    time, output = papers_joint.nominal_step()
    exact = studies.step_figures(time, output)
    assert exact.overshoot == pytest.approx(4.32, abs=0.005)
    assert exact.rise == pytest.approx(0.1321, abs=5e-5)
    assert exact.settling == pytest.approx(0.3666, abs=5e-5)


def test_bounds_pass_on_their_side_only():
    assert papers_joint.at_least("", "", "", 1.2, 1.2).passed
    assert papers_joint.at_least("", "", "", 1.2, 9.0).passed
    assert not papers_joint.at_least("", "", "", 1.2, 1.19).passed
    assert papers_joint.at_most("", "", "", 2.0, -3.0).passed
    assert not papers_joint.at_most("", "", "", 2.0, 2.01).passed


def test_step_with_hysteresis():
    best, same = step("joint_mfc_mu"), step("joint_pi")
    assert same.rise > 1.2 * best.rise
    assert step("joint_pi_slow").rise > 3.0 * best.rise
    assert best.overshoot - same.overshoot < 2.0
    wrong, plain = step("joint_mfc_mu_wrong"), step("joint_mfc_mu_plain")
    assert best.rise < wrong.rise < plain.rise
    assert best.rise == pytest.approx(0.132, abs=0.002)
    assert wrong.rise == pytest.approx(0.142, abs=0.002)


def test_without_hysteresis_the_inverse_is_of_no_use():
    setting = Setting(width=0.0)
    best, plain = step("joint_mfc_mu", setting), step("joint_mfc_mu_plain", setting)
    assert best.rise == pytest.approx(plain.rise, abs=1e-4)
    assert step("joint_mfc_mu", setting).overshoot == pytest.approx(4.32, abs=0.02)


def test_assumed_memory_has_loops_of_ten_per_cent():
    for amplitude in (10.0 * studies.DEGREE, studies.RANGE):
        assert studies.half_gap(amplitude) == pytest.approx(0.10, abs=0.002)
    memory = studies.assumed_memory()
    assert memory.everett[-1, 0] == pytest.approx(2.0 * studies.RANGE)


def test_inverse_shrinks_the_loop():
    assert width_ratio() > 5.0


def test_errors_of_a_sine_and_to_the_model():
    error, to_model = studies.tracking_error("joint_mfc_mu")
    assert 19.0 < error < 21.0
    assert to_model < 0.02


def test_picture_shows_every_controller_and_both_loops():
    figure = plots_joint.step_figure()
    steps, loops = figure.axes
    assert [len(ax.get_lines()) for ax in (steps, loops)] == [len(plots_joint.LINES) + 1, 2]
    assert "0.133 s" in steps.get_legend().get_texts()[0].get_text()
