"""Geometry and torque of the brace: virtual work, inverse, published nominal point."""

import math

import numpy as np
import pytest

from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.mechanics.knee_lever import (
    KneeLever,
    assistive_torque,
    muscle_length,
    required_tension,
)

ANGLES = np.radians(np.linspace(82.0, 178.0, 49))


def test_lever_arm_satisfies_virtual_work():
    lever, h = KneeLever(), 1e-5
    slope = (lever.length(ANGLES + h) - lever.length(ANGLES - h)) / (2.0 * h)
    assert np.allclose(slope, lever.lever_arm(ANGLES), atol=1e-10)


def test_torque_is_minus_the_gradient_of_the_energy():
    """A constant tension and the spring: work over angle, with no formula of the torque."""
    lever, tension, h = KneeLever(), 158.0, 1e-5

    def energy(angle: np.ndarray) -> np.ndarray:
        spring = 0.5 * lever.stiffness * (angle - lever.relaxed_angle) ** 2
        return tension * lever.length(angle) + spring

    slope = (energy(ANGLES + h) - energy(ANGLES - h)) / (2.0 * h)
    assert np.allclose(slope, lever.torque(tension, ANGLES), atol=1e-8)


def test_tension_for_a_torque_gives_it_and_increases_with_it():
    lever = KneeLever()
    for torque in (-8.0, 0.0, 12.0):
        tension = lever.tension(torque, ANGLES)
        assert np.allclose(lever.torque(tension, ANGLES), torque, atol=1e-12)
    assert np.all(lever.tension(5.0, ANGLES) > lever.tension(0.0, ANGLES))


def test_length_and_angle_are_inverses():
    lever = KneeLever()
    assert np.allclose(lever.angle(lever.length(ANGLES)), ANGLES, atol=1e-9)
    assert lever.length(math.radians(110.0)) == pytest.approx(0.22, abs=1e-4)


def test_knee_kernels_equal_numpy():
    lever = KneeLever()
    numbers = (lever.arm, lever.stiffness, lever.relaxed_angle)
    for angle in ANGLES:
        sine, cosine = sine_and_cosine(0.5 * angle)
        length = muscle_length(sine, lever.arm, lever.fittings)
        assert length == pytest.approx(float(lever.length(angle)), abs=1e-15)
        torque = assistive_torque(200.0, cosine, angle, *numbers)
        assert torque == pytest.approx(float(lever.torque(200.0, angle)), abs=1e-12)
        tension = required_tension(angle, 3.0, *numbers)
        held = max(0.0, float(lever.tension(3.0, angle)))
        assert tension == pytest.approx(held, rel=1e-9, abs=1e-12)


def test_tension_is_never_negative():
    lever = KneeLever()
    assert required_tension(math.radians(150.0), -9.0, lever.arm, 30.0, lever.relaxed_angle) == 0.0
