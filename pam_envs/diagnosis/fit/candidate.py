"""Models that extend the base by causes: starting points, refits and ablations."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from pam_envs.arrays import Array
from pam_envs.diagnosis.cause import Cause, Form
from pam_envs.diagnosis.fit import least_squares as lsq
from pam_envs.diagnosis.fit.blocks import Blocks

Name = TypeVar("Name")

POLISH = 6  # largest number of rounds with the full Jacobian
RACE = 6  # rounds after which only the best of several starts continues
FEW_ROUNDS = 3  # rounds of a model without one of its causes
POLISHED_ENOUGH = 1e-3  # relative decrease of the cost below which polishing ends


@dataclass(frozen=True)
class Candidate:
    """A fitted model: the base and some causes, each in one form."""

    causes: tuple[tuple[Cause, Form], ...]
    fit: lsq.Fit
    errors: Array

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its causes."""
        return tuple(c.name for c, _ in self.causes)


def frees_for(family: lsq.PlantFamily, form: Form, values: Sequence[float]) -> tuple[lsq.Free, ...]:
    """Return the free parameters of a form with their starting values."""
    made = []
    for term, value in zip(form.terms, values, strict=True):
        given = {k: getattr(term, k) for k in ("low", "high", "scale")}
        changes = {k: v for k, v in given.items() if v is not None}
        made.append(family.free(term.name, log=term.log, start=value, prior=term.prior, **changes))
    return tuple(made)


def starting_points(
    problem: lsq.Problem, family: lsq.PlantFamily, base: lsq.Fit, form: Form
) -> list[tuple[float, ...]]:
    """Return the starting values of a form's fits; a search for them is done once for a base."""
    if form.search is not None:
        key = id(form)
        if key not in base.begins:
            base.begins[key] = [tuple(s) for s in form.search(problem, family, base, form)]
        return list(base.begins[key])
    return form.starts


def initial_fits(
    problem: lsq.Problem,
    family: lsq.PlantFamily,
    base: lsq.Fit,
    cause: Cause,
    form: Form,
    shared: lsq.Shared | None = None,
    starts: Sequence[Sequence[float]] | None = None,
) -> list[lsq.Fit]:
    """Return the fits of a form at starting points (default: all), with the base's Jacobian."""
    names = {f.name for f in base.frees}
    if not any(t.amount and t.name not in names for t in form.terms):
        return []
    fits = []
    points = starting_points(problem, family, base, form) if starts is None else starts
    for values in points:
        frees = tuple(f for f in frees_for(family, form, values) if f.name not in names)
        z = np.concatenate([base.z, [f.inner(f.start) for f in frees]])
        fits.append(
            lsq.Fit((*base.frees, *frees), z, base.column, shared=shared, label=(cause, form))
        )
    return fits


def polish(
    problem: lsq.Problem, fits: Sequence[lsq.Fit], rounds: int = POLISH, boxed: bool = False
) -> None:
    """Improve fits in all their parameters, at first with the Jacobian of their base."""
    for fit in fits:
        if fit.shared is not None and len(fit.slopes):
            fit.take(np.vstack([fit.shared.slopes, fit.slopes[:, : problem.seen]]))
        elif len(fit.slopes) != len(fit.frees):
            fit.take(fit.slopes[:0])
        fit.done, fit.damping, fit.shared = False, 1.0, None
    lsq.improve(problem, fits, rounds, POLISHED_ENOUGH, boxed=boxed)


def complete_jacobian(problem: lsq.Problem, fit: lsq.Fit) -> None:
    """Compute what is missing of the Jacobian of a fit by all its parameters, on all samples."""
    whole = fit.shared is None and fit.slopes.shape[1] == len(fit.residual)
    fit.shared = None
    lsq.differentiate(problem, [fit], 1 if whole else 0)


def fit_base(
    problem: lsq.Problem,
    blocks: Blocks,
    column: Array,
    starts: Sequence[tuple[lsq.Free, ...]],
    rounds: int = 25,
    boxed: bool = False,
) -> Candidate:
    """Fit the base parameters of a plant, from the best of several starts.

    ``boxed`` is that of :func:`improve`.
    """
    fits = lsq.promising(problem, [lsq.Fit.at_start(frees, column) for frees in starts])
    if len(fits) > 1:
        lsq.improve(problem, fits, RACE, 1e-5, boxed=boxed)
        rounds -= RACE
    fit = min(fits, key=lambda f: f.cost)
    lsq.improve(problem, [fit], rounds, 1e-5, boxed=boxed)
    complete_jacobian(problem, fit)
    return Candidate((), fit, blocks.errors(problem.rows(fit.residual)))


