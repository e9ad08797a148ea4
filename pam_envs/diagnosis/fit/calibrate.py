"""Calibration of the plant's base parameters, so that wrong values are not taken for effects."""

from __future__ import annotations

import dataclasses

import numpy as np

from pam_envs.diagnosis.arrays import Array
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import Candidate, fit_base
from pam_envs.diagnosis.fit.first_guess import balance, start_at_guess
from pam_envs.diagnosis.fit.least_squares import Fit, Problem, column_of, evaluate, improve
from pam_envs.diagnosis.fit.single_muscle import MuscleFamily
from pam_envs.hysteresis.maxwell_slip import PlayOperator

PRESSURE = ("regulator.gain", "regulator.time_constant")
FAST = 0.04
"""Lag [s] below which the replay takes finer steps."""
FINE_STEP = 0.0101
GUESS_ROUNDS, ROUNDS = 6, 12
FAR = 8.0
"""Cost per reading above which a fit may be in a local optimum."""


def calibrate(
    family: MuscleFamily, measured: Array, noise: Array, blocks: Blocks, time: Array
) -> tuple[MuscleFamily, Problem, Candidate]:
    """Return the family, the problem and the fitted base.

    The regulator is fitted first, to the pressure alone; then the static map and the friction by a
    regression of the force balance; then all parameters by simulation. If that fit is far from the
    readings, a second one starts from the given plant, and the better of the two is kept.
    ``measured`` (channels, T) is NaN where there is no reading, ``noise`` (channels,) its standard
    deviation.
    """
    problem = Problem(family.simulate, measured, noise, blocks.train, time, family.tie)
    frees, column = family.base(), family.column
    found: dict[str, float] = {}
    if np.isfinite(measured[1]).any():
        fit = _regulator(problem, family)
        found |= fit.values()
        column = column_of(fit, fit.z)
        if found["regulator.time_constant"] < FAST:
            family = family.finer(FINE_STEP)
            problem = dataclasses.replace(problem, simulate=family.simulate)
    tried = [frees]
    plays = family.plant.hysteresis.model.kind == PlayOperator.kind
    if np.isfinite(measured[0]).any() and plays:
        law = balance(family, measured[0], family.simulate(column[None])[1, :, 0])
        guess = start_at_guess(frees, found | law)
        tried = [guess, frees] if law else [guess]
    best = fit_base(problem, blocks, column, tried[0], ROUNDS)
    for start in tried[1:]:
        if best.fit.cost < FAR * problem.seen:
            break
        other = fit_base(problem, blocks, column, start, ROUNDS)
        best = min(best, other, key=lambda c: c.fit.cost)
    return family, problem, best


def _regulator(problem: Problem, family: MuscleFamily) -> Fit:
    """Return the fit of the regulator's gain and lag to the pressure."""
    frees = tuple(f for f in family.base() if f.name in PRESSURE)
    alone = problem.measured.copy()
    alone[0] = np.nan
    only = dataclasses.replace(problem, measured=alone)
    fit = Fit.at_start(frees, family.column)
    evaluate(only, [fit])
    improve(only, [fit], GUESS_ROUNDS, 1e-4)
    return fit
