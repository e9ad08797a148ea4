"""EMG proxy: known reductions, activation dynamics, calibrated constants."""

import numpy as np
import pytest

from pam_envs.identification.emg_calibration import PUBLISHED, change
from pam_envs.muscle.emg import (
    EmgProxy,
    MuscleActivation,
    activation,
    activation_of,
    calibration,
    emg_proxy,
    excitation,
    left_of_gap,
    rms,
)
from pam_envs.references.gait import ACTIVITIES

PERIOD = 0.01
T = PERIOD * np.arange(1000)
DEMAND = 60.0 * np.sin(2 * np.pi * 0.2 * T)
BARE = MuscleActivation(floor=0.0)


def test_share_of_the_demand_lowers_emg_by_that_share():
    assert emg_proxy(DEMAND, 0.2 * DEMAND, PERIOD, BARE).change == pytest.approx(-0.2, abs=1e-3)


def test_floor_of_co_contraction_lowers_the_reduction():
    shown = emg_proxy(DEMAND, 0.2 * DEMAND, PERIOD, MuscleActivation(floor=0.05)).change
    assert -0.2 < shown < -0.12


def test_reading_a_divides_the_reduction_by_its_constant():
    shown = emg_proxy(DEMAND, 0.2 * DEMAND, PERIOD, reading="A", constant=0.55)
    assert shown.change == pytest.approx(-0.2 / 0.55, abs=2e-3)


def test_reading_b_is_a_power_of_the_torque():
    shown = emg_proxy(DEMAND, 0.2 * DEMAND, PERIOD, reading="B", constant=2.03)
    assert shown.change == pytest.approx(0.8**2.03 - 1.0, abs=3e-3)


def with_flexors(proxy: EmgProxy) -> float:
    """Return the change of the RMS with the additional activity of the flexors."""
    more = np.maximum(0.0, proxy.flexors - proxy.flexors_free)
    return rms(proxy.extensors + more) / rms(proxy.extensors_free) - 1.0


def test_flexors_work_against_excessive_assistance():
    much = emg_proxy(DEMAND, 1.5 * np.abs(DEMAND), PERIOD, BARE)
    assert much.change < -0.95
    assert with_flexors(much) > 0.0
    little = emg_proxy(DEMAND, 0.2 * DEMAND, PERIOD, BARE)
    assert with_flexors(little) == pytest.approx(little.change, abs=1e-3)


def test_activation_rises_faster_than_it_falls():
    muscle = MuscleActivation(floor=0.0)
    a = activation_of(np.where((T > 1.0) & (T < 2.0), 100.0, 0.0), PERIOD, muscle)
    risen, fallen = np.argmax(a > 0.5 * 0.63), np.argmax((T > 2.0) & (a < 0.5 * 0.37))
    assert (risen - 100) * PERIOD == pytest.approx(muscle.rise_time, abs=PERIOD)
    assert (fallen - 200) * PERIOD == pytest.approx(muscle.fall_time, abs=1.5 * PERIOD)


def test_activation_kernel_equals_the_record():
    muscle = MuscleActivation()
    record = activation_of(DEMAND, PERIOD, muscle)
    risen, fallen = (left_of_gap(PERIOD, t) for t in (muscle.rise_time, muscle.fall_time))
    level, made = excitation(DEMAND[0], muscle.largest_torque, muscle.floor), []
    for torque in DEMAND:
        excited = excitation(torque, muscle.largest_torque, muscle.floor)
        level = activation(level, excited, risen, fallen)
        made.append(level)
    assert np.array_equal(record, made)


@pytest.mark.parametrize("activity", ACTIVITIES)
@pytest.mark.parametrize("reading", ["A", "B"])
def test_calibrated_constants_give_the_published_reductions(activity, reading):
    constant = calibration(activity, reading)
    assert change(activity, reading, constant) == pytest.approx(PUBLISHED[activity], abs=2e-4)


@pytest.mark.parametrize("activity", ACTIVITIES)
def test_calibrated_constants_follow_from_the_published_figures(activity):
    """20 % of Eq. (1) lowers reading A by 0.2 / lambda and leaves 0.8 to the power n of B."""
    reduction = -PUBLISHED[activity]
    assert calibration(activity, "A") == pytest.approx(0.2 / reduction, abs=2e-3)
    power = np.log(1.0 - reduction) / np.log(0.8)
    assert calibration(activity, "B") == pytest.approx(power, abs=5e-3)


def test_unknown_activity_is_refused():
    with pytest.raises(ValueError, match="activity = 'hop'"):
        calibration("hop", "A")
