"""Linear systems behind a dead time."""

import numpy as np
import pytest

from baselines.linear.systems import delayed, discrete, double_lag

PERIOD, FINE = 0.01, 100


@pytest.mark.parametrize("dead_time", [0.0, 0.002, 0.01, 0.013, 0.03])
def test_delayed_system_has_the_response_of_a_fine_simulation(dead_time):
    inputs = np.random.default_rng(0).normal(size=60)
    found = outputs(delayed(double_lag(20.0), dead_time, PERIOD), inputs)
    late = round(dead_time / PERIOD * FINE)
    held = np.concatenate([np.zeros(late), np.repeat(inputs, FINE)])[: FINE * len(inputs)]
    fine = outputs(discrete(double_lag(20.0), PERIOD / FINE, "zoh"), held)
    np.testing.assert_allclose(found, fine[::FINE], atol=1e-9)


def outputs(system, inputs):
    """Return the outputs before each input, from rest."""
    x, made = np.zeros(len(system.b)), []
    for u in inputs:
        made.append(float(system.c @ x))
        x = system.a @ x + system.b * u
    return np.array(made)
