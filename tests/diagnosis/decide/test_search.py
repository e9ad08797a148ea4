"""Search over causes: prediction of their gains, and forms compared after convergence."""

import dataclasses

import numpy as np
import pytest

from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.decide.compare import cross_validate, showing_alone
from pam_envs.diagnosis.decide.flexible_base import OBVIOUS, FlexibleBase
from pam_envs.diagnosis.decide.rule import Rule
from pam_envs.diagnosis.decide.screen import Screen
from pam_envs.diagnosis.decide.search import converged
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import (
    Candidate,
    complete_jacobian,
    fit_base,
    initial_fits,
)
from pam_envs.diagnosis.fit.least_squares import Free, Problem, evaluate, improve, share
from tests.diagnosis.decide.rule_record import TIME, Line

TRUTH = np.array([1.2, 2.0, 0.1, 0.0, 0.9, 0.0])
NOISE = np.array([0.1, 0.3])
FORMS = (Form("bend", (Term("cube", (0.01,)),)), Form("slope", (Term("slope", (0.1,)),)))
CAUSE = Cause("nonlinearity", "nonlinearity", FORMS)


def fitted(line, *frees, truth=TRUTH, shapes=None):
    """Return a problem with its blocks, and the base fitted to a noisy reading of a truth."""
    drawn = np.random.default_rng(5).standard_normal((2, len(TIME))) * NOISE[:, None]
    measured = Line().simulate(truth[None])[:, :, 0] + drawn
    blocks = Blocks.make(TIME, measured)
    more = {} if shapes is None else {"shapes": shapes}
    problem = Problem(line.simulate, measured, NOISE, blocks.train, TIME, **more)
    return problem, blocks, fit_base(problem, blocks, line.column, [frees])


class Twice(Line):
    """The line with a second offset."""

    column = np.append(Line.column, 0.0)

    def simulate(self, columns):
        """Return the outputs with the sum of both offsets."""
        whole = columns[:, :6].copy()
        whole[:, 3] += columns[:, 6]
        return super().simulate(whole)


@pytest.mark.parametrize(("high", "takes_all"), [(0.2, False), (1.0, True)])
def test_parameter_at_its_bound_takes_nothing_of_an_effect(high, takes_all):
    twice, cause = Twice(), Cause("offset", "offset", (Form("one", (Term("offset", (0.1,)),)),))
    zero = Free("zero", 6, 0.0, high, 0.1, start=0.0)
    truth = np.array([1.2, 2.0, 0.0, 0.4, 0.0, 0.0])
    frees = twice.free("gain"), twice.free("lag"), zero
    problem, _, base = fitted(twice, *frees, truth=truth)
    complete_jacobian(problem, base.fit)
    screen = Screen.make(problem, twice, base.fit, [cause])
    shared = share(problem, base.fit)
    ((gain, *_),) = screen.predictions(problem, twice, base.fit, shared, [cause])
    assert (gain < 5.0) if takes_all else (gain > 100.0)


def test_block_that_alone_shows_a_shape_is_in_every_fit_of_the_cross_validation():
    shapes = np.array([np.ones(len(TIME)), np.exp(-TIME / 1.0)])
    line = Line()
    problem, blocks, base = fitted(line, line.free("gain"), line.free("lag"), shapes=shapes)
    alone = showing_alone(problem, blocks)
    assert np.flatnonzero(alone).tolist() == [0]
    (found,) = cross_validate(problem, blocks, [base], Rule())
    assert np.array_equal(found.errors[:, 0], base.errors[:, 0])
    assert not np.array_equal(found.errors[:, 1], base.errors[:, 1])


def test_difference_that_changes_nothing_is_dropped_and_the_others_stay():
    line = Line()
    idle = Cause("idle", "idle", (Form("offset", (Term("offset", (0.1,)),)),), common=True)
    bend = Cause("bend", "bend", (Form("cube", (Term("cube", (0.1,)),)),), common=True)
    problem, blocks, base = fitted(line, line.free("gain"), line.free("lag"))
    frees = (*base.fit.frees, line.free("offset"), line.free("cube"))
    z = np.array([*base.fit.z, 0.0, 0.0])
    z[2] = frees[2].inner(1e-5)
    z[3] = frees[3].inner(0.9)
    fit = dataclasses.replace(base.fit, frees=frees, z=z, shared=None)
    evaluate(problem, [fit])
    model = Candidate(
        ((idle, idle.forms[0]), (bend, bend.forms[0])),
        fit,
        blocks.errors(problem.rows(fit.residual)),
    )
    less = FlexibleBase(problem, line, blocks, base, Rule()).acting(model)
    assert less.names == ("bend",)
    assert [f.name for f in less.fit.frees] == ["gain", "lag", "cube"]
    assert less.fit.values()["cube"] == pytest.approx(0.9)
    assert blocks.gain(less.errors, model.errors) == pytest.approx(0.0, abs=1e-3)


def test_unusual_difference_like_another_law_is_named_only_with_its_own_gain():
    line = Line()
    causes = [
        Cause(n, n, (Form(n, (Term(n, (0.1,)),)),), common=True, lawlike=True, by_nature=usual)
        for n, usual in (("slope", True), ("offset", False))
    ]
    truth = np.array([1.2, 2.0, 0.6, 0.24, 0.0, 0.0])
    problem, blocks, base = fitted(line, line.free("gain"), line.free("lag"), truth=truth)
    flexible = FlexibleBase(problem, line, blocks, base, Rule())
    model = flexible.fitted([(cause, cause.forms[0]) for cause in causes])
    gain = flexible.expected(model)["offset"]
    assert OBVIOUS < gain < Rule().unusual_gain
    needed = flexible.needed(model)
    assert needed.names == ("slope",)
    assert "offset" in needed.fit.values()


def test_form_behind_before_convergence_wins_after_it():
    line = Line()
    problem, blocks, base = fitted(line, line.free("gain"), line.free("lag"))
    complete_jacobian(problem, base.fit)
    shared = share(problem, base.fit)
    bend, slope = (initial_fits(problem, line, base.fit, CAUSE, form, shared)[0] for form in FORMS)
    evaluate(problem, [bend, slope])
    improve(problem, [slope], 6, 1e-4)
    assert slope.cost < bend.cost
    (best,) = converged(problem, blocks, base, [bend, slope], 1)
    assert best is bend
