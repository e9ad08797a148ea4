"""Declared tolerances of parameters, and the test of a fitted load error against its tolerance.

A load declared to 2 % may be off by 2 %: a fitted error within the tolerance is calibration, only
one that is significantly larger is an error of the payload.
"""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import Candidate, complete_jacobian, refit, restarted
from pam_envs.diagnosis.fit.intervals import spans
from pam_envs.diagnosis.fit.least_squares import PlantFamily, Problem
from pam_envs.plants.single_muscle import rows as R
from pam_envs.wording import near

LOAD = "mass.load"  # the declared parameter whose error is a cause
LOAD_ERROR = "mass.load_error"
PAYLOAD_ERROR, IMITATES_PAYLOAD_ERROR = "payload_error", "load_dependent_compliance"
UNWEIGHED = 0.5  # relative error of a load without a declared tolerance


def unknown_names(
    tolerance: Iterable[str], names: Sequence[str] = R.NAMES, key: str = "tolerance"
) -> list[str]:
    """Return a sentence for each name that is not a parameter of the plant."""
    none = ", which is not a parameter of the plant; docs/diagnosis_causes.md lists them"
    return [
        f"RIG.yaml: {key} names {name!r}{near(name, names, none)}"
        for name in tolerance
        if name not in names
    ]


def load_error_limit(loads: ArrayLike, tolerance: float) -> float:
    """Return the largest error of the lightest load within tolerance [kg]; infinite without one."""
    loads = np.asarray(loads, float)
    return tolerance * float(np.min(loads[loads > 0.0], initial=np.inf))


def may_be_within(interval: tuple[float, float], loads: ArrayLike, tolerance: float) -> bool:
    """Return whether an error of the load, by its interval [kg], may be within tolerance."""
    limit, (low, high) = load_error_limit(loads, tolerance), sorted(interval)
    return bool(low <= limit and high >= -limit)


def may_be_load(
    problem: Problem, blocks: Blocks, model: Candidate, loads: ArrayLike, known: float | None
) -> bool:
    """Return whether a model may explain an error of the load within its tolerance.

    Without a declared tolerance any effect that depends on the load may be an error of it.
    """
    if known is None:
        return IMITATES_PAYLOAD_ERROR in model.names
    if PAYLOAD_ERROR not in model.names:
        return False
    low, high = spans(problem, blocks, model.fit)[LOAD_ERROR]["interval"]
    interval = (-np.inf if low is None else low, np.inf if high is None else high)
    return may_be_within(interval, loads, known)


def refit_load(
    problem: Problem, blocks: Blocks, family: PlantFamily, base: Candidate, limit: float
) -> Candidate:
    """Return the base refitted together with the error of the load, within a limit [kg]."""
    free = family.free(LOAD_ERROR, low=-limit, high=limit, scale=limit, start=0.0, prior=np.inf)
    fit = restarted(
        base.fit, frees=(*base.fit.frees, free), z=np.append(base.fit.z, 0.0), shared=None
    )
    found = refit(problem, blocks, Candidate(base.causes, fit, base.errors))
    complete_jacobian(problem, found.fit)
    return found
