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
from pam_envs.diagnosis.static.cells import Cells
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
    against the linear law, ``left_load`` the mean error on held-out loads [mm]. It is ``post_hoc``
    if its parameter was fitted to the held-out loads.
    """

    term: Term
    model: Model
    value: float
    interval: Interval
    p: float
    left_load: float
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
    draws = parameter_draws(study, free)
    (low, high), value = interval(draws[:, -1]), float(free.fit.theta[0, -1])
    seen = len(study.cells.loads) < LOADS_FOR_A_LAW
    judged = _fixed(study, model, free, term, value) if seen else free
    return Law(
        term,
        judged,
        value * scale,
        (low * scale, high * scale),
        p_value(study, model, free),
        judged.left_load,
        seen,
    )


def _fixed(study: Study, model: Model, free: Model, term: Term, value: float) -> Model:
    """Return the model with the law's parameter fixed at its fit to all data."""
    number = replace(term.number, neutral=value, low=value, high=value)
    start = free.fit.theta.copy()
    start[:, -1] = value
    return study.refitted((*model.terms, replace(term, number=number)), start)


def separated(study: Study, laws: Sequence[Law]) -> bool:
    """Return whether one of two laws has a significantly larger gain."""
    if len(laws) < 2:
        return True
    _, (low, high) = gain(study, laws[0].model, laws[1].model)
    return max(low, -high) > 1e-3


@dataclass(frozen=True)
class NextLoads:
    """Separation of two models at other loads [kg], shape (GRID,).

    ``separation`` is the mean square difference over a cycle in variances of a cell's mean with the
    table's number of repeats, ``apart`` the root mean square difference [mm]; ``best`` are the
    loads [kg] to measure next, best first.
    """

    loads: Array
    separation: Array
    apart: Array
    best: tuple[float, ...]


def next_loads(study: Study, one: Model, other: Model) -> NextLoads:
    """Return the separation of two models fitted to the same readings."""
    cells = study.cells
    heaviest = cells.scale[0]
    loads = heaviest * np.arange(1, GRID + 1) / GRID
    apart = np.array([_apart(cells, one, other, load / heaviest) for load in loads])
    noise, _ = pure_error(cells)
    repeats = float(np.mean(cells.counts[cells.used]))
    separation = repeats * (apart / noise) ** 2
    return NextLoads(loads, separation, apart, _peaks(cells.loads, loads, apart))


def _apart(cells: Cells, one: Model, other: Model, load: float) -> float:
    there = replace(cells, load=np.full(len(cells.load), load))
    difference = (one.fit.predict(there)[0] - other.fit.predict(there)[0])[cells.used]
    return float(np.sqrt(np.mean(difference**2)) * cells.millimetres)


def _peaks(measured: Sequence[float], loads: Array, apart: Array) -> tuple[float, ...]:
    """Return the load of largest difference in each gap between measured loads, two at most."""
    gap = np.searchsorted(measured, loads - 1e-9)
    gaps = [np.flatnonzero(gap == g) for g in np.unique(gap)]
    peaks = sorted((int(i[np.argmax(apart[i])]) for i in gaps), key=lambda i: -float(apart[i]))
    return tuple(float(loads[i]) for i in peaks[:2])
