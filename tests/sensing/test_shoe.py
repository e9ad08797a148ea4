"""Pressure shoe: load on the heel and Eq. (1)."""

import math

import pytest

from pam_envs.constants import GRAVITY
from pam_envs.sensing.shoe import HEEL_CELLS, Shoe, estimated_torque, heel_load


def test_cells_of_heel_and_tip_carry_the_force_and_its_moment():
    shoe, force, cop = Shoe(), 700.0, 0.07
    heel = heel_load(force, cop, shoe.heel, shoe.tip) * GRAVITY * HEEL_CELLS
    tip = force - heel
    assert heel * shoe.heel + tip * shoe.tip == pytest.approx(force * cop)


def test_lifted_foot_loads_no_cell():
    assert heel_load(0.0, -0.05, -0.05, 0.22) == 0.0
    assert heel_load(700.0, 0.25, -0.05, 0.22) == 0.0
    assert heel_load(-3.0, 0.0, -0.05, 0.22) == 0.0


def test_estimated_torque_equals_equation_1():
    """q_a counts from the horizontal foot: its cosine is the sine of the shank's lean."""
    q_a = math.radians(70.0)
    lean = math.pi / 2 - q_a
    printed = 650.0 * (0.43 * math.cos(q_a) - 0.05)
    assert estimated_torque(650.0, 0.05, math.sin(lean), 0.43) == pytest.approx(printed)
