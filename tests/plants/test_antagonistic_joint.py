"""The antagonistic joint at rest: virtual work, symmetry, feedforward, reach, loops, files."""

import dataclasses
import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import nnls

from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.hysteresis.preisach import Preisach
from pam_envs.plants.antagonistic_joint.hysteresis import contraction_plays, joint_hysteresis
from pam_envs.plants.antagonistic_joint.pair import feed_forward
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.rollout import simulate_joint

PRESETS = ("paper", "measured", "reduced")
ANGLES = np.radians(np.linspace(-28.0, 28.0, 29))
MADE = (AntagonisticJoint.paper("none"), AntagonisticJoint.measured("none"))


KINDS = ("maxwell_slip", "preisach", "maxwell_slip_length", "preisach_length")


def half_gap(plant: AntagonisticJoint, degrees: float) -> float:
    """Half the height of a settled loop at setpoint 0, over its amplitude."""
    phase = np.linspace(0.0, 4.5 * np.pi, 181)
    rests = np.degrees(plant.rest_angles(np.radians(degrees) * np.sin(phase)))
    up, down = rests[[80, 160]].mean(), rests[120]  # half way up twice, half way down between
    return float(down - up) / 2.0 / degrees


def muscle_under_load(plant: AntagonisticJoint, pressures: np.ndarray) -> np.ndarray:
    """Contractions of one muscle that carries 100 N, at rest after each pressure [Pa]."""
    plays, hysteresis = contraction_plays(), joint_hysteresis("maxwell_slip")
    start = float(plant.lever.contraction(0.0, plant.muscle.rest_length)[0])
    state, made = plays.initial_state(), []
    for p in pressures:
        low, high = -0.1, 0.4
        for _ in range(45):
            x = 0.5 * (low + high)
            felt, after = plays.step(x - start, state)
            friction = (hysteresis.base + hysteresis.rate * p) * (x - start - float(felt))
            if float(plant.muscle.law(p, x)) - friction > 100.0:
                low = x
            else:
                high = x
        state = after
        made.append(x)
    return np.array(made)


# --- forces and work -----------------------------------------------------------------------------


@pytest.mark.parametrize("plant", MADE)
def test_the_torque_is_minus_the_slope_of_the_muscles_work(plant: AntagonisticJoint) -> None:
    """Work at held pressures, integrated over the lengths, with no formula of the torque."""
    p_a, p_b, fine = 4.1e5, 2.3e5, np.radians(np.linspace(-25.0, 25.0, 20001))
    x = plant.lever.contraction(fine, plant.muscle.rest_length)
    forces = plant.muscle.force(np.array([p_a, p_b]), x)
    steps = 0.5 * (forces[1:] + forces[:-1]) * np.diff(plant.lever.length(fine), axis=0)
    energy = np.concatenate([[0.0], np.cumsum(steps.sum(axis=1))])
    slope = np.gradient(energy, fine)[1:-1]
    torque = plant.torque(fine[1:-1], p_a, p_b)
    # a muscle that slackens in between leaves a kink, which the difference quotient rounds off
    assert np.abs(torque + slope).max() < 1e-4 * np.abs(torque).max()
    assert np.median(np.abs(torque + slope)) < 1e-7


@pytest.mark.parametrize("plant", MADE)
def test_exchanging_the_pressures_mirrors_the_joint(plant: AntagonisticJoint) -> None:
    there, back = plant.torque(ANGLES, 5e5, 2e5), plant.torque(-ANGLES, 2e5, 5e5)
    assert np.allclose(there, -back, atol=1e-12)
    assert plant.torque(0.0, 3e5, 3e5) == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize("plant", MADE)
def test_forces_have_the_given_co_contraction_and_torque(
    plant: AntagonisticJoint,
) -> None:
    angles, torques = ANGLES[:, None] * 0.7, np.array([-0.5, 0.0, 0.8])
    a, b = plant.forces_for(angles, 50.0, torques)
    assert np.allclose(a + b, 100.0)
    p_a, p_b, short = plant.pressures_for(angles, 50.0, torques)
    assert not short.any()
    assert np.allclose(plant.torque(angles, p_a, p_b), np.broadcast_to(torques, a.shape), atol=1e-9)


# --- feedforward and reach ----------------------------------------------------------------------


@pytest.mark.parametrize("plant", MADE)
def test_feedforward_has_gain_one_without_hysteresis_and_load(
    plant: AntagonisticJoint,
) -> None:
    low, high = plant.angle_range
    commands = np.linspace(low, high, 21)
    for prestress in (20.0, 50.0, 100.0):
        assert np.allclose(plant.rest_angles(commands, prestress), commands, atol=1e-9)


