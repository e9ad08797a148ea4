"""SIMC rule: formulas, recommendation, and loops of joints."""

from __future__ import annotations

import numpy as np
import pytest

from baselines.joint.feedback import closed_loop_time, pid_system, simc_joint
from baselines.linear.ltr import loop_figures
from baselines.linear.simc import DELAY_PERIODS, simc_rule
from baselines.linear.systems import double_lag

PERIOD, POLE = 0.01, 23.0


def test_formulas_of_the_rule():
    law = simc_rule(2.0, 0.3, 0.05, 0.02, closed_loop_time=0.04)
    assert law == pytest.approx((0.3 / (2.0 * 0.06), 0.24, 0.05))
    assert simc_rule(2.0, 0.1, 0.0, 0.02).integral_time == 0.1


def test_recommendation_is_a_closed_loop_as_fast_as_the_dead_time():
    assert simc_rule(1.0, 0.3, 0.0, 0.02) == simc_rule(1.0, 0.3, 0.0, 0.02, 0.02)


def test_one_stage_takes_the_recommendation_and_an_arm_is_held_back():
    wait = DELAY_PERIODS * PERIOD
    assert closed_loop_time(POLE, wait, in_arm=False) == wait
    assert closed_loop_time(5.0, wait, in_arm=True) == pytest.approx(0.1)
    assert closed_loop_time(50.0, wait, in_arm=True) == wait
    assert closed_loop_time(POLE, wait, in_arm=False, smooth=True) == 1.0 / POLE


@pytest.mark.parametrize(("smooth", "margin", "peak"), [(False, 51.7, 1.86), (True, 70.1, 1.35)])
def test_loop_of_one_stage_bears_its_dead_time(smooth, margin, peak):
    """With a whole period of computing, as on a rig; without the filter of D the peak were 1.59."""
    law = simc_joint(1.0, POLE, PERIOD, smooth=smooth)
    loop = double_lag(POLE) * pid_system(law)
    late = loop_figures(lambda w: loop(1j * w) * np.exp(-1j * w * DELAY_PERIODS * PERIOD))
    assert np.degrees(late.phase_margin) == pytest.approx(margin, abs=0.2)
    assert late.peak_sensitivity == pytest.approx(peak, abs=0.01)


def test_rule_without_the_filter_has_the_peak_that_its_author_gives():
    pace = 2.0 * DELAY_PERIODS * PERIOD  # the loop is exp(-theta s) / (2 theta s)
    found = loop_figures(lambda w: np.exp(-0.5j * w * pace) / (1j * w * pace))
    assert found.peak_sensitivity == pytest.approx(1.59, abs=0.005)
