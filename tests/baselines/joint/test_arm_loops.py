"""The loops of an arm's joints, measured on the arm: margins, sensitivity, stability together.

The responses are those of the straight arm without hysteresis to small steps of one setpoint
after the other, which move all joints. A joint's loop is opened with the loops of all others
closed.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from baselines.joint.feedback import pid_system, simc_joint
from baselines.joint.model import joint_delays, joint_poles, mean_time, pi_system, pole_cancelling
from baselines.linear.pid import DELAY_PERIODS
from baselines.linear.systems import discrete, double_lag
from baselines.robust.requirements import FREQUENCIES, RobustDesign, robust_controller
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.plants.redundant_manipulator.rollout import simulate_manipulator

PLANT = RedundantManipulator.paper().replace({"hysteresis.width": 0.0})
JOINTS, PERIOD, STEP, PERIODS = PLANT.stages, PLANT.control_period, 0.01, 500
W = np.geomspace(0.05, 0.99 * np.pi / PERIOD, 500)
LAWS = {
    "pi": lambda pole: pi_system(pole_cancelling(pole=pole)),
    "pid": lambda pole: pid_system(simc_joint(1.0, pole, PERIOD, in_arm=True)),
    "pid_fast": lambda pole: pid_system(simc_joint(1.0, pole, PERIOD)),
    "pid_smooth": lambda pole: pid_system(simc_joint(1.0, pole, PERIOD, True, True)),
    "mu": lambda pole: robust_controller("mu", pole=pole),
    "hinf": lambda pole: robust_controller("hinf", pole=pole),
}
SECTOR = (0.65, 1.0, 1.35)


@cache
def pulses(payload: float) -> np.ndarray:
    """Return what a setpoint held for one period does, (time, angle of joint, setpoint of)."""
    found = np.zeros((PERIODS - 1, JOINTS, JOINTS))
    for j in range(JOINTS):
        commands = np.zeros((PERIODS, JOINTS))
        commands[1:, j] = STEP
        angles = simulate_manipulator(PLANT, commands, payload=payload)["angle"]
        found[:, :, j] = np.diff(angles, axis=0) / STEP
    return found


@cache
def arm(payload: float) -> np.ndarray:
    """Return the response of angles to setpoints, (frequency, angle of joint, setpoint of)."""
    time = PERIOD * (np.arange(PERIODS - 1) + 1.0)
    return np.einsum("wn,nij->wij", np.exp(-1j * np.outer(W, time)), pulses(payload))


@cache
def laws(name: str) -> np.ndarray:
    """Return the sampled responses of the joints' controllers, (frequency, joint)."""
    made = [discrete(LAWS[name](pole), PERIOD) for pole in joint_poles(PLANT)]
    return np.array([system.response(W) for system in made]).T


def loops(name: str, gain: float = 1.0, payload: float = 0.0) -> np.ndarray:
    """Return each joint's loop with the others closed, (frequency, joint)."""
    back = np.linalg.inv(np.eye(JOINTS) + gain * arm(payload) * laws(name)[:, None, :])
    return 1.0 / np.diagonal(back, axis1=1, axis2=2) - 1.0


def peaks(name: str, gain: float = 1.0, payload: float = 0.0) -> np.ndarray:
    """Return the largest sensitivity of each joint."""
    return np.max(np.abs(1.0 / (1.0 + loops(name, gain, payload))), axis=0)


def margin(name: str, gain: float = 1.0, payload: float = 0.0) -> float:
    """Return the smallest phase margin of all joints [deg], negative or above 180 if unstable."""
    found = []
    for loop in loops(name, gain, payload).T:
        angle = np.degrees(np.angle(-loop))  # from the critical point
        falls = np.flatnonzero((np.abs(loop[:-1]) >= 1.0) & (np.abs(loop[1:]) < 1.0))
        found += [float(angle[k]) for k in falls]
    return min(found)