@pytest.mark.parametrize("plant", MADE)
def test_kernel_feedforward_equals_that_of_the_plant(plant: AntagonisticJoint) -> None:
    fixed = plant.parameter_rows()[:, None].tolist()
    for angle in np.linspace(*plant.angle_range, 13):
        for prestress in (20.0, 50.0, 120.0):
            p_a, p_b, short = feed_forward(fixed, 0, float(angle), prestress)
            desired = plant.pressures_for(angle, prestress)
            assert (p_a, p_b) == pytest.approx((float(desired[0]), float(desired[1])), rel=1e-9)
            assert bool(short) == bool(desired[2]) is False


def test_set_point_out_of_reach_is_reported() -> None:
    plant = AntagonisticJoint.measured("none", link__limit=0.5)
    fixed = plant.parameter_rows()[:, None].tolist()
    assert feed_forward(fixed, 0, 0.49, 50.0)[2] == 1.0  # no force is left at 28 degrees
    assert bool(plant.pressures_for(0.49)[2])
    assert feed_forward(fixed, 0, 0.51, 50.0)[2] == 1.0  # beyond the limit
    assert feed_forward(fixed, 0, 0.3, 50.0)[2] == 0.0


def test_full_pressure_reaches_thirty_degrees_only_with_the_stretched_map() -> None:
    paper, measured = MADE
    floating = {"link.gravity": 0.0}
    assert math.degrees(paper.replace(floating).reachable_angle(0.0)) == pytest.approx(
        30.0, abs=0.1
    )
    found = math.degrees(measured.replace(floating).reachable_angle(0.0))
    assert found == pytest.approx(24.0, abs=0.1)


def test_the_measured_joint_is_limited_by_preload_weight_and_pressure() -> None:
    plant = AntagonisticJoint.measured("none")
    assert plant.link.limit == pytest.approx(plant.reachable_angle())
    assert math.degrees(plant.link.limit) == pytest.approx(21.9, abs=0.05)
    assert plant.reachable_angle(80.0) < plant.link.limit
    assert plant.reachable_angle(payload=0.5) < plant.link.limit
    low = plant.replace({"regulator.max_pressure": 5e5})
    assert low.reachable_angle() < plant.link.limit
    angle = plant.link.limit
    a, b = plant.forces_for(angle, 50.0, plant.weight_torque(angle))
    x = plant.lever.contraction(angle, plant.muscle.rest_length)
    assert max(plant.muscle.pressure(np.array([a, b]), x)) == pytest.approx(6.5e5, rel=1e-9)


def test_gravity_shift_compensates_the_weight() -> None:
    plant = AntagonisticJoint.paper("none")
    angles = np.radians([[-20.0], [5.0], [18.0]])
    commands = angles + plant.gravity_shift(angles, np.array([0.0, 0.5, 0.2]))
    for angle, command, payload in zip(angles, commands, (0.0, 0.5, 0.2), strict=True):
        rests = simulate_joint(plant, command, payload=payload, quasi_static=True)["angle"]
        assert float(rests[0]) == pytest.approx(float(angle[0]), abs=1e-9)


def test_co_contraction_reduces_the_stiffness_of_this_lever() -> None:
    """The muscles' lengths do not add up to a constant: equal forces buckle the joint."""
    stiffness = [float(AntagonisticJoint.paper("none").stiffness_at(0.0, f)) for f in (20, 50, 120)]
    assert stiffness == pytest.approx([16.1, 14.8, 11.6], abs=0.05)
    assert AntagonisticJoint().nominal.stiffness == pytest.approx(stiffness[1], abs=0.05)


# --- hysteresis ----------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_loops_have_a_half_gap_of_a_tenth(kind: str) -> None:
    plant = AntagonisticJoint.paper(kind)
    assert [half_gap(plant, a) for a in (15.0, 20.0)] == pytest.approx([0.1, 0.1], abs=0.005)
    assert [half_gap(plant, a) for a in (10.0, 29.0)] == pytest.approx([0.08, 0.08], abs=0.01)
    assert half_gap(AntagonisticJoint.paper("none"), 15.0) < 1e-9
    assert half_gap(AntagonisticJoint.paper(kind, hysteresis__width=0.5), 15.0) < 0.07


@pytest.mark.parametrize("kind", KINDS)
def test_the_gain_after_a_turn_is_that_of_the_published_uncertainty(kind: str) -> None:
    """35 % less than the nominal one."""
    rests = AntagonisticJoint.paper(kind).rest_angles(
        np.radians([20.0, -20.0, 20.0, -20.0, 20.0, 19.0])
    )
    assert np.degrees(rests[-2] - rests[-1]) == pytest.approx(0.65, abs=0.02)


def test_both_hysteresis_models_have_the_same_loops() -> None:
    commands = np.radians(np.concatenate([a * np.sin(np.linspace(0, 6, 60)) for a in (25, 12, 5)]))
    for preset in ("paper", "reduced"):
        first, second = (
            getattr(AntagonisticJoint, preset)(kind).rest_angles(commands)
            for kind in ("maxwell_slip", "preisach")
        )
        assert np.degrees(np.abs(first - second).max()) < 0.1
        assert np.degrees(np.abs(first - commands).max()) > 1.0