def refit(
    problem: lsq.Problem,
    blocks: Blocks,
    candidate: Candidate,
    rounds: int = 6,
    before: lsq.Problem | None = None,
) -> Candidate:
    """Return a candidate refitted to other training samples.

    ``before`` is the problem of its fit, whose Jacobian is then used first.
    """
    fit = restarted(candidate.fit, shared=None)
    old = candidate.fit
    if (
        before is not None
        and old.shared is None
        and old.slopes.shape == (len(old.frees), len(old.residual))
    ):
        fit.take(before.carried(old.slopes, problem))
    lsq.evaluate(problem, [fit])
    lsq.improve(problem, [fit], rounds, 1e-5, renew=before is None)
    return Candidate(candidate.causes, fit, blocks.errors(problem.rows(fit.residual)))


def best_by_name(fits: Iterable[tuple[Name, lsq.Fit]]) -> dict[Name, lsq.Fit]:
    """Return the fit of the least cost for each name."""
    best: dict[Name, lsq.Fit] = {}
    for name, fit in fits:
        if name not in best or fit.cost < best[name].cost:
            best[name] = fit
    return best


def restarted(fit: lsq.Fit, **changes: Any) -> lsq.Fit:
    """Return a copy of a fit in its initial state."""
    anew = replace(fit, done=False, damping=1.0, begins={})
    anew.take(np.zeros((0, 0)))
    return replace(anew, **changes)


def without_each_cause(
    problem: lsq.Problem,
    blocks: Blocks,
    base: Candidate,
    model: Candidate,
    only: Collection[str] | None = None,
    clear: float = np.inf,
) -> dict[str, Candidate]:
    """Return the model refitted without each cause that the base lacks, the best of its starts.

    The parameters that a model has beside the base's and its causes' (calibrations) were fitted
    together with the cause that is left out, and may hold the refit in a local optimum: one start
    is at the base and without them.

    ``only`` are the names of the causes to leave out (default: each). A refit that still loses a
    gain of ``clear`` after a few rounds is not polished.
    """
    fits, labels = [], []
    complete_jacobian(problem, model.fit)
    known = dict(zip((f.name for f in base.fit.frees), base.fit.z, strict=True))
    for removed, form in model.causes:
        if removed.name in base.names or (only is not None and removed.name not in only):
            continue
        dropped = {t.name for t in form.terms}
        kept = [k for k, f in enumerate(model.fit.frees) if f.name not in dropped]
        frees, z = tuple(model.fit.frees[k] for k in kept), model.fit.z[kept]
        of_base = np.array([known.get(f.name, v) for f, v in zip(frees, z, strict=True)])
        for start in (z, of_base):
            fit = restarted(model.fit, frees=frees, z=start.copy(), shared=None)
            fit.take(model.fit.slopes[kept])
            fits.append(fit)
            labels.append(removed.name)
        used = {t.name for cause, form in model.causes if cause is not removed for t in form.terms}
        judged = [f.name in known or f.name in used for f in frees]
        if not all(judged):
            some = tuple(f for f, n in zip(frees, judged, strict=True) if n)
            column = base.fit.column
            fits.append(
                restarted(model.fit, frees=some, z=of_base[judged], column=column, shared=None)
            )
            labels.append(removed.name)
    if not fits:
        return {}
    lsq.evaluate(problem, fits)
    starts = {name: [f for f, n in zip(fits, labels, strict=True) if n == name] for name in labels}
    named = [(name, fit) for name, several in starts.items() for fit in lsq.near(several)]
    lsq.improve(problem, [fit for _, fit in named], FEW_ROUNDS, 1e-4, lsq.FEW_DAMPINGS)
    best = best_by_name(named)
    close = [f for f in best.values() if np.log(f.cost / model.fit.cost) < clear]
    polish(problem, close)
    return {
        name: Candidate(
            tuple(c for c in model.causes if c[0].name != name),
            fit,
            blocks.errors(problem.rows(fit.residual)),
        )
        for name, fit in best.items()
    }
