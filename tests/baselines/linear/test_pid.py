"""SIMC rule and PID: formulas, limits, loops of joints, closed loop of the muscle."""

import numpy as np
import pytest

from baselines.joint.feedback import closed_loop_time, pid_system, simc_joint
from baselines.linear.ltr import loop_figures
from baselines.linear.pid import DELAY_PERIODS, Gains, pid_start, pid_step, simc_rule
from baselines.linear.systems import double_lag
from baselines.positioning.pid import simc
from pam_envs.plants.single_muscle.plant import SingleMuscle
from tests.baselines.conftest import QUIET, built, make_env, rollout

GAINS = Gains(1e7, 2e8, 1e5, 0.005, 0.05)
PERIOD, POLE = 0.01, 23.0


def _run(errors, gains=GAINS, low=0.0, high=6e5):
    state, outputs = pid_start(np.array([3e5]), np.zeros(1)), []
    for e in errors:
        output, state = pid_step(gains, state, np.array([e]), np.zeros(1), low, high, 0.01)
        outputs.append(output[0])
    return np.array(outputs), state


def test_pid_starts_from_the_present_output():
    assert _run([0.0, 0.0])[0] == pytest.approx([3e5, 3e5])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_limits_cause_no_windup(sign):
    outputs, state = _run([sign * 5e-3] * 2000)
    limit = 6e5 if sign > 0 else 0.0
    assert outputs[-1] == limit
    assert 0.0 <= state.integral[0] <= 6e5
    back, _ = _run([sign * 5e-3] * 2000 + [-sign * 2e-3] * 20)
    assert abs(back[2000] - limit) > 1e4  # leaves the limit at the first sign of the error


def test_back_calculation_leaves_the_limit_earlier():
    patient = Gains(1e7, 2e8, 1e5, 0.005, 1e9)
    guarded, _ = _run([5e-3] * 200 + [-1e-3] * 3)
    wound, _ = _run([5e-3] * 200 + [-1e-3] * 3, patient, high=6e5)
    assert guarded[-1] < wound[-1]


def test_derivative_is_filtered_and_of_the_measurement():
    still = pid_start(np.zeros(1), np.zeros(1))
    kick, _ = pid_step(GAINS, still, np.array([1e-3]), np.zeros(1), -1e9, 1e9, 0.01)
    assert kick[0] == pytest.approx(1e4)  # a step of the reference: proportional part alone
    moved, state = pid_step(GAINS, still, np.zeros(1), np.array([1e-3]), -1e9, 1e9, 0.01)
    assert moved[0] == pytest.approx(-1e5 * 0.1 * (1 - 0.005 / 0.015))
    later, _ = pid_step(GAINS, state, np.zeros(1), np.array([1e-3]), -1e9, 1e9, 0.01)
    assert moved[0] < later[0] < 0.0


def test_gains_are_those_of_the_simc_rule():
    plant = SingleMuscle.mas10()
    gains = simc(plant)
    theta = plant.regulator.dead_time + 0.015
    controller_gain = gains.derivative / (gains.proportional - gains.derivative / 0.05)
    assert gains.integral == pytest.approx(gains.tracking_time**-1 * gains.integral * 0.05)
    assert 0.0 < controller_gain < 0.03  # tau_2, the lag of the mass
    slower = simc(plant, closed_loop_time=3.0 * theta)
    assert slower.integral == pytest.approx(gains.integral / 2.0)
    assert simc(plant.replace({"regulator.dead_time": 0.1})).integral < gains.integral


@pytest.mark.parametrize("load", [0.0, 2.55, 4.55])
@pytest.mark.parametrize("hysteresis", ["maxwell_slip", "preisach"])
def test_closed_loop_does_not_oscillate(hysteresis, load):
    plant = SingleMuscle.mas10(hysteresis).replace(QUIET)
    reference = np.repeat([3e-3, 8e-3, 12e-3, 6e-3], 250)
    env = make_env(plant=plant, load=load, reference=reference, episode_seconds=10.0)
    record = rollout(env, built("pid", env))
    error = record["output"] - record["reference"]
    for end in (248, 498, 748, 998):
        assert np.abs(error[end - 50 : end]).max() < 2e-5
    assert record["output"][250:500].max() < 8e-3 + 0.2 * 5e-3  # overshoot below 20 %


def test_formulas_of_the_rule_with_the_dead_time_as_recommendation():
    law = simc_rule(2.0, 0.3, 0.05, 0.02, closed_loop_time=0.04)
    assert law == pytest.approx((0.3 / (2.0 * 0.06), 0.24, 0.05))
    assert simc_rule(2.0, 0.1, 0.0, 0.02).integral_time == 0.1
    assert simc_rule(1.0, 0.3, 0.0, 0.02) == simc_rule(1.0, 0.3, 0.0, 0.02, 0.02)


def test_closed_loop_is_slower_by_a_lag_in_an_arm_and_by_one_more_where_smooth():
    wait = DELAY_PERIODS * PERIOD
    assert closed_loop_time(POLE, wait, in_arm=False) == wait
    assert closed_loop_time(5.0, wait, in_arm=True) == pytest.approx(wait + 0.2)
    assert closed_loop_time(5.0, wait, in_arm=True, smooth=True) == pytest.approx(wait + 0.4)
    assert closed_loop_time(POLE, wait, in_arm=False, smooth=True) == wait + 1.0 / POLE


@pytest.mark.parametrize(("smooth", "margin", "peak"), [(False, 51.7, 1.86), (True, 74.1, 1.27)])
def test_loop_of_one_stage_has_margins_with_its_dead_time(smooth, margin, peak):
    """With a whole period of computing, as on a rig; without the filter of D the peak were 1.59."""
    law = simc_joint(1.0, POLE, PERIOD, smooth=smooth)
    loop = double_lag(POLE) * pid_system(law)
    late = loop_figures(lambda w: loop(1j * w) * np.exp(-1j * w * DELAY_PERIODS * PERIOD))
    assert np.degrees(late.phase_margin) == pytest.approx(margin, abs=0.2)
    assert late.peak_sensitivity == pytest.approx(peak, abs=0.01)


def test_simc_rule_without_the_filter_has_the_published_peak():
    pace = 2.0 * DELAY_PERIODS * PERIOD  # the loop is exp(-theta s) / (2 theta s)
    found = loop_figures(lambda w: np.exp(-0.5j * w * pace) / (1j * w * pace))
    assert found.peak_sensitivity == pytest.approx(1.59, abs=0.005)
