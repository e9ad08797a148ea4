"""Correction of the static law and yielding friction of the muscles of a pair."""

import numpy as np
import pytest

from pam_envs.muscle.law_correction import FIELDS, NAMES, correction_force, correction_slope
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.rollout import simulate_joint

JOINT = AntagonisticJoint.paper("none").with_lag_alone()
TERMS = {f"muscle.{name}": 3.0 - 0.4 * k for k, name in enumerate(NAMES)}
CORRECTION = {"muscle.map_02": 4.0, "muscle.map_13": -3.0, "muscle.map_20": 6.0}
RANGE = {"muscle.map_least": 0.02, "muscle.map_strain": 0.2, "muscle.map_pressure": 5e5}
YIELDING = {
    "muscle.yield_force": 4.0,
    "muscle.yield_per_pressure": 1e-5,
    "muscle.yield_break": 0.01,
}


@pytest.mark.parametrize("strain", [0.05, 0.12, 0.2])
@pytest.mark.parametrize("pressure", [0.5e5, 2e5, 4e5])
def test_compiled_correction_is_that_of_the_law_and_its_slope_the_derivative(pressure, strain):
    law = JOINT.replace(TERMS | RANGE).muscle
    rows = np.array([[getattr(law, name)] for name in FIELDS])
    force = correction_force(rows, 0, 0, pressure, strain)
    assert force == pytest.approx(float(law.correction(pressure, strain)), rel=1e-9)
    low, high = (float(law.correction(pressure, strain + d)) for d in (-1e-6, 1e-6))
    slope = correction_slope(rows, 0, 0, pressure, strain)
    assert slope == pytest.approx((low - high) / 2e-6, rel=1e-6)


def test_joint_settles_where_the_corrected_torques_balance_the_weight():
    plant = JOINT.replace(CORRECTION | RANGE)
    pressures = np.full(400, 3e5), np.full(400, 1.5e5)
    angle, plain = (
        simulate_joint(p, pressures=pressures, compiled=False)["angle"][-1] for p in (plant, JOINT)
    )
    assert abs(angle - plain) > 1e-3
    missing = float(plant.torque(angle, 3e5, 1.5e5)) - float(plant.weight_torque(angle, 0.0))
    assert missing == pytest.approx(0.0, abs=1e-3)


def test_yielding_friction_opposes_the_motion_of_the_joint():
    ramp = np.concatenate([np.linspace(1e5, 3e5, 300), np.linspace(3e5, 1e5, 300)])
    pressures = ramp, np.full(600, 2e5)

    def gap(changes):
        made = simulate_joint(JOINT.replace(changes), pressures=pressures, compiled=False)
        up, down = made["angle"][:300], made["angle"][300:][::-1]
        return float(np.median((down - up)[100:200]))

    assert gap(YIELDING) > gap({}) + 0.005
