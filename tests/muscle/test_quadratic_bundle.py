"""Quadratic law of a bundle: published points, signs, virtual work, volume."""

import dataclasses

import numpy as np
import pytest

from pam_envs.muscle.quadratic_bundle import (
    QuadraticBundle,
    bundle_shape,
    bundle_volume,
    grown_volume,
)

NUMBERS = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)


def bundle(muscles: float) -> QuadraticBundle:
    return QuadraticBundle(muscles=muscles)


def printed(muscles: float) -> QuadraticBundle:
    """Return the bundle with k1 as printed, -21 per kPa, which no plant may have."""
    return dataclasses.replace(bundle(muscles), pressure_base=-0.021, largest_contraction=0.33)


def test_factors_equal_equation_6_as_read():
    for n in NUMBERS:
        assert bundle(n).passive_factor == pytest.approx(-39.0 + 321.0 * n)
        assert 1e3 * bundle(n).pressure_factor == pytest.approx(-0.21 + 4.41 * n)


def test_k1_as_printed_gives_negative_force_for_up_to_four_muscles():
    forces = [float(printed(n).law(4e5, 0.0)) for n in NUMBERS]
    assert forces[:4] == pytest.approx([-319.0, -214.0, -110.0, -5.0], abs=0.5)
    assert min(forces[4:]) > 0.0


def test_force_grows_with_the_number_of_muscles():
    """REPRODUCTION's values with 33 % of largest contraction; linear, as the paper says."""
    read = [float(dataclasses.replace(bundle(n), largest_contraction=0.33).law(4e5, 0.0))
            for n in NUMBERS]  # fmt: skip
    assert read == pytest.approx([98.0, 203.0, 308.0, 412.0, 517.0, 622.0, 726.0], abs=0.5)
    assert np.diff(read, 2) == pytest.approx(0.0, abs=1e-9)


def test_filling_lowers_the_force_beyond_28_percent_contraction():
    """The change of force by filling to 500 kPa, at the contractions of Fig. 2."""
    muscle = bundle(1.0)
    contraction = 0.39 * np.array([0.08, 0.13, 0.19, 0.24, 0.28, 0.32])
    change = muscle.law(5e5, contraction) - muscle.law(0.0, contraction)
    assert np.all(np.diff(change) < 0.0)
    assert np.all(change[:4] > 0.0)
    assert change[4] == pytest.approx(0.0, abs=1e-9)
    assert change[5] < 0.0
    assert muscle.law(5e5, contraction) == pytest.approx(
        [66.7, 47.3, 26.4, 11.0, 0.0, -9.9], abs=0.06
    )
    assert np.all(muscle.force(5e5, contraction) >= 0.0)


@pytest.mark.parametrize("muscles", NUMBERS)
def test_stiffness_is_the_slope_of_the_force(muscles):
    made, h = bundle(muscles), 1e-5
    c = np.linspace(0.0, 0.12, 13)
    slope = (made.law(3e5, c + h) - made.law(3e5, c - h)) / (2.0 * h)
    assert made.stiffness(3e5, c) == pytest.approx(slope, rel=1e-7)


@pytest.mark.parametrize("muscles", NUMBERS)
def test_bundle_volume_satisfies_virtual_work(muscles):
    """dV/dC is the force over the pressure, less the force of the empty muscle."""
    made, h = bundle(muscles), 1e-5
    c = np.linspace(0.0, 0.12, 13)
    rise = (made.volume(c + h) - made.volume(c - h)) / (2.0 * h)
    assert 2e5 * rise == pytest.approx(made.law(2e5, c) - made.law(0.0, c), rel=1e-6, abs=1e-6)


def test_volume_is_near_that_of_an_ideal_braid():
    """Threads of constant length on a cylinder: the fit deviates by a few per cent."""
    made = dataclasses.replace(bundle(1.0), line_volume=0.0)
    cosine = np.sqrt(1.0 / 3.0) / (1.0 - made.largest_contraction)
    c = np.linspace(0.0, made.reach, 9)
    turned = cosine * (1.0 - c / made.nominal_length)
    ideal = 0.25 * np.pi * made.diameter**2 * (1.0 - turned**2) * (made.nominal_length - c)
    assert made.volume(0.0) == pytest.approx(ideal[0], rel=1e-12)
    assert made.volume(c) == pytest.approx(ideal, rel=0.04)


def test_inverse_in_pressure_is_exact():
    made, p = bundle(3.0), np.linspace(0.0, 6e5, 7)
    assert made.pressure(made.factor(p)) == pytest.approx(p, abs=1e-6)


def test_bundle_kernels_equal_numpy():
    made = bundle(4.0)
    for c in (0.0, 0.03, 0.11):
        shape, slope = bundle_shape(c, made.nominal_length, made.reach)
        assert (shape, slope) == pytest.approx((float(made.shape(c)), float(made.slope(c))))
        grown = made.pressure_factor * grown_volume(c, made.nominal_length, made.reach)
        empty = bundle_volume(4.0, made.nominal_length, 0.28, made.diameter)
        assert empty + made.line_volume + grown == pytest.approx(float(made.volume(c)), rel=1e-12)
