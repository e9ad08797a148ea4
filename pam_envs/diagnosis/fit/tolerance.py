"""What the owner of a rig knows to a tolerance: names, and whether a fitted error lies within.

A load that is told to 2 % may be 2 % off: what a fit makes of it within that is calibration. Only
what surely lies beyond is an error of the payload.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import Candidate, complete_jacobian, refit
from pam_envs.diagnosis.fit.intervals import spans
from pam_envs.diagnosis.fit.least_squares import Fit, Problem
from pam_envs.diagnosis.fit.single_muscle import BASE
from pam_envs.plants.single_muscle import rows as R
from pam_envs.wording import near

LOAD = "mass.load"
"""The declared parameter whose error a cause stands for."""
LOAD_ERROR = "mass.load_error"
PAYLOAD_ERROR, IMITATES_PAYLOAD_ERROR = "payload_error", "load_dependent_compliance"
UNWEIGHED = 0.5
"""Relative error of a load of which nothing is declared."""


def unknown_names(tolerance: Iterable[str]) -> list[str]:
    """Return a sentence on each name that is no parameter of the plant."""
    none = ", which is no parameter of the plant; docs/diagnosis_causes.md lists them"
    return [
        f"RIG.yaml: tolerance names {name!r}{near(name, R.NAMES, none)}"
        for name in tolerance
        if name not in R.NAMES
    ]


def unused_tolerances(tolerance: Iterable[str]) -> list[str]:
    """Return the names of which no refit could leave the tolerance."""
    return [name for name in tolerance if name not in (*BASE, LOAD)]


def load_error_limit(loads: ArrayLike, tolerance: float) -> float:
    """Return by how much the lightest load that was hung may be off [kg]; infinite if none was."""
    hung = np.asarray(loads, float)
    return tolerance * float(np.min(hung[hung > 0.0], initial=np.inf))


def may_be_within(interval: tuple[float, float], loads: ArrayLike, tolerance: float) -> bool:
    """Return whether an error of the load may lie within what was declared.

    Parameters
    ----------
    interval : tuple of float
        Where the fitted error lies with 95 % [kg].
    loads : array_like
        What was hung [kg]; of nothing there is no error.
    tolerance : float
        Relative error within which each load is known.

    Returns
    -------
    bool
        False if for one of the loads the whole interval lies outside.
    """
    limit, (low, high) = load_error_limit(loads, tolerance), sorted(interval)
    return bool(low <= limit and high >= -limit)


def load_error_interval(problem: Problem, blocks: Blocks, fit: Fit) -> tuple[float, float]:
    """Return where the error of the load lies with 95 % [kg]; open at a bound."""
    low, high = spans(problem, blocks, fit)[LOAD_ERROR]["interval"]
    return (-np.inf if low is None else low), (np.inf if high is None else high)


def may_be_load(
    problem: Problem, blocks: Blocks, model: Candidate, loads: ArrayLike, known: float | None
) -> bool:
    """Return whether a model may stand for an error of the load that is not excluded.

    Where nothing is declared of the loads, what depends on them may be their error.
    """
    if known is None:
        return IMITATES_PAYLOAD_ERROR in model.names
    if PAYLOAD_ERROR not in model.names:
        return False
    return may_be_within(load_error_interval(problem, blocks, model.fit), loads, known)


def refit_load(
    problem: Problem, blocks: Blocks, family: Any, base: Candidate, limit: float
) -> Candidate:
    """Return the base with the error of the load refitted too, within a limit [kg]."""
    free = family.free(LOAD_ERROR, low=-limit, high=limit, scale=limit, start=0.0, prior=np.inf)
    fit = replace(
        base.fit,
        frees=(*base.fit.frees, free),
        z=np.append(base.fit.z, 0.0),
        slopes=np.zeros((0, 0)),
        shared=None,
        begins={},
    )
    found = refit(problem, blocks, Candidate((), fit, base.errors))
    complete_jacobian(problem, found.fit)
    return found
