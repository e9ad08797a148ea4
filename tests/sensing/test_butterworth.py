"""Eighth-order low-pass against its textbook response."""

import numpy as np
import pytest
from scipy import signal

from pam_envs.sensing.butterworth import PERIOD, ROWS, butterworth, filtered, settle


def test_filter_equals_the_textbook_one():
    x = np.random.default_rng(0).normal(size=400)
    sections = signal.butter(8, 5.0, fs=1.0 / PERIOD, output="sos")
    rows = [[0.0] for _ in range(ROWS)]
    y = [butterworth(rows, 0, 0, float(value)) for value in x]
    assert np.allclose(y, signal.sosfilt(sections, x), atol=1e-9)


def test_settled_filter_keeps_its_output():
    rows = [[0.0] for _ in range(ROWS)]
    settle(rows, 0, 0, 7.5)
    assert all(butterworth(rows, 0, 0, 7.5) == pytest.approx(7.5, abs=1e-12) for _ in range(50))
    assert np.allclose(filtered(np.full(40, -3.0)), -3.0, atol=1e-12)


def test_slow_signals_are_delayed_by_163_ms():
    t = PERIOD * np.arange(3000)
    y = filtered(np.sin(2 * np.pi * 0.2 * t))[1500:]
    late = np.sin(2 * np.pi * 0.2 * (t[1500:] - 0.163))
    assert np.abs(y - late).max() < 2e-3


def test_batch_is_refused():
    with pytest.raises(ValueError, match=r"shape \(2, 3\)"):
        filtered(np.zeros((2, 3)))
