"""Static load check of the muscles against simulation."""

import math

import numpy as np
import pytest

from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.rollout import simulate_joint
from pam_envs.plants.antagonistic_joint.statics import UnbearableLoad, bearable_payload, check_borne
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.plants.redundant_manipulator.rollout import simulate_manipulator

MAKES = (AntagonisticJoint.paper("none"), AntagonisticJoint.reduced("none"))


@pytest.mark.parametrize("plant", MAKES)
def test_largest_setpoint_holds_exactly_the_bearable_payload(plant: AntagonisticJoint) -> None:
    angle = math.radians(24.0)
    most = bearable_payload(plant, [[angle]])
    assert 0.5 < most < 10.0
    for payload, less in ((0.97 * most, False), (1.03 * most, True)):
        made = simulate_joint(plant, [plant.link.limit], payload=payload, quasi_static=True)
        assert (made["angle"][0] < angle) == less


def test_free_pressures_bear_more_payload() -> None:
    plant, angles = AntagonisticJoint.measured("none"), np.array([[0.0], [0.2], [-0.35]])
    least, largest = plant.torque_range(angles)
    lowest, highest = plant.torque_range(angles, by_pressure=True)
    assert (lowest < least).all() and (highest > largest).all()
    assert bearable_payload(plant, angles, by_pressure=True) > bearable_payload(plant, angles)
    assert np.allclose(highest, plant.torque(angles, 6.5e5, 0.0))


def test_bearable_payload_of_an_arm_is_that_of_its_weakest_joint() -> None:
    arm = RedundantManipulator.paper("none")
    bent = np.radians([[5.0, -4.0, -26.0, 3.0, -8.0, 6.0], [4.0, -3.0, -20.0, 3.0, -7.0, 6.0]])
    most = bearable_payload(arm, bent)
    check_borne(arm, bent, 0.999 * most, "the plan")
    with pytest.raises(UnbearableLoad, match=r"the plan, pose 0: with .* joint 2 needs"):
        check_borne(arm, bent, 1.001 * most, "the plan")
    held = np.sign(bent[:1]) * arm.link.limit
    pressed = simulate_manipulator(arm, held, payload=0.999 * most)
    least, largest = arm.torque_range(pressed["angle"])
    weight = arm.weight_torque(pressed["angle"], 0.999 * most)
    assert np.allclose(np.where(held < 0.0, least, largest), weight, atol=1e-6)


def test_bearable_payload_is_negative_if_the_empty_arm_is_unbearable() -> None:
    heavy = RedundantManipulator.paper("none", arm__mass_factor=5.0)
    bent = np.radians([[28.0, -28.0, 28.0, -28.0, 28.0, -28.0]])
    assert bearable_payload(heavy, bent) < 0.0
    with pytest.raises(UnbearableLoad, match="lighter links"):
        check_borne(heavy, bent, 0.0, "the plan")
