"""Modes of the published frequency response."""

import numpy as np
import pytest
from scipy import signal
from scipy.integrate import solve_ivp

from pam_envs.pneumatics.measured_dynamics import (
    DENOMINATOR,
    GAIN,
    NUMERATOR,
    REAL_MODES,
    gain_at_rest,
    mode_rows,
    modes,
    pair_factor,
    turned,
)


def rational(s: complex) -> complex:
    top, bottom = complex(GAIN), complex(1.0)
    for a, b, c in NUMERATOR:
        top *= a * s * s + b * s + c
    for a, b, c in DENOMINATOR:
        bottom *= a * s * s + b * s + c
    return top / bottom


def test_static_gain_is_as_published() -> None:
    assert gain_at_rest() == pytest.approx(0.7398, abs=1e-4)
    assert rational(0j).real == pytest.approx(gain_at_rest())


def test_modes_equal_the_frequency_response() -> None:
    for omega in (0.0, 0.63, 3.0, 6.3, 12.6, 60.0):
        s = 1j * omega
        total = 0j
        for pole, gain in modes():
            total += -pole * gain / (s - pole)
            if pole.imag:
                total += -pole.conjugate() * gain.conjugate() / (s - pole.conjugate())
        assert total == pytest.approx(rational(s) / gain_at_rest(), abs=1e-9)


def test_phases_equal_the_published_ones() -> None:
    for frequency, phase in ((0.1, -10.6), (0.5, -55.8), (1.0, -105.4), (2.0, -163.8)):
        value = rational(2j * np.pi * frequency)
        assert np.degrees(np.angle(value)) == pytest.approx(phase, abs=0.1)


def test_step_response_is_exact() -> None:
    """Steps of two lengths under held setpoints, against a cascade integrated numerically."""
    rows = mode_rows()
    rates, gains = np.array(rows[:REAL_MODES]), rows[REAL_MODES : 2 * REAL_MODES]
    decay_rate, frequency, real_gain, imaginary_gain = rows[2 * REAL_MODES :]
    zeros = np.concatenate([np.roots(factor) for factor in NUMERATOR])
    poles = np.concatenate([np.roots(np.trim_zeros(factor, "f")) for factor in DENOMINATOR])
    a, b, c, _ = signal.zpk2ss(zeros, poles, GAIN / gain_at_rest())
    x, pair, state = np.zeros(REAL_MODES), (0.0, 0.0), np.zeros(len(a))
    made, truth = [], []
    for value in np.random.default_rng(1).uniform(0, 4e5, 30):
        for h in (0.03, 0.07):
            x = value + (x - value) * np.exp(-rates * h)
            pair = turned(value, *pair, *pair_factor(decay_rate, frequency, h))
        made.append(np.dot(gains, x) + real_gain * pair[0] - imaginary_gain * pair[1])
        run = solve_ivp(
            lambda _, s, u=value: a @ s + b[:, 0] * u, (0.0, 0.1), state, rtol=1e-9, atol=1e-6
        )
        state = run.y[:, -1]
        truth.append(float(c[0] @ state))
    assert np.allclose(made, truth, atol=1.0)