def stable(name: str, gain: float = 1.0, payload: float = 0.0) -> bool:
    """Return whether the six loops together are stable.

    By Nyquist: from the integrators' quarter turns each to the end, where the loops have faded,
    ``det(I + L)`` turns by ``JOINTS / 4`` if nothing is encircled (the arm itself is stable).
    """
    whole = np.eye(JOINTS) + gain * arm(payload) * laws(name)[:, None, :]
    phase = np.unwrap(np.angle(np.linalg.det(whole)))
    turns = (phase[-1] - phase[0]) / (2.0 * np.pi)
    return abs(turns - 0.25 * JOINTS) < 0.25


@pytest.mark.parametrize("payload", [0.0, 0.1])
@pytest.mark.parametrize("kind", ["mu", "hinf"])
def test_disturbance_loops_are_stable_on_the_arm_over_the_whole_sector(kind, payload):
    for gain in SECTOR:
        assert stable(kind, gain, payload)
        assert peaks(kind, gain, payload).max() < 1.75
    assert margin(kind, 1.0, payload) > 75.0


def test_sensitivity_at_the_base_exceeds_that_of_the_design():
    found = peaks("mu")
    assert found.max() == pytest.approx(1.24, abs=0.03)
    assert np.argmax(found) in (0, 1)
    assert np.all(found[2:] < 1.12)


def test_pid_is_fast_with_a_small_phase_margin():
    assert stable("pid") and stable("pid_smooth")
    assert margin("pid") == pytest.approx(18.0, abs=2.0)
    assert margin("pid_smooth") == pytest.approx(39.0, abs=2.0)
    assert margin("pi") == pytest.approx(56.0, abs=2.0)
    assert 1.7 < peaks("pid_smooth").max() < 2.5 < peaks("pid").max()


def test_rule_for_one_stage_is_unstable_on_the_arm():
    assert not stable("pid_fast")


def test_payload_reduces_the_margin_of_single_loops():
    for name in ("pi", "pid", "pid_smooth"):
        assert margin(name, payload=0.1) < 0.6 * margin(name)
        assert peaks(name, payload=0.1).max() > 3.5
    assert stable("pid", payload=0.1) and margin("pid", payload=0.1) < 6.0
    assert not stable("pid", 1.35, payload=0.1)


def test_design_of_a_slower_joint_is_no_harder_than_the_one_synthesised():
    fast = RobustDesign()
    worst = fast.structured_value(_loop(fast)).max()
    for pole in joint_poles(PLANT):
        slow = RobustDesign(pole=pole, bandwidth=fast.bandwidth * pole / fast.pole)
        assert slow.structured_value(_loop(slow)).max() <= worst + 1e-3


def _loop(design):
    controller = robust_controller("mu", pole=design.pole)
    return design.plant(1j * FREQUENCIES) * controller(1j * FREQUENCIES)


def test_neglected_dynamics_cover_hold_and_computing():
    late = np.abs(np.exp(-1j * FREQUENCIES * DELAY_PERIODS * PERIOD) - 1.0)
    assert np.all(late < np.abs(RobustDesign().neglected(1j * FREQUENCIES)))


def test_double_pole_only_approximates_the_base_joint():
    """The base swings: beyond what the design allows for, which is why it is measured here."""
    hold = np.exp(-0.5j * W * PERIOD)
    nominal = [double_lag(pole)(1j * W) * hold for pole in joint_poles(PLANT)]
    gap = np.abs(np.diagonal(arm(0.0), axis1=1, axis2=2) / np.array(nominal).T - 1.0)
    design = RobustDesign()
    covered = design.gain_spread + np.abs(design.neglected(1j * W))
    within = np.max(gap / covered[:, None], axis=0)
    assert within[0] == pytest.approx(1.21, abs=0.05) and within[-1] < 1.0


def test_delay_is_that_of_the_joint_and_not_of_its_double_pole():
    delays, poles = np.array(joint_delays(PLANT)), np.array(joint_poles(PLANT))
    own = [mean_time(pulses(0.0)[:, k, k], PERIOD) for k in range(JOINTS)]
    np.testing.assert_allclose(delays, own, atol=5e-3)
    assert np.all(delays[:2] < 0.7 * 2.0 / poles[:2])
    assert delays[-1] == pytest.approx(2.0 / poles[-1], rel=0.05)
