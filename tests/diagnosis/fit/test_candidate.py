"""Models without one of their causes."""

import numpy as np

from pam_envs.arrays import Array
from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import Candidate, fit_base, without_each_cause
from pam_envs.diagnosis.fit.least_squares import Fit, Free, Problem, evaluate

TIME = np.arange(3000) * 0.02
GAIN = Free("gain", 0, -10.0, 10.0, 0.1, start=1.0)
SHIFT = Free("shift", 1, -5.0, 5.0, 0.1)
PATCH = Free("patch", 2, -10.0, 10.0, 0.1)


def waves(columns: Array) -> Array:
    """Return a wave whose frequency is shifted, and a patch without the shift, shape (1, T, n)."""
    gain, shift, patch = columns.T[:, None, :]
    time = TIME[:, None]
    return (gain * np.sin((2.0 + shift) * time) + patch * np.sin(2.0 * time))[None]


def test_calibration_does_not_hold_a_model_without_a_cause_in_a_local_optimum():
    drawn = 0.1 * np.random.default_rng(2).standard_normal((1, len(TIME)))
    measured = waves(np.array([[2.0, 0.0, 0.0]]))[:, :, 0] + drawn
    blocks = Blocks.make(TIME, measured)
    problem = Problem(waves, measured, np.array([0.1]), blocks.train, TIME)
    base = fit_base(problem, blocks, np.zeros(3), [(GAIN,)])
    fit = Fit((GAIN, SHIFT, PATCH), np.array([0.0, 5.0, 20.0]), np.zeros(3))
    evaluate(problem, [fit])
    cause = Cause("patch", "patch", (Form("patch", (Term("patch", (0.1,)),)),))
    errors = blocks.errors(problem.rows(fit.residual))
    model = Candidate(((cause, cause.forms[0]),), fit, errors)
    less = without_each_cause(problem, blocks, base, model)["patch"]
    assert less.causes == ()
    assert blocks.gain(less.errors, model.errors) < 0.01
