"""Intended motions: smooth, within their range, the same from the same key."""

import numpy as np
import pytest

from pam_envs.kernels.build import entry
from pam_envs.kernels.random import seed_words
from pam_envs.references.path import least_jerk
from pam_envs.references.reaches import (
    KIND,
    MIXED,
    MOTIONS,
    REACHES,
    ROWS,
    SINES,
    STILL,
    WINDOW,
    draw_motion,
    least_jerk_bend,
    least_jerk_rate,
    motion_at,
)

LOW, HIGH, SECONDS = 0.3, 1.8, 2.5
draw = entry(draw_motion)
_motion_at = entry(motion_at)


def drawn(seed: int, kind: int) -> np.ndarray:
    rows = np.zeros((ROWS, 1))
    draw(rows, 0, 0, *seed_words(seed), kind, LOW, HIGH, SECONDS)
    return rows


def at(seed: int, kind: int, t: float) -> tuple[float, float, float]:
    """Return angle, rate and acceleration of a drawn motion at a time [s]."""
    return _motion_at(drawn(seed, kind), 0, 0, *seed_words(seed), t)


def course(seed: int, kind: int, times: np.ndarray) -> np.ndarray:
    """Return angle, rate and acceleration, shape (3, n)."""
    rows, key = drawn(seed, kind), seed_words(seed)
    return np.array([_motion_at(rows, 0, 0, *key, float(t)) for t in times]).T


@pytest.mark.parametrize("kind", [REACHES, SINES, STILL])
def test_motions_stay_in_their_range_and_begin_at_rest(kind):
    times = np.arange(0.0, 20.0, 0.05)
    for seed in range(5):
        angle, rate, _ = course(seed, kind, times)
        assert angle.min() >= LOW - 1e-12 and angle.max() <= HIGH + 1e-12
        assert rate[0] == pytest.approx(0.0, abs=1e-12)
        assert (np.ptp(angle) > 0.3) == (kind != STILL)


@pytest.mark.parametrize("kind", [REACHES, SINES])
def test_rate_and_acceleration_are_derivatives(kind):
    h, times = 1e-5, np.arange(0.1, 12.0, 0.013)
    slopes = (course(3, kind, times + h) - course(3, kind, times - h)) / (2.0 * h)
    assert np.allclose(slopes[:2], course(3, kind, times)[1:], atol=1e-4)


def test_reaches_join_and_rest_between():
    for window in range(1, 6):
        before, after = (at(1, REACHES, SECONDS * window + d) for d in (-1e-9, 1e-9))
        assert before[0] == pytest.approx(after[0], abs=1e-9)
        assert before[1] == pytest.approx(0.0, abs=1e-9)


def test_reach_has_minimum_jerk():
    """Fifth order, symmetric, with neither speed nor acceleration at its ends."""
    u = np.linspace(0.0, 1.0, 41)
    s = np.array([least_jerk(float(x)) for x in u])
    assert (s[0], s[-1], s[20]) == (0.0, 1.0, 0.5)
    assert np.allclose(s + s[::-1], 1.0)
    assert np.allclose(np.diff(s, 6), 0.0, atol=1e-12)  # no sixth derivative
    assert np.abs(np.diff(s, 5)).min() > 1e-8
    v = np.array([least_jerk_rate(float(x)) for x in u])
    assert v[0] == v[-1] == 0.0
    assert v.max() == pytest.approx(1.875)
    assert v[1] < 0.02  # grows with the square of the time
    bend = np.array([least_jerk_bend(float(x)) for x in u])
    assert np.allclose(bend[1:-1], (v[2:] - v[:-2]) * 20.0, atol=0.05)


def test_mixed_motions_draw_each_kind_and_depend_on_the_key():
    kinds = {int(drawn(seed, MIXED)[KIND, 0]) for seed in range(40)}
    assert kinds == set(range(len(MOTIONS) - 1))
    times = np.arange(0.0, 8.0, 0.1)
    one, other = (course(seed, REACHES, times)[0] for seed in (7, 8))
    assert np.array_equal(one, course(7, REACHES, times)[0])
    assert np.abs(one - other).max() > 0.1
    assert drawn(7, REACHES)[WINDOW, 0] == SECONDS
