"""Preview of joint references: weights, delays, and tracking error."""

from __future__ import annotations

import numpy as np
import pytest

from baselines.joint.feedback import (
    make_joint_feedback,
    pid_delay,
    pid_system,
    reference_filter,
    simc_joint,
)
from baselines.joint.loop import pi_system, pole_cancelling
from baselines.joint.model import POLE
from baselines.joint.model_following import make_model_following
from baselines.joint.preview import MAX_EXTRAPOLATION, ahead_by, double_pole_delays, present
from baselines.linear.systems import discrete, double_lag
from benchmarks.papers.joint_studies import ACTIONS, RANGE, ReducedRig
from pam_envs.parameters import Signal, Signals

PERIOD, TIMES = 0.01, (0.0, 0.04, 0.08, 0.12)
NAMES = ("angle", "set_point", "reference", "reference_1", "reference_2", "reference_3")
SIGNALS = Signals(
    Signal(name, "rad", -RANGE, RANGE, k, False, max(0.0, 0.04 * (k - 2)))
    for k, name in enumerate(NAMES)
)
RIG = ReducedRig(0.0)


def test_straight_line_is_read_exactly_within_and_beyond_the_previews():
    leads = (0.0, 0.01, 0.05, 0.12, 0.2)
    samples = np.tile(0.3 - 2.0 * np.array(TIMES), (1, len(leads), 1))
    found = ahead_by(leads, TIMES).reference(samples)
    np.testing.assert_allclose(found, [0.3 - 2.0 * np.array(leads)], atol=1e-12)


def test_only_the_samples_around_are_read_within_the_previews():
    weights = ahead_by((0.05,), TIMES).weights[0]
    np.testing.assert_allclose(weights, [0.0, 0.75, 0.25, 0.0])


def test_extrapolation_is_bounded():
    samples = np.array([[[0.0, 0.0, 0.0, 1.0]]])
    assert ahead_by((99.0,), TIMES).reference(samples)[0, 0] == 1.0 + MAX_EXTRAPOLATION


def test_without_previews_the_present_is_read():
    np.testing.assert_array_equal(ahead_by((0.3,), (0.0,)).weights, present(1).weights)
    samples = np.array([[[0.2, 0.5, 0.1]]])
    assert present(3).reference(samples)[0, 0] == 0.2


@pytest.mark.parametrize("pole", [5.5, POLE])
def test_loop_of_the_pi_is_its_delay_up_to_the_third_order(pole):
    loop = double_lag(pole) * pi_system(pole_cancelling(pole=pole))
    delay = double_pole_delays([pole])[0]

    def gap(w):
        closed = loop(1j * w) / (1.0 + loop(1j * w))
        return np.abs(closed * np.exp(1j * w * delay) - 1.0)

    small = 0.02 * pole
    assert gap(small) < 2e-5
    assert gap(2.0 * small) / gap(small) == pytest.approx(8.0, rel=0.05)


def test_delay_of_the_pid_is_that_of_its_closed_loop():
    law = simc_joint(0.9, POLE, PERIOD)
    loop = double_lag(POLE) * pid_system(law)
    w = 0.01 * POLE
    back = 0.9 * loop(1j * w)
    found = reference_filter(law)(1j * w) * back / (1.0 + back)
    assert -np.angle(found) / w == pytest.approx(pid_delay(law, 0.9), rel=0.01)


def _error(made) -> float:
    """Return the RMS error of a sine of 20 degrees and 0.5 Hz over its amplitude, no hysteresis."""
    motion = discrete(double_lag(POLE), PERIOD, "zoh")

    def wanted(t):
        return np.sin(np.pi * t)

    x, state, command, errors = motion.initial_state(), None, 0.0, []
    for k in range(600):
        now = PERIOD * k
        seen = [float(motion.c @ x), command, *(0.35 * wanted(now + t) for t in TIMES)]
        action, state = made.predict(np.array(seen), state)
        command = float(action[0])
        x = motion.advance(command, x)
        errors.append(float(motion.c @ x) / 0.35 - wanted(now + PERIOD))
    return float(np.sqrt(np.mean(np.square(errors[200:]))))


def test_sine_is_followed_without_the_delay():
    late = _error(make_model_following(RIG, SIGNALS, ACTIONS))
    assert late == pytest.approx(np.sqrt(0.5) * np.pi * (2.0 / POLE + 0.5 * PERIOD), rel=0.02)
    assert _error(make_model_following(RIG, SIGNALS, ACTIONS, ahead=True)) < 0.02 * late
    for kind in ("pi", "pid", "pid_smooth"):
        made = make_joint_feedback(RIG, SIGNALS, ACTIONS, kind=kind, ahead=True)
        alone = make_joint_feedback(RIG, SIGNALS, ACTIONS, kind=kind)
        assert _error(made) < 0.1 * _error(alone)
