"""Rival causes, fitted side by side from the same base."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.diagnosis.cause import Cause, Form
from pam_envs.diagnosis.fit.least_squares import (
    FEW_DAMPINGS,
    Fit,
    Free,
    Problem,
    Shared,
    differentiate,
    evaluate,
    improve,
    share,
)

Array = NDArray[np.float64]

BLOCK_SECONDS = 4.0
"""Length of the interleaved blocks on which causes are compared."""
EVERY = 3
"""Every third block is held out."""
SCHEDULE = ((2, 8, 0.4), (2, 5, 0.6), (4, 4, 0.8))
"""Rounds with the base's Jacobian held; how many fits then go on, or what part of the best gain."""
FIRST_SIGHT = 0.3
"""A search that wants a gain ends if its first round promises less than this part of it."""
POLISH = 6
"""Rounds, at most, with all of the Jacobian."""
POLISHED = 3
"""How many of the best rivals are polished."""
FEW_ROUNDS = 3
"""Rounds of a model with a cause less."""
POLISHED_ENOUGH = 1e-3
"""Part of the cost that a round has to gain for another one."""


@dataclass(frozen=True)
class Blocks:
    """Blocks of time.

    Attributes
    ----------
    of : ndarray of int, shape (T,)
        Block of each sample.
    held_out : ndarray of bool, shape (n,)
        Which blocks fits do not see.
    counts : ndarray, shape (channels, n)
        Readings in each.
    """

    of: NDArray[np.int64]
    held_out: NDArray[np.bool_]
    counts: Array

    @classmethod
    def make(cls, time: Array, measured: Array) -> Blocks:
        """Cut a record into blocks, every third one held out."""
        of = ((time - time[0]) / BLOCK_SECONDS + 1e-9).astype(np.int64)
        n = int(of.max()) + 1
        counts = np.stack(
            [np.bincount(of, np.isfinite(m).astype(float), minlength=n) for m in measured]
        )
        return cls(of, np.arange(n) % EVERY == EVERY - 1, counts.astype(np.float64))

    @property
    def train(self) -> NDArray[np.bool_]:
        """Samples that fits see, shape (T,)."""
        return ~self.held_out[self.of]

    def errors(self, rows: Array) -> Array:
        """Return sums of squares of weighted residuals (channels, T), shape (channels, n)."""
        n = len(self.held_out)
        return np.stack([np.bincount(self.of, r * r, minlength=n) for r in rows])

    def means(self, errors: Array, chosen: NDArray[np.bool_] | None = None) -> Array:
        """Return the mean square by channel over chosen blocks (the held-out ones)."""
        use = self.held_out if chosen is None else chosen
        counts = self.counts[:, use].sum(axis=1)
        return errors[:, use].sum(axis=1) / np.maximum(counts, 1)

    def gain(self, before: Array, after: Array, chosen: NDArray[np.bool_] | None = None) -> float:
        """Return the sum over channels of ``ln(MSE_before / MSE_after)``."""
        some = self.counts.sum(axis=1) > 0
        a, b = self.means(before, chosen)[some], self.means(after, chosen)[some]
        return float(np.sum(np.log(np.maximum(a, 1e-12) / np.maximum(b, 1e-12))))

    def draws(self, number: int, seed: int) -> NDArray[np.int64]:
        """Return how often each block is drawn in bootstrap samples, shape (number, n)."""
        rng = np.random.default_rng(seed)
        places = np.flatnonzero(self.held_out)
        drawn = np.zeros((number, len(self.held_out)), np.int64)
        for k in range(number):
            drawn[k] = np.bincount(rng.choice(places, len(places)), minlength=drawn.shape[1])
        return drawn

    def gains(self, before: Array, after: Array, draws: NDArray[np.int64]) -> Array:
        """Return the gain in bootstrap samples, shape (number,)."""
        some = self.counts.sum(axis=1) > 0
        a, b = before[some] @ draws.T, after[some] @ draws.T
        return np.asarray(np.sum(np.log(np.maximum(a, 1e-12) / np.maximum(b, 1e-12)), axis=0))


