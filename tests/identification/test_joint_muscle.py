"""One muscle of a joint under a load has asymmetric hysteresis, its joint symmetric."""

import numpy as np
import pytest

from benchmarks.papers.joint_hysteresis import verdicts
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.identification.joint_forc import CONGRUENCY, SYMMETRY
from pam_envs.identification.joint_muscle import HangingMuscle
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint


def test_joint_passes_the_symmetry_test_and_one_muscle_fails_it():
    found = verdicts()
    for name in ("paper joint", "measured joint"):
        assert found[name].verdict.startswith("passes as a symmetric Preisach operator")
        assert found[name].symmetry < 0.5 * SYMMETRY
        assert found[name].model.start == "virgin"
    single = found["one DMSP-10 under 100 N"]
    assert single.verdict.startswith("fails the symmetry")
    assert single.symmetry > 5.0 * SYMMETRY
    assert single.congruency < CONGRUENCY  # a Preisach operator still, though no symmetric one
    assert single.model.start == "low"


def test_joints_pass_with_either_hysteresis_and_unequal_muscles_do_not():
    from pam_envs.identification.joint_forc import measure_joint

    for joint in (AntagonisticJoint.paper("preisach"), AntagonisticJoint.measured("preisach")):
        assert measure_joint(joint.rest_angles, joint.angle_range[1]).verdict.startswith("passes")
    uneven = AntagonisticJoint.paper(muscle__imbalance=0.05)
    assert not measure_joint(uneven.rest_angles, uneven.angle_range[1]).symmetric


def test_muscle_at_rest_balances_its_load():
    """Force of the law less friction, computed with separate plays."""
    joint = AntagonisticJoint.paper("maxwell_slip")
    operator, hysteresis = joint.hysteresis.operator, joint.hysteresis
    assert isinstance(operator, PlayOperator)
    pressures = 1e5 * np.array([2.0, 6.0, 3.0, 4.5, 1.0, 6.5])
    found = HangingMuscle(joint, load=80.0).rest_contractions(pressures)
    start = float(joint.lever.contraction(0.0, joint.muscle.rest_length)[0])
    lag = (found - start) - operator.simulate(found - start)[0]
    force = (
        joint.muscle.law(pressures, found) - (hysteresis.base + hysteresis.rate * pressures) * lag
    )
    np.testing.assert_allclose(force, 80.0, atol=1e-6)
    without = HangingMuscle(joint.replace({"hysteresis.width": 0.0}), load=80.0)
    bare = without.rest_contractions(pressures)
    np.testing.assert_allclose(joint.muscle.law(pressures, bare), 80.0, atol=1e-6)
    assert np.all((found < bare)[[1, 3, 5]]) and np.all((found > bare)[[2, 4]])


@pytest.mark.parametrize(
    "joint", [AntagonisticJoint.reduced(), AntagonisticJoint.paper("none")], ids=["reduced", "none"]
)
def test_plant_without_hysteresis_of_its_muscles_is_refused(joint):
    with pytest.raises(ValueError, match="has no muscle with hysteresis"):
        HangingMuscle(joint)
