"""Serial chain: kernels against numpy, numpy against differences, and energy."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from pam_envs.constants import GRAVITY
from pam_envs.kernels.build import interpreted, kernel
from pam_envs.mechanics.serial_chain.chain import FORM, SerialChain
from pam_envs.mechanics.serial_chain.kernels import (
    chain_solve,
    chain_terms,
    mass_row,
    parameter_rows,
    place_chain,
    pointing_row,
    tip_row,
    work_rows,
)

H = 1e-6
PAPER = SerialChain.uniform()
ODD = SerialChain(
    axes=("z", "x", "y", "y", "x", "z", "x"),
    lengths=(0.1, 0.3, 0.25, 0.2, 0.15, 0.22, 0.4),
    masses=(1.2, 0.8, 0.3, 0.5, 0.9, 0.4, 0.2),
    centres=(0.05, 0.2, 0.3, 0.1, 0.0, 0.11, 0.1),
    across=(0.01, 0.006, 0.002, 0.003, 0.004, 0.001, 0.002),
    along=(0.02, 0.001, 0.004, 0.002, 0.001, 0.003, 0.0005),
    gravity=(1.0, -4.0, -8.0),
)
CHAINS = pytest.mark.parametrize("chain", [PAPER, ODD], ids=["paper", "odd"])


def drawn(chain: SerialChain, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return angles [rad] and rates [rad/s]."""
    rng = np.random.default_rng(seed)
    return rng.uniform(-0.6, 0.6, chain.stages), rng.uniform(-3.0, 3.0, chain.stages)


def slope(function: Any, at: np.ndarray) -> np.ndarray:
    """Return the derivative of a function of a vector, its last axis that of the vector."""
    steps = H * np.eye(len(at))
    sides = [(np.asarray(function(at + d)) - np.asarray(function(at - d))) / (2 * H) for d in steps]
    return np.stack(sides, -1)


# --- numpy --------------------------------------------------------------------------------------


def test_pose_of_the_straight_arm_and_of_one_bent_joint():
    np.testing.assert_allclose(PAPER.pose(np.zeros(6)), [0, 0, 1.5, 0, 0, 1], atol=1e-15)
    bent = np.array([0.3, 0, 0, 0, 0, 0])  # about x: towards -y
    expected = [0, -1.5 * np.sin(0.3), 1.5 * np.cos(0.3), 0, -np.sin(0.3), np.cos(0.3)]
    np.testing.assert_allclose(PAPER.pose(bent), expected, atol=1e-15)
    bent = np.array([0, 0, 0, 0, 0, 0.2])  # about y: towards x
    expected = [0.25 * np.sin(0.2), 0, 1.25 + 0.25 * np.cos(0.2), np.sin(0.2), 0, np.cos(0.2)]
    np.testing.assert_allclose(PAPER.pose(bent), expected, atol=1e-15)


@CHAINS
def test_batched_poses_equal_single_poses(chain):
    angles = np.stack([drawn(chain, seed)[0] for seed in range(4)]).reshape(2, 2, -1)
    assert chain.pose(angles).shape == (2, 2, 6)
    assert chain.joints(angles).shape == (2, 2, chain.stages + 1, 3)
    np.testing.assert_array_equal(chain.pose(angles)[1, 0], chain.pose(angles[1, 0]))
    spans = np.linalg.norm(np.diff(chain.joints(angles), axis=-2), axis=-1)
    np.testing.assert_allclose(spans, np.broadcast_to(chain.lengths, spans.shape), rtol=1e-14)


@CHAINS
def test_jacobian_is_derivative_of_the_pose(chain):
    angles, _ = drawn(chain)
    np.testing.assert_allclose(chain.jacobian(angles), slope(chain.pose, angles), atol=1e-9)


@CHAINS
def test_kinetic_energy_equals_that_of_the_bodies(chain):
    """Of two mass points and a spin for each link, all differenced."""
    angles, rates = drawn(chain)
    payload, total = 0.7, 0.0

    def places(t: float) -> tuple[np.ndarray, np.ndarray]:
        _, points, directions = chain.frames(angles + t * rates)
        offsets = np.array(chain.centres)[:, None]
        return points[:-1] + offsets * directions, np.vstack([directions, points[-1]])

    axes, _, directions = chain.frames(angles)
    spins = np.cumsum(axes * rates[:, None], axis=0)
    (c1, d1), (c0, d0) = places(H), places(-H)
    for k in range(chain.stages):
        speed, turn = (c1 - c0)[k] / (2 * H), (d1 - d0)[k] / (2 * H)
        along = spins[k] @ directions[k]
        total += 0.5 * chain.masses[k] * speed @ speed
        total += 0.5 * chain.across[k] * turn @ turn + 0.5 * chain.along[k] * along**2
    tip = (d1 - d0)[-1] / (2 * H)
    total += 0.5 * payload * tip @ tip
    assert chain.energy(angles, rates, payload)[0] == pytest.approx(total, rel=1e-8)


