"""Linear models of plants against the plants themselves, and against known poles."""

import sys
from typing import Any

import numpy as np
import pytest

from pam_envs.plants import (
    AntagonisticJoint,
    ElbowOrthosis,
    KneeOrthosis,
    RedundantManipulator,
    SingleMuscle,
)
from pam_envs.plants.antagonistic_joint.rollout import simulate_joint
from pam_envs.plants.core import linearise as lin
from pam_envs.plants.elbow_orthosis.rollout import simulate_elbow
from pam_envs.plants.knee_orthosis.rollout import simulate_knee
from pam_envs.plants.single_muscle.rollout import simulate

control = pytest.importorskip("control")
KINDS = ("none", "maxwell_slip", "preisach")
PERIOD, REST, AFTER = 0.01, 150, 60
"""Control period [s], and periods before and after a small step."""


def response(model: Any, size: float, output: str, command: str) -> Any:
    """Return the linear model's response to a step at the end of each control period."""
    time = PERIOD * np.arange(AFTER + 1)
    one = model[model.find_output(output), model.find_input(command)]
    return size * control.step_response(one, time).outputs[1:]


def near(found: Any, linear: Any, part: float) -> None:
    """Compare two responses to within a part of the largest deviation."""
    assert np.max(np.abs(found - linear)) < part * np.max(np.abs(linear))


@pytest.mark.parametrize("kind", KINDS)
def test_small_step_of_the_single_muscle_follows_the_linear_model(kind: str) -> None:
    plant = SingleMuscle.mas10(kind, mass__load=2.55, regulator__dead_time=0.0)
    model, size = plant.linearise(pressure=3e5), 2e3
    found = simulate(plant, np.array([3e5] * REST + [3e5 + size] * AFTER))["contraction"]
    near(found[REST:] - found[REST - 1], response(model, size, "contraction", "set_point"), 0.03)


def test_static_gain_of_the_single_muscle_is_that_of_its_static_law() -> None:
    plant = SingleMuscle.mas10("none")
    gain = control.dcgain(plant.linearise(pressure=3e5, load=4.55))[0, 0]
    ends = plant.contraction_at(np.array([2.99e5, 3.01e5]), 4.55)
    assert gain == pytest.approx((ends[1] - ends[0]) / 2e3, rel=1e-4)


def test_branch_after_a_turn_is_flatter_than_the_branch_of_loading() -> None:
    plant = SingleMuscle.mas10("maxwell_slip")
    loading, turned = (
        control.dcgain(plant.linearise(pressure=3e5, branch=b))[0, 0] for b in ("loading", "turned")
    )
    assert 0.0 < turned < 0.8 * loading


@pytest.mark.parametrize("kind", KINDS)
def test_small_step_of_the_knee_follows_the_linear_model(kind: str) -> None:
    plant, size = KneeOrthosis.no_load(kind).with_lag_alone(), 1e3
    steps = np.array([2e5] * REST + [2e5 + size] * AFTER)
    found = simulate_knee(plant, steps, pressure=2e5)["angle"]
    near(
        found[REST:] - found[REST - 1],
        response(plant.linearise(pressure=2e5), size, "angle", "set_point"),
        0.03,
    )


def test_knee_has_the_pole_of_its_regulator_or_the_published_ones() -> None:
    plant = KneeOrthosis.rig()
    poles = plant.linearise().poles()
    np.testing.assert_allclose(poles, [-1.0 / plant.regulator.time_constant], rtol=1e-6)
    measured = KneeOrthosis.rig(dynamics="measured").linearise()
    published = [np.roots([1.0, 8.11, 17.12]), np.roots([1.0, 17.97, 78.51]), [-12.33]]
    for pole in np.concatenate(published):
        assert np.min(np.abs(measured.poles() - pole)) < 1e-3
    assert measured.dcgain()[2, 0] == pytest.approx(1.0, rel=1e-6)


def test_joint_has_real_poles_near_23_per_second() -> None:
    model = AntagonisticJoint.paper("none", link__gravity=0.0).linearise(inputs="angle")
    poles = np.sort(model.poles().real)[::-1]
    np.testing.assert_allclose(poles[:3], [-23.0, -23.0, -24.9], rtol=0.01)
    assert model.dcgain()[0, 0] == pytest.approx(1.0, rel=1e-5)
    reduced = AntagonisticJoint.reduced("none", link__gravity=0.0).linearise()
    np.testing.assert_allclose(reduced.poles(), [-23.0, -23.0], rtol=1e-5)


def test_small_step_of_the_joint_follows_the_linear_model() -> None:
    plant, size = AntagonisticJoint.paper("none").with_lag_alone(), 0.002
    model = plant.linearise(angle=0.1, inputs="angle")
    start = 0.1 + float(plant.gravity_shift(np.array([0.1]))[0])
    found = simulate_joint(plant, np.array([start] * REST + [start + size] * AFTER))["angle"]
    near(found[REST:] - found[REST - 1], response(model, size, "angle", "command"), 0.05)


def test_small_step_of_the_elbow_follows_the_linear_model() -> None:
    plant, size = ElbowOrthosis.paper("none").with_lag_alone(), 500.0
    angle = float(plant.pulley.middle)
    low, high = [(2e5, 2e5)] * REST, [(2e5, 2e5 + size)] * AFTER
    found = simulate_elbow(plant, np.array(low + high), intent=angle)["angle"]
    model = plant.linearise(angle=float(found[REST - 1]), pressures=(2e5, 2e5))
    near(found[REST:] - found[REST - 1], response(model, size, "angle", "set_point_b"), 0.03)


def test_arm_of_one_joint_is_the_joint() -> None:
    plant = RedundantManipulator.paper("none")
    model = plant.linearise(inputs="angle")
    assert model.nstates == 4 * plant.stages and model.ninputs == 2 * plant.stages
    assert np.all(model.poles().real < 0.0)
    assert np.count_nonzero(np.abs(model.poles() + 23.4) < 1.0) >= 1


def test_linearised_plant_gives_a_stabilising_regulator() -> None:
    code = (lin.__doc__ or "").split("::\n")[1].split("\n\nA family")[0]
    space: dict[str, Any] = {}
    exec("\n".join(line.strip() for line in code.strip().splitlines()), space)
    model, gain = space["model"], space["gain"]
    assert model.state_labels == ["pressure", "contraction", "velocity"]
    assert np.all(space["poles"].real < 0.0) and gain.shape == (1, 3)
    rest = np.array([3e5, 0.01, 0.0])
    assert float(space["set_point"](rest, rest)[0]) == 3e5


def test_missing_package_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(ModuleNotFoundError, match="baselines"):
        SingleMuscle.mas10().linearise()


def test_effects_and_points_out_of_reach_are_refused() -> None:
    with pytest.raises(ValueError, match="effects are on"):
        SingleMuscle.mas10(regulator__leak=0.1).linearise()
    with pytest.raises(ValueError, match="between 0 and"):
        SingleMuscle.mas10().linearise(pressure=7e5)
    with pytest.raises(ValueError, match="out of reach"):
        AntagonisticJoint.paper().linearise(angle=0.6, prestress=100.0, payload=5.0)
    with pytest.raises(ValueError, match="proportional"):
        ElbowOrthosis.paper(valves="on_off").linearise()
    with pytest.raises(ValueError, match="loading"):
        SingleMuscle.mas10().linearise(branch="middle")
