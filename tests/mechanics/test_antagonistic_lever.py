"""Lengths and lever arms of fluidic_muscles, Eq. (1.1): virtual work, symmetry, lengths."""

import math

import numpy as np
import pytest

from pam_envs.mechanics.antagonistic_lever import AntagonisticLever, span, squares

LEVERS = (AntagonisticLever(), AntagonisticLever(r_u=0.03, r_o=0.04, l_u=0.08, l_o=0.12))
ANGLES = np.radians(np.linspace(-34.0, 34.0, 35))


def written_out(lever: AntagonisticLever, angle: float) -> list[float]:
    """Both lengths [m] by Eq. (1.1), vector by vector."""
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    a = np.array([lever.r_u, lever.l_u]) + turn @ np.array([-lever.r_o, lever.l_o])
    b = np.array([-lever.r_u, lever.l_u]) + turn @ np.array([lever.r_o, lever.l_o])
    return [float(np.linalg.norm(v)) - lever.fittings for v in (a, b)]


@pytest.mark.parametrize("lever", LEVERS)
def test_lengths_equal_the_published_equation(lever):
    for angle in ANGLES:
        assert lever.length(angle) == pytest.approx(written_out(lever, float(angle)), abs=1e-15)


def test_thirty_degrees_need_the_whole_stroke_of_the_muscles():
    short, long = AntagonisticLever().length(math.radians(30.0))
    assert 1e3 * short == pytest.approx(112.5, abs=0.05)
    assert 1e3 * long == pytest.approx(150.0, abs=0.05)
    straight = AntagonisticLever().contraction(0.0, 0.15)
    assert straight == pytest.approx([0.0793, 0.0793], abs=1e-4)


@pytest.mark.parametrize("lever", LEVERS)
def test_rate_and_curve_are_derivatives_of_the_length(lever):
    h = 1e-5
    slope = (lever.length(ANGLES + h) - lever.length(ANGLES - h)) / (2 * h)
    assert np.allclose(slope, lever.rate(ANGLES), atol=1e-10)
    bend = (lever.rate(ANGLES + h) - lever.rate(ANGLES - h)) / (2 * h)
    assert np.allclose(bend, lever.curve(ANGLES), atol=1e-10)


@pytest.mark.parametrize("lever", LEVERS)
def test_muscles_are_mirror_images(lever):
    assert np.allclose(lever.length(ANGLES), lever.length(-ANGLES)[:, ::-1], atol=1e-15)
    assert np.allclose(lever.rate(ANGLES), -lever.rate(-ANGLES)[:, ::-1], atol=1e-15)


@pytest.mark.parametrize("lever", LEVERS)
def test_stretched_muscle_has_no_lever_arm_at_the_toggle(lever):
    assert float(lever.rate(lever.toggle)[1]) == pytest.approx(0.0, abs=1e-15)
    assert float(lever.rate(0.99 * lever.toggle)[1]) > 0.0


@pytest.mark.parametrize("lever", LEVERS)
def test_lever_kernel_equals_numpy(lever):
    known = squares(lever.r_u, lever.r_o, lever.l_u, lever.l_o)
    for angle in ANGLES:
        for k, side in enumerate((1.0, -1.0)):
            length, rate, curve = span(math.sin(angle), math.cos(angle), side, *known)
            assert length - lever.fittings == pytest.approx(lever.length(angle)[k], abs=1e-14)
            assert rate == pytest.approx(lever.rate(angle)[k], abs=1e-14)
            assert curve == pytest.approx(lever.curve(angle)[k], abs=1e-13)