@CHAINS
def test_equations_of_motion_satisfy_lagrange(chain):
    """``d/dt (M v) - d(T - V)/dq`` without acceleration is the bias."""
    angles, rates = drawn(chain)
    payload = 0.4
    momentum = slope(lambda q: chain.mass_matrix(q, payload) @ rates, angles) @ rates
    kinetic = slope(lambda q: chain.energy(q, rates, payload)[0], angles)
    potential = slope(lambda q: chain.energy(q, rates, payload)[1], angles)
    bias = chain.bias(angles, rates, payload)
    np.testing.assert_allclose(bias, momentum - kinetic + potential, atol=2e-7)
    np.testing.assert_allclose(chain.gravity_torque(angles, payload), potential, atol=1e-8)
    at_rest = chain.bias(angles, np.zeros(chain.stages), payload)
    np.testing.assert_allclose(at_rest, potential, atol=1e-8)


@CHAINS
def test_batched_weights_equal_single_weights(chain):
    poses = np.stack([drawn(chain, seed)[0] for seed in range(6)]).reshape(2, 3, -1)
    masses = np.array([[0.0, 0.1, 0.5], [1.0, 0.2, 0.3]])
    together = chain.gravity_torque(poses, masses)
    for k in np.ndindex(2, 3):
        alone = chain.gravity_torque(poses[k], masses[k])
        assert together[k].tobytes() == alone.tobytes()  # controllers ask for rows of a batch
    twice = chain.heavier(2.0)
    np.testing.assert_allclose(
        twice.gravity_torque(poses), 2.0 * chain.gravity_torque(poses), atol=1e-12
    )
    np.testing.assert_allclose(
        twice.mass_matrix(poses[0, 0]), 2.0 * chain.mass_matrix(poses[0, 0]), atol=1e-12
    )


def test_hanging_arm_returns_and_horizontal_arm_sags():
    bent = np.array([0.2, 0, 0, 0, 0, 0])
    torque = PAPER.gravity_torque(bent)[0]
    weight = 6 * FORM.mass * GRAVITY
    assert torque == pytest.approx(weight * 0.75 * np.sin(0.2), rel=1e-12)
    lying = dataclasses.replace(PAPER, gravity=(0.0, -GRAVITY, 0.0))
    assert lying.gravity_torque(np.zeros(6))[0] == pytest.approx(-weight * 0.75, rel=1e-12)


# --- kernels ------------------------------------------------------------------------------------

N_STAGES = 6
LANES = 3


@kernel
def accelerate(rows: Any, fixed: Any, work: Any) -> None:
    """Leave accelerations without joint torques in the place of the right-hand side."""
    chain_terms(rows, fixed, work, 0, N_STAGES, 2 * N_STAGES, 0, 0)
    for k in range(N_STAGES):
        for j in range(LANES):
            work[N_STAGES + k][j] = -work[k][j]
    chain_solve(work, 0)


