"""Pulley of the elbow: stroke, virtual work, stops."""

import numpy as np
import pytest

from pam_envs.mechanics.pulley import Pulley, contraction_of, stop_torque

ANGLES = np.radians([0.0, 20.0, 60.0, 120.0])


def test_stroke_equals_the_published_pre_tension():
    pulley = Pulley()
    assert pulley.stroke == pytest.approx(0.066, abs=5e-5)
    assert 100.0 * pulley.stroke / 0.39 == pytest.approx(16.9, abs=0.05)
    c_a, c_b = pulley.contractions(ANGLES)
    assert c_a + c_b == pytest.approx(pulley.stroke)


def test_pulley_torque_satisfies_virtual_work():
    pulley, h = Pulley(), 1e-6
    forces = np.array([120.0, 310.0])
    for angle in ANGLES:
        up, down = pulley.contractions(angle + h), pulley.contractions(angle - h)
        work = forces @ (np.array(up) - np.array(down)) / (2.0 * h)
        assert float(pulley.torque(*forces)) == pytest.approx(work, rel=1e-9)


def test_pulley_kernel_equals_numpy():
    pulley = Pulley(lowest=0.1)
    for angle in ANGLES:
        made = [
            contraction_of(angle, s, pulley.radius, pulley.lowest, pulley.highest) for s in (-1, 1)
        ]
        assert made == pytest.approx([float(c) for c in pulley.contractions(angle)])
    assert float(pulley.travel(pulley.middle)) == 0.0


def test_stops_act_only_beyond_the_range():
    for angle in (0.0, 1.0, 2.0):
        assert stop_torque(angle, 0.0, 2.0, 300.0) == (0.0, 0.0)
    assert stop_torque(2.1, 0.0, 2.0, 300.0) == pytest.approx((-30.0, 300.0))
    assert stop_torque(-0.1, 0.0, 2.0, 300.0) == pytest.approx((30.0, 300.0))