@dataclass(frozen=True)
class Candidate:
    """A model: the base and some causes, each in one form, fitted."""

    causes: tuple[tuple[Cause, Form], ...]
    fit: Fit
    errors: Array

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its causes."""
        return tuple(c.name for c, _ in self.causes)


def frees_of(family: Any, form: Form, values: Sequence[float]) -> tuple[Free, ...]:
    """Return how a fit moves the parameters of a form, from starting values."""
    made = []
    for term, value in zip(form.terms, values, strict=True):
        given = {k: getattr(term, k) for k in ("low", "high", "scale")}
        changes = {k: v for k, v in given.items() if v is not None}
        made.append(family.free(term.name, log=term.log, start=value, prior=np.inf, **changes))
    return tuple(made)


def starts(problem: Problem, family: Any, base: Fit, form: Form) -> list[tuple[float, ...]]:
    """Return where the fits of a form begin."""
    if form.seeds is not None:
        key = id(form)
        if key not in base.begins:
            base.begins[key] = [tuple(s) for s in form.seeds(problem, family, base, form)]
        return list(base.begins[key])
    n = max(len(t.starts) for t in form.terms)
    return [tuple(t.starts[min(i, len(t.starts) - 1)] for t in form.terms) for i in range(n)]


def begun(
    problem: Problem,
    family: Any,
    base: Fit,
    cause: Cause,
    form: Form,
    shared: Shared | None = None,
) -> list[Fit]:
    """Return the fits of a form, at their starts, with the base's Jacobian."""
    names = {f.name for f in base.frees}
    if any(t.name in names for t in form.terms):
        return []
    fits = []
    for values in starts(problem, family, base, form):
        frees = frees_of(family, form, values)
        z = np.concatenate([base.z, [f.inner(f.start) for f in frees]])
        fits.append(Fit((*base.frees, *frees), z, base.column, shared=shared, label=(cause, form)))
    return fits


def search(
    problem: Problem,
    family: Any,
    blocks: Blocks,
    base: Candidate,
    causes: Iterable[Cause],
    polished: int = POLISHED,
    least: float = 0.0,
) -> list[Candidate]:
    """Return the base extended by each cause in its best form, the best first.

    Where the first rounds promise no gain of ``least`` nothing is returned.
    """
    whole(problem, base.fit)
    shared = share(problem, base.fit)
    fits = [
        fit
        for cause in causes
        if cause.name not in base.names
        for form in cause.forms
        for fit in begun(problem, family, base.fit, cause, form, shared)
    ]
    if not fits:
        return []
    evaluate(problem, fits)
    if least > 0.0:
        improve(problem, fits, 1, 1e-4, FEW_DAMPINGS)
        if np.log(base.fit.cost / min(f.cost for f in fits)) < FIRST_SIGHT * least:
            return []
    for rounds, kept, share_kept in SCHEDULE:
        improve(problem, fits, rounds, 1e-4, FEW_DAMPINGS)
        _drop(fits, base.fit.cost, kept, share_kept)
        if least > 0.0 and np.log(base.fit.cost / min(f.cost for f in fits)) < least:
            return []
    best: dict[str, Fit] = {}
    for fit in fits:
        name = fit.label[0].name
        if name not in best or fit.cost < best[name].cost:
            best[name] = fit
    ranked = sorted(best.values(), key=lambda f: f.cost)
    held_out = sorted(ranked, key=lambda f: -_gain(problem, blocks, base, f))
    chosen = {f.label[0].name: f for f in (*ranked[:polished], *held_out[:polished])}
    polish(problem, list(chosen.values()))
    found = [
        Candidate((*base.causes, fit.label), fit, blocks.errors(problem.rows(fit.residual)))
        for fit in ranked
    ]
    return sorted(found, key=lambda c: -blocks.gain(base.errors, c.errors))


