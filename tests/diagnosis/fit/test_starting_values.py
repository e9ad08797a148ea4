"""Starting values from a grid: the best points, at the size that fits best."""

from types import SimpleNamespace

import numpy as np
import pytest

from pam_envs.diagnosis.cause import Form, Term
from pam_envs.diagnosis.fit.least_squares import Fit, Free, Problem, differentiate, evaluate
from pam_envs.diagnosis.fit.starting_values import grid

TIME = np.arange(2000) * 0.02
HERTZ = (0.5, 0.8, 1.3, 2.1)
FREES = {name: Free(name, k, -50.0, 50.0, 0.1) for k, name in enumerate(("slope", "size", "hertz"))}
FORM = Form("wave", (Term("size", (1.0,)), Term("hertz", (1.0,), amount=False)))


def simulate(columns):
    """Return one output, a ramp and a wave, shape (1, T, n)."""
    slope, size, hertz = columns.T[:, None, :]
    time = TIME[:, None]
    return (slope * time + size * np.sin(2.0 * np.pi * hertz * time))[None]


def starts_of(size, hertz):
    """Return the starting values on readings of a wave, far from the size of the grid."""
    noise = 0.01 * np.random.default_rng(0).standard_normal(len(TIME))
    measured = simulate(np.array([[0.3, size, hertz]]))[:, :, 0] + noise
    problem = Problem(simulate, measured, np.array([0.01]), np.ones(len(TIME), bool), TIME)
    base = Fit.at_start((FREES["slope"],), np.array([0.3, 0.0, 1.0]))
    evaluate(problem, [base])
    differentiate(problem, [base])
    family = SimpleNamespace(
        column=np.array([0.0, 0.0, 1.0]), free=lambda name, **changes: FREES[name]
    )
    return grid((1.0, -1.0), HERTZ, best=1)(problem, family, base, FORM)


@pytest.mark.parametrize("size", [0.05, -0.05, 3.0])
@pytest.mark.parametrize("hertz", HERTZ)
def test_best_point_has_the_frequency_and_the_size_of_the_readings(size, hertz):
    ((found, frequency),) = starts_of(size, hertz)
    assert frequency == hertz
    assert found == pytest.approx(size, rel=0.05)
