"""Search over causes: forms of a cause compared after convergence."""

import numpy as np

from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.decide.search import converged
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import complete_jacobian, fit_base, initial_fits
from pam_envs.diagnosis.fit.least_squares import Problem, evaluate, improve, share
from tests.diagnosis.decide.rule_record import TIME, Line

TRUTH = np.array([1.2, 2.0, 0.1, 0.0, 0.9, 0.0])
NOISE = np.array([0.1, 0.3])
FORMS = (Form("bend", (Term("cube", (0.01,)),)), Form("slope", (Term("slope", (0.1,)),)))
CAUSE = Cause("nonlinearity", "nonlinearity", FORMS)


def test_form_behind_before_convergence_wins_after_it():
    line = Line()
    drawn = np.random.default_rng(5).standard_normal((2, len(TIME))) * NOISE[:, None]
    measured = line.simulate(TRUTH[None])[:, :, 0] + drawn
    blocks = Blocks.make(TIME, measured)
    problem = Problem(line.simulate, measured, NOISE, blocks.train, TIME)
    base = fit_base(problem, blocks, line.column, [(line.free("gain"), line.free("lag"))])
    complete_jacobian(problem, base.fit)
    shared = share(problem, base.fit)
    bend, slope = (initial_fits(problem, line, base.fit, CAUSE, form, shared)[0] for form in FORMS)
    evaluate(problem, [bend, slope])
    improve(problem, [slope], 6, 1e-4)
    assert slope.cost < bend.cost
    (best,) = converged(problem, blocks, base, [bend, slope], 1)
    assert best is bend
