"""Strides: periodic, smooth, and consistent with the measured inverse dynamics."""

import numpy as np
import pytest

from pam_envs.constants import GRAVITY
from pam_envs.identification.gait_tables import STAIRS, tables
from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.mechanics.leg import Leg, ground_torque, knee_acceleration, shank_torque
from pam_envs.references.gait import (
    ACTIVITIES,
    FOLDER,
    KNEE,
    NATURAL_STRIDE,
    PAPER_STRIDE,
    SIGNALS,
    curve,
    curve_and_rates,
    fraction_of_turn,
    gait_curves,
    gait_table,
    shared_load,
    vertical_load,
)

PHASES = np.arange(100) / 100


@pytest.mark.parametrize("activity", ACTIVITIES)
def test_curves_are_periodic_with_their_rates(activity):
    for derivative in range(3):
        first = gait_curves(activity, 0.0, derivative)
        last = gait_curves(activity, 1.0 - 1e-12, derivative)
        scale = 100.0**derivative
        assert all(abs(first[name] - last[name]) < 1e-7 * scale for name in SIGNALS)


@pytest.mark.parametrize("activity", ACTIVITIES)
def test_rates_are_derivatives(activity):
    phase, h = np.linspace(0.003, 0.987, 211), 1e-5
    for derivative in (0, 1):
        ahead = gait_curves(activity, phase + h, derivative)
        behind = gait_curves(activity, phase - h, derivative)
        made = gait_curves(activity, phase, derivative + 1)
        for name in SIGNALS:
            slope = (ahead[name] - behind[name]) / (2 * h)
            assert np.allclose(slope, made[name], atol=3e-3 * 60.0**derivative)


@pytest.mark.parametrize("activity", ACTIVITIES)
def test_gait_kernels_equal_numpy(activity):
    table = gait_table(activity)
    for phase in (0.0, 0.004, 0.37, 0.62, 0.9999999):
        for signal, name in enumerate(SIGNALS):
            three = curve_and_rates(table, signal, phase)
            assert curve(table, signal, phase) == three[0]
            for derivative in range(3):
                expected = float(gait_curves(activity, phase, derivative)[name])
                assert three[derivative] == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_phase_is_taken_modulo_one():
    assert fraction_of_turn(3.25) == 0.25
    assert fraction_of_turn(0.0) == 0.0


@pytest.mark.parametrize("activity", ACTIVITIES)
def test_ground_force_is_never_negative_and_zero_in_swing(activity):
    vertical = gait_curves(activity, np.linspace(0, 1, 1001))["ground_z"]
    assert vertical.min() >= 0.0
    assert 0.25 < np.mean(vertical == 0.0) < 0.45
    assert 1.0 < vertical.max() < 1.5


@pytest.mark.parametrize("activity", ACTIVITIES)
@pytest.mark.parametrize("stride", [NATURAL_STRIDE, 2.5, PAPER_STRIDE])
def test_centre_of_mass_moves_as_far_at_every_pace(activity, stride):
    """Twice integrated vertical force of both legs: at most 5 cm up and down."""
    phases, quick = np.arange(2000) / 2000, NATURAL_STRIDE / stride
    one, other = (gait_curves(activity, phases + shift)["ground_z"] for shift in (0.0, 0.5))
    both = shared_load(one, other, quick) + shared_load(other, one, quick)
    travel = GRAVITY * (both - both.mean())
    for _ in range(2):
        travel = np.cumsum(travel) * stride / 2000
        travel -= travel.mean()
    assert 0.015 < np.ptp(travel) < 0.05
    table = gait_table(activity)
    own = [vertical_load(table, phase, quick) for phase in phases[::100]]
    assert own == pytest.approx(shared_load(one, other, quick)[::100])


def test_gait_tables_equal_their_script():
    for activity, curves in tables().items():
        stored = gait_table(activity)[1:-2]
        made = np.array([curves[name] for name in SIGNALS]).T
        assert np.allclose(stored, made, atol=1e-8)


def test_stair_curves_pass_near_their_knots():
    for activity, drawn in STAIRS.items():
        knee = np.degrees(gait_curves(activity, np.linspace(0, 1, 1001))["knee"])
        assert knee.max() == pytest.approx(max(drawn["knee"]), abs=4.0)
        assert knee.min() == pytest.approx(min(drawn["knee"]), abs=4.0)


def measured() -> np.ndarray:
    return np.genfromtxt(FOLDER / "gait_walk_stride.csv", delimiter=",", names=True)[:100]


def test_knee_angle_equals_the_measured_one():
    knee = np.degrees(gait_curves("walk", PHASES)["knee"])
    assert np.sqrt(np.mean((knee - measured()["knee_flexion_deg"]) ** 2)) < 0.15


def walking_balance() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Knee torque [N m] at natural pace: the balance, its vertical ground force alone, measured."""
    leg = Leg()
    value, rate, bend = (gait_curves("walk", PHASES, k) for k in range(3))
    pace, weight = 1.0 / NATURAL_STRIDE, leg.body_mass * GRAVITY
    full, vertical = np.zeros(100), np.zeros(100)
    for i in range(100):
        s, c = sine_and_cosine(value["shank"][i])
        forces = (weight * value["ground_z"][i], weight * value["ground_x"][i])
        sole = (value["cop"][i], s, c, leg.shank, leg.ankle_height)
        thigh = [d["knee"][i] - d["shank"][i] for d in (value, rate, bend)]
        ahead, up = knee_acceleration(thigh[0], thigh[1] * pace, thigh[2] * pace**2, leg.thigh)
        full[i] = ground_torque(*forces, *sole) + shank_torque(
            s, c, ahead, up, bend["shank"][i] * pace**2, leg.mass, leg.centre, leg.inertia
        )
        vertical[i] = ground_torque(forces[0], 0.0, *sole)
    return full, vertical, measured()["knee_ext_moment_Nm_per_kg"] * leg.body_mass


def rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.mean(error**2)))


def test_full_balance_matches_inverse_dynamics_and_equation_1_does_not():
    full, vertical, truth = walking_balance()
    stance = PHASES < 0.64
    assert rms((full - truth)[stance]) < 7.0
    assert np.corrcoef(full[stance], truth[stance])[0, 1] > 0.985
    assert rms((full - truth)[~stance]) < 5.0
    assert rms((vertical - truth)[stance]) > 30.0
    assert np.corrcoef(vertical[stance], truth[stance])[0, 1] < 0.2


def test_unknown_activity_is_refused_by_name():
    with pytest.raises(ValueError, match=r"activity = 'hop'.*walk, stairs_up, stairs_down"):
        gait_table("hop")


def test_returned_table_is_a_copy():
    gait_table("walk")[:] = 0.0
    assert gait_table("walk")[:, KNEE].max() > 1.0
