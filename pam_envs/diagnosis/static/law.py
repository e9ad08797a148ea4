"""Load laws other than linear, and the loads that would separate them.

A linear law, fixed beforehand, predicts held-out loads. An exponent or a dead zone fitted later has
used the held-out load, unless there are enough loads to refit it without each; with fewer it is
labelled *post hoc*.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pam_envs.diagnosis.arrays import Array
from pam_envs.diagnosis.static.compare import (
    Interval,
    Model,
    Study,
    gain,
    interval,
    p_value,
    parameter_draws,
    pure_error,
)
from pam_envs.diagnosis.static.models import DEAD_LOAD, EXPONENT, Term, units

LOADS_FOR_A_LAW = 5
"""Least number of loads for a law that is fitted without the held-out load."""
GRID = 24
"""Number of loads at which rivals are compared, up to the largest measured."""


@dataclass(frozen=True)
class Law:
    """A load law other than linear, common to all effects of the load.

    ``value`` and its 95 % interval are those of its parameter in its own unit, ``p`` is the p-value
    against the linear law. It is ``post_hoc`` if its parameter was fitted to the held-out loads.
    """

    term: Term
    model: Model
    value: float
    interval: Interval
    p: float
    post_hoc: bool


def load_laws(study: Study, model: Model) -> tuple[Law, ...]:
    """Return the load laws that can be fitted, if a named effect depends on the load."""
    acts = any(term.loads > 1 for term in model.terms)
    if not acts or len(study.cells.loads) < EXPONENT.loads:
        return ()
    return tuple(_law(study, model, term) for term in (EXPONENT, DEAD_LOAD))


def _law(study: Study, model: Model, term: Term) -> Law:
    free = study.extended([model], (*model.terms, term))
    scale = units(term.number, study.cells.scale)
    low, high = interval(parameter_draws(study, free)[:, -1])
    value, judged = float(free.fit.theta[0, -1]), free
    seen = len(study.cells.loads) < LOADS_FOR_A_LAW
    if seen:  # the law's parameter is fixed at its fit to all data
        number, start = replace(term.number, low=value, high=value), free.fit.theta.copy()
        start[:, -1] = value
        judged = study.refitted((*model.terms, replace(term, number=number)), start)
    p = p_value(study, model, free)
    return Law(term, judged, value * scale, (low * scale, high * scale), p, seen)


def separated(study: Study, laws: Sequence[Law]) -> bool:
    """Return whether one of two laws has a significantly larger gain."""
    if len(laws) < 2:
        return True
    _, (low, high) = gain(study, laws[0].model, laws[1].model)
    return max(low, -high) > 1e-3


@dataclass(frozen=True)
class NextLoads:
    """Largest difference of two models over a cycle, and the ``best`` loads [kg] to measure next.

    ``apart`` is the root mean square difference [mm] at ``load`` [kg], ``separation`` its square in
    variances of a cell's mean with the table's number of repeats.
    """

    load: float
    apart: float
    separation: float
    best: tuple[float, ...]


def next_loads(study: Study, one: Model, other: Model) -> NextLoads:
    """Return the separation of two models fitted to the same readings."""
    cells = study.cells
    heaviest = cells.scale[0]
    loads = heaviest * np.arange(1, GRID + 1) / GRID
    there = [replace(cells, load=np.full(len(cells.load), load / heaviest)) for load in loads]
    misses = [(one.fit.predict(c)[0] - other.fit.predict(c)[0])[cells.used] for c in there]
    apart = np.array([np.sqrt(np.mean(miss**2)) * cells.millimetres for miss in misses])
    repeats, at = float(np.mean(cells.counts[cells.used])), int(np.argmax(apart))
    separation = repeats * float(apart[at] / pure_error(cells)[0]) ** 2
    best = _peaks(cells.loads, loads, apart)
    return NextLoads(float(loads[at]), float(apart[at]), separation, best)


def _peaks(measured: Sequence[float], loads: Array, apart: Array) -> tuple[float, ...]:
    """Return the load of largest difference in each gap between measured loads, two at most."""
    gap = np.searchsorted(measured, loads - 1e-9)
    gaps = [np.flatnonzero(gap == g) for g in np.unique(gap)]
    peaks = sorted((int(i[np.argmax(apart[i])]) for i in gaps), key=lambda i: -float(apart[i]))
    return tuple(float(loads[i]) for i in peaks[:2])
