"""Preview of joint references: weights, delays, and tracking error."""

import numpy as np
import pytest

from baselines.core.controller import preview_weights
from baselines.core.entry import Spec
from baselines.joint.base import MAX_EXTRAPOLATION
from baselines.joint.feedback import (
    make_joint_feedback,
    pid_delay,
    pid_system,
    reference_filter,
    simc_joint,
)
from baselines.joint.model import POLE, pi_delay, pi_system, pole_cancelling
from baselines.joint.model_following import make_model_following
from baselines.linear.systems import discrete, double_lag
from benchmarks.papers.joint_studies import ACTIONS, RANGE, ReducedRig
from pam_envs.parameters import Signal, Signals

PERIOD, TIMES = 0.01, (0.0, 0.04, 0.08, 0.12)
NAMES = ("angle", "set_point", "reference", "reference_1", "reference_2", "reference_3")
SIGNALS = Signals(
    Signal(name, "rad", -RANGE, RANGE, k, False, max(0.0, 0.04 * (k - 2)))
    for k, name in enumerate(NAMES)
)
SPEC = Spec(ReducedRig(0.0), SIGNALS, ACTIONS)


def _read(lead, samples, times=TIMES):
    return preview_weights(times, lead, MAX_EXTRAPOLATION) @ samples


@pytest.mark.parametrize("lead", [0.0, 0.01, 0.05, 0.12, 0.2])
def test_straight_line_is_read_exactly_within_and_beyond_the_previews(lead):
    assert _read(lead, 0.3 - 2.0 * np.array(TIMES)) == pytest.approx(0.3 - 2.0 * lead, abs=1e-12)


@pytest.mark.parametrize(
    ("times", "lead", "weights"),
    [
        (TIMES, 0.05, [0.0, 0.75, 0.25, 0.0]),
        (TIMES, 0.0, [1.0, 0.0, 0.0, 0.0]),
        ((0.0,), 0.3, [1.0]),
        ((0.0, 0.04, 0.08), 0.5, [0.0, 0.0, 1.0]),
    ],
)
def test_weights_interpolate_the_neighbouring_samples(times, lead, weights):
    np.testing.assert_allclose(preview_weights(times, lead), weights, atol=1e-12)


def test_extrapolation_is_bounded():
    assert _read(99.0, [0.0, 0.0, 0.0, 1.0]) == 1.0 + MAX_EXTRAPOLATION


@pytest.mark.parametrize("pole", [5.5, POLE])
def test_loop_of_the_pi_equals_a_delay_up_to_third_order(pole):
    loop = double_lag(pole) * pi_system(pole_cancelling(pole=pole))
    delay = pi_delay(pole)

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

    def desired(t):
        return np.sin(np.pi * t)

    x, state, command, errors = motion.initial_state(), None, 0.0, []
    for k in range(600):
        now = PERIOD * k
        seen = [float(motion.c @ x), command, *(0.35 * desired(now + t) for t in TIMES)]
        action, state = made.predict(np.array(seen), state)
        command = float(action[0])
        x = motion.advance(command, x)
        errors.append(float(motion.c @ x) / 0.35 - desired(now + PERIOD))
    return float(np.sqrt(np.mean(np.square(errors[200:]))))


def test_preview_removes_the_delay_of_a_sine():
    late = _error(make_model_following(SPEC))
    assert late == pytest.approx(np.sqrt(0.5) * np.pi * (2.0 / POLE + 0.5 * PERIOD), rel=0.02)
    assert _error(make_model_following(SPEC, ahead=True)) < 0.02 * late
    for kind in ("pi", "pid", "pid_smooth"):
        made = make_joint_feedback(SPEC, kind=kind, ahead=True)
        alone = make_joint_feedback(SPEC, kind=kind)
        assert _error(made) < 0.1 * _error(alone)
