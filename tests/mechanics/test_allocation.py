"""Allocation to two bundles: exact inside the feasible set, torque first outside."""

import itertools
import math

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from pam_envs.mechanics.allocation import (
    allocate,
    determinant,
    factors_for,
    stiffness_of,
    torque_of,
)

RADIUS, LENGTH = 0.0315, 0.39
MOST = 0.28 * LENGTH
STROKE = math.radians(120.0)
ANGLES = np.linspace(0.0, STROKE, 25)


def shapes(angle: float, most: float = MOST) -> tuple[float, float, float, float]:
    """Return phi_a, phi_b, psi_a, psi_b of chakarov2018's elbow, Eqs. 8, 9, 11 to 14."""
    contractions = (RADIUS * (STROKE - angle), RADIUS * angle)
    phi = [(LENGTH - c) * (most - c) for c in contractions]
    psi = [2.0 * c - LENGTH - most for c in contractions]
    return (*phi, *psi)


def factor(muscles: int, pressure: float) -> float:
    """Return k_0 + k_1 p [N/m^2] of a bundle at a pressure [Pa]."""
    return (-39.0 + 321.0 * muscles) + (-0.21 + 4.41 * muscles) * 1e-3 * pressure


BOX = (factor(3, 0.0), factor(3, 6e5), factor(7, 0.0), factor(7, 6e5))


def given(x_a: float, x_b: float, angle: float) -> tuple[float, float]:
    phi_a, phi_b, psi_a, psi_b = shapes(angle)
    return (
        torque_of(x_a, x_b, RADIUS, phi_a, phi_b),
        stiffness_of(x_a, x_b, RADIUS, psi_a, psi_b),
    )


def allocated(torque: float, stiffness: float, angle: float) -> tuple[float, float]:
    return allocate(torque, stiffness, RADIUS, *shapes(angle), *BOX)


def targets(number: int) -> list[tuple[float, float, float]]:
    """Return torques, stiffnesses and angles, most of them out of reach."""
    random = np.random.default_rng(4)
    drawn = random.uniform((-15.0, -2.0, 0.0), (35.0, 18.0, STROKE), (number, 3))
    return [tuple(row) for row in drawn.tolist()]


def test_stiffness_is_the_slope_of_the_torque():
    h = 1e-6
    for angle, (a, b) in itertools.product(ANGLES, itertools.product(BOX[:2], BOX[2:])):
        slope = (given(a, b, angle + h)[0] - given(a, b, angle - h)[0]) / (2.0 * h)
        assert given(a, b, angle)[1] == pytest.approx(-slope, abs=1e-6)


def test_determinant_is_positive_over_the_whole_range():
    fine = np.linspace(0.0, STROKE, 2401)
    values = np.array([determinant(*shapes(angle)) for angle in fine])
    assert values.min() > 0.015
    beyond = MOST / RADIUS + 0.01  # where bundle b is contracted beyond its range
    assert determinant(*shapes(beyond)) < values.min()


@pytest.mark.parametrize("muscles", [(1, 1), (2, 5), (3, 7), (7, 3)])
def test_allocation_inverts_torque_and_stiffness_to_1e_9(muscles):
    low_a, high_a = (factor(muscles[0], p) for p in (0.0, 6e5))
    low_b, high_b = (factor(muscles[1], p) for p in (0.0, 6e5))
    for angle, share_a, share_b in itertools.product(ANGLES, *2 * [np.linspace(0.0, 1.0, 9)]):
        a, b = low_a + share_a * (high_a - low_a), low_b + share_b * (high_b - low_b)
        torque, stiffness = given(a, b, angle)
        back = factors_for(torque, stiffness, RADIUS, *shapes(angle))
        assert back == pytest.approx((a, b), rel=1e-9)
        held = allocate(torque, stiffness, RADIUS, *shapes(angle), low_a, high_a, low_b, high_b)
        assert held == pytest.approx((a, b), rel=1e-9)
        assert given(*held, angle) == pytest.approx((torque, stiffness), abs=1e-9)


def test_torque_comes_first_and_reachable_targets_are_met_within_pressure_limits():
    within = 0
    for torque, stiffness, angle in targets(1500):
        a, b = allocated(torque, stiffness, angle)
        assert BOX[0] <= a <= BOX[1] and BOX[2] <= b <= BOX[3]
        phi_a, phi_b, _, _ = shapes(angle)
        lowest = torque_of(BOX[1], BOX[2], RADIUS, phi_a, phi_b)
        highest = torque_of(BOX[0], BOX[3], RADIUS, phi_a, phi_b)
        found = given(a, b, angle)
        assert found[0] == pytest.approx(min(max(torque, lowest), highest), abs=1e-9)
        x_a, x_b = factors_for(torque, stiffness, RADIUS, *shapes(angle))
        if BOX[0] <= x_a <= BOX[1] and BOX[2] <= x_b <= BOX[3]:
            within += 1
            assert found == pytest.approx((torque, stiffness), abs=1e-9)
    assert 100 < within < 750


def test_no_other_pressures_with_the_torque_are_closer_to_the_stiffness():
    """Against a search along the line of equal torque."""
    for torque, stiffness, angle in targets(100):
        a, b = allocated(torque, stiffness, angle)
        phi_a, phi_b, psi_a, psi_b = shapes(angle)
        held, found = given(a, b, angle)
        line = np.linspace(BOX[0], BOX[1], 20001)
        other = (held / RADIUS + phi_a * line) / phi_b
        allowed = (other >= BOX[2]) & (other <= BOX[3])
        offered = -(RADIUS**2) * (psi_a * line + psi_b * other)[allowed]
        if allowed.any():
            assert abs(found - stiffness) <= np.abs(offered - stiffness).min() + 1e-9


def test_allocation_equals_bounded_least_squares_with_all_weight_on_the_torque():
    for torque, stiffness, angle in targets(200):
        phi_a, phi_b, psi_a, psi_b = shapes(angle)
        weights = np.array([1e4, 1.0])
        rows = np.array(
            [[-RADIUS * phi_a, RADIUS * phi_b], [-(RADIUS**2) * psi_a, -(RADIUS**2) * psi_b]]
        )
        scale = np.array([BOX[1], BOX[3]])  # so that the solver works on numbers near 1
        solved = lsq_linear(
            weights[:, None] * rows * scale,
            weights * np.array([torque, stiffness]),
            bounds=(np.array([BOX[0], BOX[2]]) / scale, np.array([BOX[1], BOX[3]]) / scale),
            method="bvls",
            tol=1e-15,
        )
        best = given(*(solved.x * scale), angle)
        assert given(*allocated(torque, stiffness, angle), angle) == pytest.approx(best, abs=1e-4)


def test_corners_of_the_reachable_set_map_to_corners():
    for angle, (a, b) in itertools.product(ANGLES, itertools.product(BOX[:2], BOX[2:])):
        assert allocated(*given(a, b, angle), angle) == pytest.approx((a, b), rel=1e-9)


@pytest.mark.parametrize(("share", "areas"), [(0.28, (104.0, 105.9)), (0.33, (137.0, 139.0))])
def test_area_of_the_reachable_set(share, areas):
    """At 20 and 60 degrees, with the largest contraction of 28 % and of the printed 33 %."""
    spans = (BOX[1] - BOX[0]) * (BOX[3] - BOX[2])
    for degrees, area in zip((20, 60), areas, strict=True):
        shape = shapes(math.radians(degrees), share * LENGTH)
        assert RADIUS**3 * determinant(*shape) * spans == pytest.approx(area, abs=0.1)
