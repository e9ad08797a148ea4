"""The loops of an arm's joints, measured on the arm: margins, sensitivity, stability together.

The responses are those of the straight arm without hysteresis to small steps of one setpoint
after the other, which move all joints. A joint's loop is opened with the loops of all others
closed.
"""

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

WHOLE = RedundantManipulator.paper().replace({"hysteresis.width": 0.0})
PLANT = WHOLE.with_lag_alone()
JOINTS, PERIOD, STEP, PERIODS = PLANT.stages, PLANT.control_period, 0.01, 500
LATE = WHOLE.regulator.dead_time
W = np.geomspace(0.05, 0.99 * np.pi / PERIOD, 500)
LAWS = {
    "pi": lambda pole, late: pi_system(pole_cancelling(pole=pole, dead_time=late)),
    "pid": lambda pole, late: pid_system(simc_joint(1.0, pole, PERIOD, True, dead_time=late)),
    "pid_fast": lambda pole, late: pid_system(simc_joint(1.0, pole, PERIOD, dead_time=late)),
    "pid_smooth": lambda pole, late: pid_system(
        simc_joint(1.0, pole, PERIOD, True, True, dead_time=late)
    ),
    "mu": lambda pole, late: robust_controller("mu", pole=pole),
    "hinf": lambda pole, late: robust_controller("hinf", pole=pole),
}
SECTOR = (0.65, 1.0, 1.35)


@cache
def pulses(payload: float, late: float = 0.0) -> np.ndarray:
    """Return what a setpoint held for one period does, (time, angle of joint, setpoint of).

    ``late`` is the dead time of the arm's regulators: none, or ``LATE``.
    """
    found = np.zeros((PERIODS - 1, JOINTS, JOINTS))
    for j in range(JOINTS):
        commands = np.zeros((PERIODS, JOINTS))
        commands[1:, j] = STEP
        plant = WHOLE if late else PLANT
        angles = simulate_manipulator(plant, commands, payload=payload)["angle"]
        found[:, :, j] = np.diff(angles, axis=0) / STEP
    return found


@cache
def arm(payload: float, late: float = 0.0) -> np.ndarray:
    """Return the response of angles to setpoints, (frequency, angle of joint, setpoint of)."""
    time = PERIOD * (np.arange(PERIODS - 1) + 1.0)
    return np.einsum("wn,nij->wij", np.exp(-1j * np.outer(W, time)), pulses(payload, late))


@cache
def laws(name: str, late: float) -> np.ndarray:
    """Return the sampled responses of the joints' controllers, (frequency, joint)."""
    made = [discrete(LAWS[name](pole, late), PERIOD) for pole in joint_poles(PLANT)]
    return np.array([system.response(W) for system in made]).T


def closed(name: str, gain: float, payload: float, late: float) -> np.ndarray:
    """Return the return differences of all loops, (frequency, joint, joint)."""
    return np.eye(JOINTS) + gain * arm(payload, late) * laws(name, late)[:, None, :]


def loops(name: str, gain: float = 1.0, payload: float = 0.0, late: float = 0.0) -> np.ndarray:
    """Return each joint's loop with the others closed, (frequency, joint)."""
    back = np.linalg.inv(closed(name, gain, payload, late))
    return 1.0 / np.diagonal(back, axis1=1, axis2=2) - 1.0


def peaks(name: str, gain: float = 1.0, payload: float = 0.0, late: float = 0.0) -> np.ndarray:
    """Return the largest sensitivity of each joint."""
    return np.max(np.abs(1.0 / (1.0 + loops(name, gain, payload, late))), axis=0)


def margin(name: str, gain: float = 1.0, payload: float = 0.0, late: float = 0.0) -> float:
    """Return the smallest phase margin of all joints [deg], negative or above 180 if unstable."""
    found = []
    for loop in loops(name, gain, payload, late).T:
        angle = np.degrees(np.angle(-loop))  # from the critical point
        falls = np.flatnonzero((np.abs(loop[:-1]) >= 1.0) & (np.abs(loop[1:]) < 1.0))
        found += [float(angle[k]) for k in falls]
    return min(found)


def stable(name: str, gain: float = 1.0, payload: float = 0.0, late: float = 0.0) -> bool:
    """Return whether the six loops together are stable.

    By Nyquist: from the integrators' quarter turns each to the end, where the loops have faded,
    ``det(I + L)`` turns by ``JOINTS / 4`` if nothing is encircled (the arm itself is stable).
    """
    phase = np.unwrap(np.angle(np.linalg.det(closed(name, gain, payload, late))))
    turns = (phase[-1] - phase[0]) / (2.0 * np.pi)
    return abs(turns - 0.25 * JOINTS) < 0.25


@pytest.mark.parametrize("payload", [0.0, 0.1])
@pytest.mark.parametrize("kind", ["mu", "hinf"])
def test_disturbance_loops_are_stable_on_the_arm_over_the_whole_sector(kind, payload):
    for gain in SECTOR:
        assert stable(kind, gain, payload)
        assert peaks(kind, gain, payload).max() < 1.75
        assert stable(kind, gain, payload, LATE)
    assert margin(kind, 1.0, payload) > 75.0
    assert margin(kind, 1.0, payload, LATE) > 50.0


def test_sensitivity_at_the_base_exceeds_that_of_the_design():
    found = peaks("mu")
    assert found.max() == pytest.approx(1.24, abs=0.03)
    assert np.argmax(found) in (0, 1)
    assert np.all(found[2:] < 1.12)
    assert peaks("mu", late=LATE).max() == pytest.approx(1.60, abs=0.03)
    assert peaks("mu", payload=0.1, late=LATE).max() == pytest.approx(2.12, abs=0.03)


def test_margins_of_pi_and_pid_with_the_dead_time_of_the_regulators():
    stated = {"pid": (56.0, 20.0), "pid_smooth": (76.0, 76.0), "pi": (62.0, 55.0)}
    for name, margins in stated.items():
        for payload, degrees in zip((0.0, 0.1), margins, strict=True):
            assert stable(name, 1.0, payload, LATE)
            assert margin(name, 1.0, payload, LATE) == pytest.approx(degrees, abs=2.0)
    assert peaks("pid_smooth", late=LATE).max() < 1.8 < peaks("pid", late=LATE).max() < 2.5


def test_rule_for_one_stage_is_unstable_on_the_arm():
    assert not stable("pid_fast") and not stable("pid_fast", late=LATE)


def test_payload_reduces_the_margin_of_single_loops():
    for name in ("pi", "pid", "pid_smooth"):
        assert peaks(name, payload=0.1, late=LATE).max() > 1.3 * peaks(name, late=LATE).max()
    assert not stable("pid", 1.35, payload=0.1, late=LATE)


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