def _gain(problem: Problem, blocks: Blocks, base: Candidate, fit: Fit) -> float:
    return blocks.gain(base.errors, blocks.errors(problem.rows(fit.residual)))


def polish(problem: Problem, fits: Sequence[Fit], rounds: int = POLISH) -> None:
    """Take rounds with a fresh Jacobian of all parameters."""
    for fit in fits:
        fit.done, fit.damping, fit.shared = False, 1.0, None
    improve(problem, fits, rounds, POLISHED_ENOUGH)


def whole(problem: Problem, fit: Fit) -> None:
    """Give a fit a Jacobian of all its parameters."""
    if fit.shared is not None or len(fit.slopes) != len(fit.frees):
        fit.shared = None
        differentiate(problem, [fit])


def _drop(fits: Sequence[Fit], start: float, kept: int, part: float) -> None:
    """End the fits that have gained little, but for some of the best."""
    gains = np.log([max(start / f.cost, 1e-12) for f in fits])
    line = np.sort(gains)[::-1][min(kept, len(fits)) - 1]
    for fit, gain in zip(fits, gains, strict=True):
        fit.done = fit.done or (gain < line and gain < part * gains.max())


def fit_base(
    problem: Problem, blocks: Blocks, column: Array, frees: tuple[Free, ...], rounds: int = 25
) -> Candidate:
    """Refit the plant's present parameters."""
    fit = Fit(frees, np.array([f.inner(f.start) for f in frees]), column)
    evaluate(problem, [fit])
    improve(problem, [fit], rounds, 1e-5)
    differentiate(problem, [fit])
    return Candidate((), fit, blocks.errors(problem.rows(fit.residual)))


def refit(problem: Problem, blocks: Blocks, candidate: Candidate, rounds: int = 6) -> Candidate:
    """Return a candidate fitted anew to a problem with other training samples."""
    fit = replace(candidate.fit, done=False, damping=1.0, shared=None, begins={})
    evaluate(problem, [fit])
    improve(problem, [fit], rounds, 1e-5)
    return Candidate(candidate.causes, fit, blocks.errors(problem.rows(fit.residual)))


def fresh(fit: Fit, **changes: Any) -> Fit:
    """Return a copy of a fit that has not begun."""
    empty = np.zeros((0, 0))
    return replace(fit, done=False, damping=1.0, begins={}, slopes=empty, **changes)


def less_one(
    problem: Problem, blocks: Blocks, base: Candidate, model: Candidate
) -> dict[str, Candidate]:
    """Return the model refitted without each one of its causes, the better of two beginnings."""
    fits, labels = [], []
    for gone, form in model.causes:
        dropped = {t.name for t in form.terms}
        kept = [k for k, f in enumerate(model.fit.frees) if f.name not in dropped]
        frees, z = tuple(model.fit.frees[k] for k in kept), model.fit.z[kept]
        of_base = np.concatenate([base.fit.z, z[len(base.fit.z) :]])
        for start in (z, of_base):
            fits.append(fresh(replace(model.fit, frees=frees, z=start.copy()), shared=None))
            labels.append(gone.name)
    whole(problem, base.fit)
    shared = share(problem, base.fit)
    for fit in fits:
        fit.shared = shared
    evaluate(problem, fits)
    improve(problem, fits, FEW_ROUNDS, 1e-4, FEW_DAMPINGS)
    best: dict[str, Fit] = {}
    for name, fit in zip(labels, fits, strict=True):
        if name not in best or fit.cost < best[name].cost:
            best[name] = fit
    polish(problem, list(best.values()))
    return {
        name: Candidate(
            tuple(c for c in model.causes if c[0].name != name),
            fit,
            blocks.errors(problem.rows(fit.residual)),
        )
        for name, fit in best.items()
    }
