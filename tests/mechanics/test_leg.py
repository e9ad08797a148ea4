"""Leg: balance against numerically differentiated momentum and angular momentum."""

import numpy as np
import pytest

from pam_envs.constants import GRAVITY
from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.mechanics.leg import (
    Leg,
    centre_of_pressure,
    gravity_stiffness,
    ground_torque,
    knee_acceleration,
    shank_torque,
)

H = 1e-4


def lean(t: float) -> float:
    return 0.3 + 0.5 * np.sin(3.0 * t) + 0.1 * np.cos(7.0 * t)


def thigh(t: float) -> float:
    return 0.1 + 0.4 * np.cos(2.0 * t + 0.3)


def rates(of, t: float) -> tuple[float, float]:
    return (of(t + H) - of(t - H)) / (2 * H), (of(t + H) - 2 * of(t) + of(t - H)) / H**2


def knee_at(t: float, leg: Leg) -> np.ndarray:
    """Return the position of the knee below a hip that moves evenly."""
    return np.array([1.2 * t, 0.9]) + leg.thigh * np.array([np.sin(thigh(t)), -np.cos(thigh(t))])


def centre_at(t: float, leg: Leg) -> np.ndarray:
    return knee_at(t, leg) + leg.centre * np.array([-np.sin(lean(t)), -np.cos(lean(t))])


@pytest.mark.parametrize("t", [0.0, 0.4, 1.1, 2.3])
def test_full_balance_satisfies_newton_and_euler(t):
    """Knee torque from forces and moments about the shank's centre of mass, all differenced."""
    leg = Leg()
    force = np.array([-80.0, 650.0])
    cop = 0.06
    knee, centre = knee_at(t, leg), centre_at(t, leg)
    ankle = knee + leg.shank * np.array([-np.sin(lean(t)), -np.cos(lean(t))])
    contact = np.array([ankle[0] + cop, ankle[1] - leg.ankle_height])
    acceleration = np.array([rates(lambda s, k=k: centre_at(s, leg)[k], t)[1] for k in range(2)])
    joint = leg.mass * (acceleration + np.array([0.0, GRAVITY])) - force

    def moment(arm: np.ndarray, f: np.ndarray) -> float:
        """About the axis that turns the shank's lower end ahead."""
        return float(-arm[1] * f[0] + arm[0] * f[1])

    spin = -rates(lean, t)[1] * (leg.inertia - leg.mass * leg.centre**2)
    expected = spin - moment(knee - centre, joint) - moment(contact - centre, force)

    ahead, up = knee_acceleration(thigh(t), *rates(thigh, t), leg.thigh)
    s, c = sine_and_cosine(lean(t))
    made = ground_torque(force[1], force[0], cop, s, c, leg.shank, leg.ankle_height)
    made += shank_torque(s, c, ahead, up, rates(lean, t)[1], leg.mass, leg.centre, leg.inertia)
    assert made == pytest.approx(expected, abs=1e-4)


def test_gravity_stiffness_is_the_slope_of_the_shank_torque():
    """Flexing by e leans the shank by e more; the torque of the shank falls by K e."""
    leg, ahead, up = Leg(), 2.0, -1.5

    def torque(angle: float) -> float:
        s, c = sine_and_cosine(angle)
        return shank_torque(s, c, ahead, up, 0.0, leg.mass, leg.centre, leg.inertia)

    for angle in (-0.4, 0.0, 0.9):
        s, c = sine_and_cosine(angle)
        slope = (torque(angle + 1e-5) - torque(angle - 1e-5)) / 2e-5
        made = gravity_stiffness(s, c, ahead, up, leg.mass, leg.centre)
        assert made == pytest.approx(-slope, abs=1e-6)


def test_ground_force_passes_through_one_point_at_every_pace():
    aim, x, z, natural = 1.0, -0.06, 1.0, 0.03
    for quick in (0.25, 0.6, 1.0, 1.2):
        cop = centre_of_pressure(natural, x, z, quick, aim, -0.2, 0.4)
        leaning = quick * quick * x / z
        assert cop + leaning * aim == pytest.approx(natural + x / z * aim, abs=1e-12)


def test_centre_of_pressure_stays_within_the_sole():
    assert centre_of_pressure(0.0, -0.2, 1.0, 0.1, 1.0, -0.05, 0.22) == -0.05
    assert centre_of_pressure(0.2, 0.2, 1.0, 0.1, 1.0, -0.05, 0.22) == 0.2  # driven ahead: as it is
    assert centre_of_pressure(0.3, 0.2, 1.0, 0.1, 1.0, -0.05, 0.22) == 0.22
    assert centre_of_pressure(0.1, -0.2, 1.0, 0.1, 0.0, -0.05, 0.22) == 0.1
