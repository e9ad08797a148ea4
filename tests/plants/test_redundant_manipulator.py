"""The arm of six joints: statics, energy, convergence, bits, files."""

import dataclasses
import math

import numpy as np
import pytest

from pam_envs.hysteresis.protocol import kinds
from pam_envs.kernels.build import COMPILED
from pam_envs.mechanics.redundancy.resolution import resolve
from pam_envs.mechanics.serial_chain.chain import SerialChain
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.rollout import simulate_joint
from pam_envs.plants.redundant_manipulator import rows as M
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.plants.redundant_manipulator.rollout import simulate_manipulator
from pam_envs.references.path import PATHS

DEGREE = np.radians(1.0)
slow = pytest.mark.skipif(not COMPILED, reason="too many sub-steps for plain Python")
POSE = DEGREE * np.array([10.0, -12.0, 15.0, 8.0, -10.0, 18.0])


def steps(n: int, largest: float, every: int = 12, seed: int = 0) -> np.ndarray:
    drawn = np.random.default_rng(seed).uniform(-largest, largest, (-(-n // every), 6))
    return np.repeat(drawn, every, axis=0)[:n]


@pytest.mark.parametrize("kind", kinds())
@pytest.mark.parametrize("payload", [0.0, 0.1, 0.5])
def test_muscles_at_rest_bear_the_weights(kind, payload: float) -> None:  # type: ignore[no-untyped-def]
    plant = RedundantManipulator.paper(kind)
    made = simulate_manipulator(plant, np.tile(POSE, (60, 1)), payload=payload)
    weight = plant.chain.gravity_torque(made["angle"][-1], payload)
    assert np.abs(weight).max() > 0.5
    assert np.allclose(made["torque"][-1], weight, atol=1e-9)
    assert np.ptp(made["angle"], axis=0).max() < 1e-9


def test_torques_follow_from_forces_and_lever_arms() -> None:
    plant = RedundantManipulator.paper()
    made = simulate_manipulator(plant, steps(40, 20.0 * DEGREE))
    rate = plant.lever.rate(made["angle"])
    torque = -np.sum(made["force"].reshape(-1, 6, 2) * rate, axis=-1)
    assert np.allclose(torque, made["torque"], atol=1e-12)
    assert made["force"].min() >= 0.0


def test_feedforward_has_gain_one_without_gravity() -> None:
    chain = SerialChain.uniform(gravity=(0.0, 0.0, 0.0))
    plant = RedundantManipulator.paper("none", chain)
    made = simulate_manipulator(plant, np.tile(POSE, (2, 1)))
    assert np.allclose(made["angle"][-1], POSE, atol=1e-9)


def test_gravity_shift_bears_the_weights() -> None:
    plant = RedundantManipulator.paper("none")
    for payload in (0.0, 0.05):
        commands = POSE + plant.gravity_shift(POSE, payload)
        assert np.abs(commands).max() < plant.link.limit
        made = simulate_manipulator(plant, np.tile(commands, (3, 1)), payload=payload)
        assert np.allclose(made["angle"][-1], POSE, atol=1e-6)
    shifts = plant.gravity_shift(np.stack([POSE, -POSE]), np.array([0.0, 0.0]))
    assert np.allclose(shifts[0], -shifts[1], atol=1e-9)


def test_the_three_paths_are_within_reach_of_the_hanging_arm() -> None:
    """Planned with the weight of Eq. (2.1); links twice as heavy are not borne."""
    heavy = SerialChain.uniform(mass=0.2)
    light, strained = RedundantManipulator.paper("none"), RedundantManipulator.paper("none", heavy)
    largest = []
    for path in PATHS:
        line = path.angles(9)
        poses = light.chain.pose(line)
        planned = resolve(light.chain, poses, light.link.limit, start=line[0]).angles
        largest.append(np.abs(planned + light.gravity_shift(planned)).max())
        weights = np.array([light.chain.gravity_torque(q) for q in planned])
        assert not light.pressures_for(planned, torque=weights)[2].any()
    assert np.degrees(largest) == pytest.approx([28.8, 28.3, 29.6], abs=0.1)
    weights = np.array([heavy.gravity_torque(q) for q in planned])
    assert strained.pressures_for(planned, torque=weights)[2].any()


@pytest.mark.parametrize("kind", ["maxwell_slip", "maxwell_slip_length"])
def test_chain_of_one_joint_equals_the_single_joint(kind: str) -> None:
    """Another integrator, with the same physics."""
    one = SerialChain(("y",), (0.25,), (0.3,), (0.125,), (0.0015625,), (1e-6,))
    arm = dataclasses.replace(RedundantManipulator.paper(kind, one), joint_damping=(0.0,))
    joint = AntagonisticJoint.paper(kind)
    assert joint.link.inertia == pytest.approx(0.0015625 + 0.3 * 0.125**2)
    commands = steps(80, 22.0 * DEGREE)[:, :1]
    shoves = np.where(np.arange(80) > 40, 0.8, 0.0)[:, None]
    first = simulate_manipulator(arm, commands, payload=0.2, disturbance=shoves)["angle"][:, 0]
    second = simulate_joint(joint, commands[:, 0], payload=0.2, disturbance=shoves[:, 0])["angle"]
    assert np.abs(first - second).max() < 0.05 * DEGREE
    fine = dataclasses.replace(arm, substeps=32), dataclasses.replace(joint, substeps=32)
    first = simulate_manipulator(fine[0], commands, payload=0.2, disturbance=shoves)["angle"][:, 0]
    second = simulate_joint(fine[1], commands[:, 0], payload=0.2, disturbance=shoves[:, 0])["angle"]
    assert np.abs(first - second).max() < 1e-3 * DEGREE


def stored(plant: RedundantManipulator, angles: np.ndarray, pressures: np.ndarray) -> np.ndarray:
    """Potential energy [J] of the muscles of every joint at held pressures, shape (T,)."""
    fine, total = np.linspace(-0.65, 0.65, 4001), np.zeros(len(angles))
    for k in range(plant.stages):
        torque = plant.torque(fine, *pressures[2 * k : 2 * k + 2])
        work = np.concatenate([[0.0], np.cumsum(0.5 * (torque[1:] + torque[:-1]) * np.diff(fine))])
        total -= np.interp(angles[:, k], fine, work)
    return total


@slow
def test_energy_is_conserved_except_for_friction() -> None:
    """Let go at held pressures: the energy falls by what viscosity takes, with no other loss."""
    plant = RedundantManipulator.paper("none", link__damping=0.0, muscle__viscosity=0.0)
    still = dataclasses.replace(plant, joint_damping=(0.0,) * 6, substeps=40)
    damped = dataclasses.replace(still, joint_damping=(0.05,) * 6)
    shoves = np.zeros((60, 6))
    shoves[:12] = [1.0, -0.6, 0.5, 0.3, -0.2, 0.1]
    for arm, kept in ((still, True), (damped, False)):
        made = simulate_manipulator(arm, np.zeros((60, 6)), disturbance=shoves, payload=0.05)
        q, v = made["angle"], made["velocity"]
        parts = np.array([sum(arm.chain.energy(a, b, 0.05)) for a, b in zip(q, v, strict=True)])
        energy = parts + stored(arm, q, made["pressure"][0])
        level = energy - sum(arm.chain.energy(np.zeros(6), np.zeros(6), 0.05))
        level -= stored(arm, np.zeros((1, 6)), made["pressure"][0])
        assert level[12] > 0.02 and np.degrees(np.abs(q).max()) < 30.0
        if kept:
            assert np.ptp(level[12:]) < 0.01 * level[12]
        else:
            assert np.all(np.diff(level[12:]) < 1e-4 * level[12])
            assert level[-1] < 0.9 * level[12]


@slow
@pytest.mark.parametrize("kind", kinds())
def test_sub_steps_converge_at_second_order(kind) -> None:  # type: ignore[no-untyped-def]
    commands = steps(48, 25.0 * DEGREE)

    def angles(substeps: int) -> np.ndarray:
        plant = dataclasses.replace(RedundantManipulator.paper(kind), substeps=substeps)
        return simulate_manipulator(plant, commands, payload=0.05)["angle"]

    fine = angles(100)
    errors = [float(np.sqrt(np.mean((angles(n) - fine) ** 2))) for n in (2, 4, 8)]
    assert errors[1] < 0.004 * DEGREE
    assert errors[0] / errors[1] > 3.0 and errors[1] / errors[2] > 3.0
    assert np.abs(angles(4) - fine).max() < 0.02 * DEGREE


def test_common_factors_are_those_of_all_links_and_of_all_joints() -> None:
    """A factor of all masses is a heavier chain; the payload has none."""
    commands, factor = steps(40, 20.0 * DEGREE), 1.3
    plain = RedundantManipulator.paper("maxwell_slip", link__damping=0.1)
    drawn = plain.replace({"arm.mass_factor": factor, "arm.damping_factor": 0.6})
    heavy = RedundantManipulator.paper("maxwell_slip", plain.chain.heavier(factor))
    damping = tuple(0.6 * d for d in plain.joint_damping)
    heavy = dataclasses.replace(heavy.replace({"link.damping": 0.1}), joint_damping=damping)
    assert np.allclose(drawn.chain.rows(), heavy.chain.rows(), rtol=1e-15)
    assert drawn.joint_damping == plain.joint_damping
    one, other, light = (
        simulate_manipulator(arm, commands, payload=0.1)["angle"] for arm in (drawn, heavy, plain)
    )
    assert np.abs(one - other).max() < 1e-9
    assert np.abs(one - light).max() > 0.5 * DEGREE
    assert np.array_equal(drawn.gravity_shift(POSE, 0.1), heavy.gravity_shift(POSE, 0.1))


def test_joints_are_coupled() -> None:
    plant = RedundantManipulator.paper("none")
    commands = np.zeros((30, 6))
    commands[2:, 0] = 15.0 * DEGREE
    made = simulate_manipulator(plant, commands)["angle"]
    assert np.abs(made[:, 2]).max() > 0.2 * DEGREE  # the same axis
    assert np.abs(made[:, 1]).max() < 1e-9  # across it, from the straight arm


def test_the_measured_arm_is_limited_by_its_base() -> None:
    plant = RedundantManipulator.measured("none")
    limit = plant.link.limit
    assert math.degrees(limit) == pytest.approx(20.1, abs=0.05)
    assert limit < AntagonisticJoint.measured().link.limit
    assert plant.reachable_angle(payload=0.1) < limit
    floating = SerialChain.uniform(gravity=(0.0, 0.0, 0.0))
    assert RedundantManipulator.measured("none", floating).link.limit > limit


def test_damping_ratio_is_a_half() -> None:
    plant = RedundantManipulator.paper()
    assert plant.joint_damping == pytest.approx((2.19, 1.41, 0.75, 0.2, 0.0, 0.0), abs=0.01)
    assert plant.joint_damping == plant.even_damping()


def test_column_order_is_parameters_hysteresis_damping_chain() -> None:
    plant = RedundantManipulator.paper()
    column = plant.parameter_rows()
    assert tuple(column[M.JOINT_DAMPING : M.JOINT_DAMPING + 6]) == plant.joint_damping
    assert np.array_equal(column[M.CHAIN :], plant.chain.rows())
    assert plant.chain == SerialChain.uniform()
    assert plant.stage().rest_angles([0.1])[0] == plant.rest_angles([0.1])[0]


def test_bad_chains_are_refused() -> None:
    plant = RedundantManipulator.paper()
    bad = (
        ({"axes": "xyxyxyxyx"}, "entries"),
        ({"axes": "xyxyxq"}, "axes"),
        ({"masses": (0.1,) * 5}, "entries"),
        ({"joint_damping": (0.1,) * 5}, "joint_damping"),
        ({"joint_damping": (-0.1,) * 6}, "joint_damping"),
        ({"gravity": (0.0, 9.8)}, "gravity"),
        ({"lengths": "long"}, "numbers"),
    )
    for change, words in bad:
        with pytest.raises(ValueError, match=words):
            dataclasses.replace(plant, **change)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="at most 8"):
        RedundantManipulator.paper(chain=SerialChain.uniform("xyxyxyxyx", mass=0.1))
    with pytest.raises(ValueError, match="columns"):
        simulate_manipulator(plant, np.zeros((3, 4)))
