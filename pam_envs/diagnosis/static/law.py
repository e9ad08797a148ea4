"""Load laws other than linear, and the loads that would separate them.

A linear law, fixed beforehand, predicts held-out loads. An exponent or a dead zone fitted later has
used the held-out load, unless there are enough loads to refit it without each; with fewer it is
labelled *post hoc*.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pam_envs.arrays import Array
from pam_envs.diagnosis.static import compare
from pam_envs.diagnosis.static.compare import interval
from pam_envs.diagnosis.static.models import DEAD_LOAD, EXPONENT, Term, units

LOADS_FOR_A_LAW = 5  # least number of loads for a law that is fitted without the held-out load
GRID = 24  # number of loads at which rivals are compared, up to the largest measured


@dataclass(frozen=True)
class Law:
    """A load law other than linear, common to all effects of the load."""

    term: Term
    model: compare.Model
    value: float  # of its parameter in its own unit
    interval: compare.Interval  # 95 %
    p: float  # p-value against the linear law
    post_hoc: bool  # whether its parameter was fitted to the held-out loads


def load_laws(study: compare.Study, model: compare.Model) -> tuple[Law, ...]:
    """Return the load laws that can be fitted, if a named effect depends on the load."""
    acts = any(term.loads > 1 for term in model.terms)
    if not acts or len(study.cells.loads) < EXPONENT.loads:
        return ()
    return tuple(_law(study, model, term) for term in (EXPONENT, DEAD_LOAD))


def _law(study: compare.Study, model: compare.Model, term: Term) -> Law:
    free = study.extended([model], (*model.terms, term))
    scale = units(term.number, study.cells.scale)
    low, high = interval(compare.parameter_draws(study, free)[:, -1])
    value, judged = float(free.fit.theta[0, -1]), free
    seen = len(study.cells.loads) < LOADS_FOR_A_LAW
    if seen:  # the law's parameter is fixed at its fit to all data
        number, start = replace(term.number, low=value, high=value), free.fit.theta.copy()
        start[:, -1] = value
        judged = study.refitted((*model.terms, replace(term, number=number)), start)
    p = compare.p_value(study, model, free)
    return Law(term, judged, value * scale, (low * scale, high * scale), p, seen)


def separated(study: compare.Study, laws: Sequence[Law]) -> bool:
    """Return whether one of two laws has a significantly larger gain."""
    if len(laws) < 2:
        return True
    _, (low, high) = compare.gain(study, laws[0].model, laws[1].model)
    return max(low, -high) > 1e-3


@dataclass(frozen=True)
class NextLoads:
    """Largest difference of two models over a cycle."""

    load: float  # [kg]
    apart: float  # root mean square difference there [mm]
    separation: float  # its square in variances of a cell's mean with the table's number of repeats
    best: tuple[float, ...]  # loads to measure next [kg]


def next_loads(study: compare.Study, one: compare.Model, other: compare.Model) -> NextLoads:
    """Return the separation of two models fitted to the same readings."""
    cells = study.cells
    heaviest = cells.scale[0]
    loads = heaviest * np.arange(1, GRID + 1) / GRID
    there = [replace(cells, load=np.full(len(cells.load), load / heaviest)) for load in loads]
    misses = [(one.fit.predict(c)[0] - other.fit.predict(c)[0])[cells.used] for c in there]
    apart = np.array([np.sqrt(np.mean(miss**2)) * cells.millimetres for miss in misses])
    repeats, at = float(np.mean(cells.counts[cells.used])), int(np.argmax(apart))
    separation = repeats * float(apart[at] / compare.pure_error(cells)[0]) ** 2
    best = _peaks(cells.loads, loads, apart)
    return NextLoads(float(loads[at]), float(apart[at]), separation, best)


def _peaks(measured: Sequence[float], loads: Array, apart: Array) -> tuple[float, ...]:
    """Return the load of largest difference in each gap between measured loads, two at most."""
    gap = np.searchsorted(measured, loads - 1e-9)
    gaps = [np.flatnonzero(gap == g) for g in np.unique(gap)]
    peaks = sorted((int(i[np.argmax(apart[i])]) for i in gaps), key=lambda i: -float(apart[i]))
    return tuple(float(loads[i]) for i in peaks[:2])