def states(chain: SerialChain, lanes: int = LANES) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rows of angles, rates and payload, parameters, and scratch."""
    pairs = [drawn(chain, seed) for seed in range(lanes)]
    rows = np.array([[*q, *v, 0.3 * j] for j, (q, v) in enumerate(pairs)]).T.copy()
    fixed = np.repeat(chain.rows()[:, None], lanes, axis=1)
    return rows, fixed, np.zeros((work_rows(chain.stages), lanes))


def plain(
    function: Any,
    chain: SerialChain,
    *arrays: np.ndarray,
    lanes: int = LANES,
    starts: tuple[int, ...] = (),
) -> Any:
    """Call a kernel with lists, uncompiled, and return its scratch."""
    lists = [array.tolist() for array in arrays]
    names = {"N_STAGES": chain.stages, "LANES": lanes}
    interpreted(function, names)(*lists, *starts)
    return np.array(lists[-1])


@CHAINS
def test_chain_kernels_equal_numpy_kinematics(chain):
    rows, n = states(chain)[0], chain.stages
    got = plain(place_chain, chain, *states(chain), starts=(0, 0, 0))
    where = [*range(tip_row(n), tip_row(n) + 3), *range(pointing_row(n), pointing_row(n) + 3)]
    np.testing.assert_allclose(got[where].T, chain.pose(rows[:n].T), atol=1e-14)


@CHAINS
def test_chain_kernels_equal_numpy_dynamics(chain):
    rows, fixed, work = states(chain)
    n = chain.stages
    got = plain(chain_terms, chain, rows, fixed, work, starts=(0, n, 2 * n, 0, 0))
    for j in range(LANES):
        q, v, payload = rows[:n, j], rows[n : 2 * n, j], float(rows[2 * n, j])
        np.testing.assert_allclose(got[:n, j], chain.bias(q, v, payload), atol=1e-13)
        lower = [[got[mass_row(0, n, i, k), j] for k in range(i + 1)] for i in range(n)]
        expected = chain.mass_matrix(q, payload)
        for i, line in enumerate(lower):
            np.testing.assert_allclose(line, expected[i, : i + 1], atol=1e-14)
    solved = plain(accelerate, chain, rows, fixed, work)
    for j in range(LANES):
        q, v, payload = rows[:n, j], rows[n : 2 * n, j], float(rows[2 * n, j])
        expected = np.linalg.solve(chain.mass_matrix(q, payload), -chain.bias(q, v, payload))
        np.testing.assert_allclose(solved[n : 2 * n, j], expected, rtol=1e-9, atol=1e-9)


@CHAINS
def test_energy_is_conserved_in_free_motion(chain):
    """Of the kernels' accelerations, integrated by Runge and Kutta's fourth-order method."""
    rows, fixed, work = states(chain, 1)
    n, h, steps = chain.stages, 1e-3, 100
    fixed_list, work_list, payload = fixed.tolist(), work.tolist(), 0.5
    function = interpreted(accelerate, {"N_STAGES": n, "LANES": 1})

    def rate(state: np.ndarray) -> np.ndarray:
        function([[x] for x in (*state.tolist(), payload)], fixed_list, work_list)
        return np.concatenate([state[n:], [work_list[n + k][0] for k in range(n)]])

    def energy(state: np.ndarray) -> float:
        return sum(chain.energy(state[:n], state[n:], payload))

    state = rows[: 2 * n, 0]
    kinetic, before = chain.energy(state[:n], state[n:], payload)[0], energy(state)
    for _ in range(steps):
        a = rate(state)
        b = rate(state + 0.5 * h * a)
        c = rate(state + 0.5 * h * b)
        state = state + h / 6.0 * (a + 2.0 * b + 2.0 * c + rate(state + h * c))
    moved = abs(chain.energy(state[:n], state[n:], payload)[0] - kinetic)
    assert moved > 0.1 * kinetic  # there was something to conserve
    assert energy(state) == pytest.approx(before, abs=1e-6 * kinetic)


def test_lanes_are_independent():
    rows, fixed, work = states(PAPER, 5)
    together = plain(accelerate, PAPER, rows, fixed, work, lanes=5)
    for j in range(5):
        one = [array[:, j : j + 1] for array in (rows, fixed, work)]
        np.testing.assert_array_equal(plain(accelerate, PAPER, *one, lanes=1)[:, 0], together[:, j])


def test_row_counts_match_their_declarations():
    for chain in (PAPER, ODD):
        assert len(chain.rows()) == parameter_rows(chain.stages)
    assert work_rows(6) > max(tip_row(6) + 3, pointing_row(6) + 3)


# --- refusals -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"axes": ("x", "y", "x", "y", "x", "w")}, "letters x, y, z"),
        ({"axes": ("x", "y")}, "6 entries for 2 joints"),
        ({"masses": (0.5, 0.5, -1.0, 0.5, 0.5, 0.5)}, r"masses\[2\] = -1.0 kg"),
        ({"lengths": (0.25, 0.25, float("nan"), 0.25, 0.25, 0.25)}, r"lengths\[2\] = nan m"),
        ({"gravity": (0.0, 9.8)}, "three numbers"),
        ({"gravity": (0.0, 0.0, 98.0)}, r"gravity\[2\] = 98.0 m/s2"),
    ],
)
def test_invalid_chain_is_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        dataclasses.replace(PAPER, **changes)


def test_angles_of_wrong_shape_are_refused():
    with pytest.raises(ValueError, match="6 joints"):
        PAPER.pose(np.zeros(5))