def test_the_joints_loop_is_symmetric_and_a_muscles_is_not() -> None:
    plant = AntagonisticJoint.paper()
    commands = np.radians(20.0) * np.sin(np.linspace(0.0, 9.0, 90))
    assert np.allclose(plant.rest_angles(-commands), -plant.rest_angles(commands), atol=1e-12)
    swings = 2.5e5 * np.sin(np.linspace(0.0, 4.5 * np.pi, 145))
    there, back = (muscle_under_load(plant, 3.5e5 + s * swings)[64:] for s in (1.0, -1.0))
    middle = there.max() + there.min()
    assert np.abs(there + back - middle).max() > 0.2 * (there.max() - there.min())


@pytest.mark.parametrize("kind", ["maxwell_slip", "maxwell_slip_length"])
def test_friction_is_at_most_the_data_sheets_hysteresis(kind: str) -> None:
    """3 % of the nominal length at constant force, at any pressure (fluidic_muscles, sec. 1.1)."""
    plant = AntagonisticJoint.paper(kind)
    plays = contraction_plays(plant.hysteresis.drive)
    lag = sum(w * t for w, t in zip(plays.weights, plays.thresholds, strict=True))
    pressures, h = np.linspace(0.5e5, 6.5e5, 13), 1e-5
    for x in np.linspace(0.0, 0.24, 25):
        pulling = pressures[plant.muscle.law(pressures, x) > 0.0]
        friction = (plant.hysteresis.base + plant.hysteresis.rate * pulling) * lag
        slope = (plant.muscle.law(pulling, x - h) - plant.muscle.law(pulling, x + h)) / (2 * h)
        assert np.all(2.0 * friction / slope < 0.03)


def test_the_reduced_hysteresis_is_identified_on_the_plant_with_muscles() -> None:
    phase, turns = np.linspace(0.0, 4.0 * np.pi, 121)[1:], np.random.default_rng(0)
    loops = [np.radians(a) * np.sin(phase) for a in (25.0, 20.0, 15.0, 10.0, 7.0, 5.0, 3.0)]
    ends = np.radians([0.0, *turns.uniform(-25.0, 25.0, 40)])
    commands = np.concatenate([*loops, *(np.linspace(*e, 13)[1:] for e in pairwise(ends))])
    made = joint_hysteresis("maxwell_slip", True).operator
    assert isinstance(made, PlayOperator)
    stops = [
        commands - PlayOperator((r,), (1.0,), 0.0).simulate(commands)[0] for r in made.thresholds
    ]
    behind = commands - AntagonisticJoint.paper("maxwell_slip").rest_angles(commands)
    weights, norm = nnls(np.column_stack(stops), behind)
    assert np.allclose(weights, made.weights, atol=1e-3)
    assert math.degrees(norm / np.sqrt(len(commands))) < 0.17


# --- files, rows, bad values ---------------------------------------------------------------------


def test_stretch_of_the_paper_preset_is_declared_assumed() -> None:
    assert AntagonisticJoint.paper().provenance["muscle.stretch"][0] == "assumed"
    assert AntagonisticJoint.measured().muscle.stretch == 1.0


@pytest.mark.parametrize(
    "change, words",
    [
        ({"link__stop": 0.64, "lever__l_u": 0.12, "lever__l_o": 0.12}, "lever arm"),
        ({"link__limit": 0.6, "link__stop": 0.55}, "limit"),
        ({"link__gyration": 0.018}, "sub-steps"),
        ({"muscle__area": 1.0}, "outside its bounds"),
        ({"nothing__here": 1.0}, "no parameter"),
    ],
)
def test_bad_values_are_refused(change: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        AntagonisticJoint.paper("none", **change)


def test_hysteresis_models_that_cannot_be_simulated_are_refused() -> None:
    plant = AntagonisticJoint.paper()
    steep = PlayOperator((0.01,), (0.5,), 0.7)
    many = PlayOperator(tuple(np.linspace(0.001, 0.03, 13)), (0.05,) * 13, 0.35)
    low = Preisach.resembling(contraction_plays(), 0.0, 0.3)
    for operator, words in ((steep, "slope"), (many, "13 elements"), (low, "virgin")):
        hysteresis = dataclasses.replace(plant.hysteresis, operator=operator)
        with pytest.raises(ValueError, match=words):
            dataclasses.replace(plant, hysteresis=hysteresis)
    with pytest.raises(ValueError, match="dynamics"):
        AntagonisticJoint(dynamics="else")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="choose"):
        joint_hysteresis("else")  # type: ignore[arg-type]
