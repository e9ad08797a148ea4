"""Closed cycles of pressure and position give out no energy with friction driven by length."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.energy import CASES
from pam_envs.plants import AntagonisticJoint, ElbowOrthosis, KneeOrthosis, SingleMuscle
from pam_envs.plants.antagonistic_joint.rollout import simulate_joint
from pam_envs.plants.elbow_orthosis.rollout import simulate_elbow
from pam_envs.plants.knee_orthosis.rollout import simulate_knee
from pam_envs.plants.single_muscle.replay import Inputs, replay
from pam_envs.plants.single_muscle.rollout import simulate

PASSIVE = ("maxwell_slip_length", "preisach_length")
CYCLES, EXAMPLES = 200, 10


@pytest.mark.parametrize("kind", PASSIVE)
@pytest.mark.parametrize("family", CASES)
@settings(max_examples=EXAMPLES, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_net_work_of_a_closed_cycle_is_not_positive(family: str, kind: str, seed: int) -> None:
    assert CASES[family].work(kind, CYCLES, seed).worst < 1e-3


@pytest.mark.parametrize("kind", ["maxwell_slip", "preisach"])
@pytest.mark.parametrize(
    ("family", "least"),
    [("single muscle", 0.5), ("knee orthosis", 0.2), ("elbow orthosis", 0.001)],
)
def test_papers_forms_create_energy(family: str, kind: str, least: float) -> None:
    assert CASES[family].work(kind, 2000, 1).worst > least


def test_cycle_without_hysteresis_gives_out_nothing() -> None:
    for family, case in CASES.items():
        found = case.work("none", CYCLES, 2)
        assert np.abs(found.net / found.stroke).max() < 1e-3, family


def test_load_step_at_constant_pressure_lengthens_the_muscle() -> None:
    """At every pressure of the published readings, on both branches."""
    plant, ramp = SingleMuscle.mas10("preisach_length"), np.linspace(0.0, 6e5, 13)
    for peak in (0.0, 6e5):
        for pressure in ramp:
            command = np.repeat([peak, pressure, pressure], 200)
            load = np.repeat([2.55, 2.55, 4.55], 200)
            fresh = np.zeros(600, bool)
            fresh[0] = True
            inputs = Inputs(
                0.01, command, load, np.full(600, 293.15), fresh, np.zeros(600), ~fresh & False
            )
            x = replay(plant, inputs)["contraction"]
            assert x[-1] < x[399] - 1e-5


@pytest.mark.parametrize("kind", PASSIVE)
def test_slow_inflation_ends_where_the_identification_says(kind: str) -> None:
    plant = SingleMuscle.mas10(kind)
    pressures = np.concatenate([np.linspace(0.0, 6e5, 25)[1:], np.linspace(6e5, 0.0, 13)[1:]])
    operator = plant.operator_at(plant.mass.load)
    expected = plant.contraction_at(operator.simulate(pressures)[0], plant.mass.load)  # type: ignore[union-attr]
    made = simulate(plant, np.repeat(pressures, 100))["contraction"][99::100]
    np.testing.assert_allclose(made, expected, atol=3e-5)


@pytest.mark.parametrize("kind", ("maxwell_slip", "preisach", *PASSIVE))
def test_torque_of_the_joint_is_that_of_imposed_muscles(kind: str) -> None:
    plant = AntagonisticJoint.paper(kind, muscle__viscosity=0.0)
    t = np.arange(150) / 50.0
    made = simulate_joint(plant, 0.3 * np.sin(2.0 * t) * np.minimum(1.0, t), compiled=False)
    muscles = plant.imposed_muscles(1)
    check_torques(muscles, made["angle"], (made["pressure_a"], made["pressure_b"]), made["torque"])


@pytest.mark.parametrize("kind", PASSIVE)
def test_torque_of_the_elbow_is_that_of_imposed_bundles(kind: str) -> None:
    plant = ElbowOrthosis.paper(kind)
    swing = 1e5 * np.sin(np.arange(150) / 25.0)
    commands = np.stack([2e5 + swing, 2e5 - swing], axis=1)
    made = simulate_elbow(plant, commands, compiled=False)
    muscles = plant.imposed_muscles(1)
    # from the middle of the range to the start, as a lane begins
    _, state = muscles.force(np.full((2, 1), 2e5), made["angle"][:1], muscles.state)
    pressures = made["pressure_a"], made["pressure_b"]
    check_torques(muscles, made["angle"], pressures, made["torque"], state)


@pytest.mark.parametrize("kind", PASSIVE)
def test_free_brace_has_the_loops_of_the_papers_operator(kind: str) -> None:
    """Angles on inflation and deflation differ as with the identified hysteresis of pressure."""
    ramp = np.linspace(0.0, 4.5e5, 46)
    slow = np.repeat(np.concatenate([ramp, ramp[-2::-1], ramp[1:]]), 12)
    gaps = []
    for name in ("maxwell_slip", kind):
        angle = simulate_knee(KneeOrthosis.no_load(name), slow, compiled=False)["angle"][11::12]
        gaps.append(np.degrees(angle[90:] - angle[45:91][::-1])[[10, 20, 30, 40]])
    np.testing.assert_allclose(gaps[1], gaps[0], atol=1.3)


def check_torques(
    muscles: Any, angle: np.ndarray, pressures: Any, torque: np.ndarray, state: Any = None
) -> None:
    """Compare torques of a rollout with those of muscles at its pressures and angles."""
    state = muscles.state if state is None else state
    for k in range(len(angle)):
        p = np.array([[p[k]] for p in pressures])
        found, state = muscles.force(p, angle[k : k + 1], state)
        assert float(found[0]) == pytest.approx(torque[k], abs=2e-2)
