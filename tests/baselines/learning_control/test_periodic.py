"""Learning over a period: contraction of the error, limits, smoothing."""

import numpy as np
import pytest

from baselines.learning_control.periodic import PeriodicLearning


@pytest.mark.parametrize(("gain", "plant"), [(0.5, 1.0), (0.5, 1.3), (0.8, 0.7)])
def test_smooth_error_contracts_by_the_predicted_rate(gain, plant):
    learning = PeriodicLearning(50.0, gain, 100.0)
    times = np.arange(50.0)
    disturbance = np.sin(2.0 * np.pi * times / 50.0)
    correction, sizes = learning.start(1), []
    for _ in range(6):
        error = disturbance - plant * learning.read(correction, times[None])[0]
        sizes.append(np.sqrt(np.mean(error**2)))
        for time, value in zip(times, error, strict=True):
            correction = learning.learn(correction, np.array([time]), value[None], np.ones(1, bool))
    smoothed = 1.0 - gain * plant * np.cos(np.pi / 50.0) ** 4  # the filter's gain at the sine
    np.testing.assert_allclose(np.array(sizes[1:]) / sizes[:-1], abs(smoothed), rtol=1e-6)


def test_correction_is_limited_and_untracked_rows_keep_theirs():
    learning = PeriodicLearning(10.0, 1.0, 2.0)
    tracked, correction = np.array([True, False]), learning.start(2)
    for _ in range(5):
        correction = learning.learn(correction, np.zeros(2), np.ones(2), tracked)
    assert correction[0, 0] == 2.0 and not correction[1].any()


def test_correction_repeats_with_a_period_that_is_no_whole_number():
    learning = PeriodicLearning(122.4, 0.5, 10.0)
    correction = np.random.default_rng(0).normal(size=(1, learning.bins))
    times = np.linspace(0.0, 122.0, 7)[None]
    again = learning.read(correction, times + 3.0 * 122.4)
    np.testing.assert_allclose(again, learning.read(correction, times), atol=1e-9)
