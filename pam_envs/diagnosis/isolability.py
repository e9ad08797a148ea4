"""Which causes a recording can tell apart, before any residual is looked at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.fitting import Fit, Problem, column_of
from pam_envs.diagnosis.search import begun

Array = NDArray[np.float64]

DIRECTIONS = 1e-8
"""Directions of the base's Jacobian below this part of the largest are not fitted away."""
TOGETHER = 32
"""Fits that are simulated in one replay."""


def complement(base: Fit) -> Array:
    """Return an orthonormal basis of what refitting the base can change, shape (k, m)."""
    j = base.slopes
    spreads = np.array([1.0 / f.prior if np.isfinite(f.prior) else 0.0 for f in base.frees])
    values, vectors = np.linalg.eigh(j @ j.T + np.diag(spreads**2))
    keep = values > DIRECTIONS * values[-1]
    basis = (vectors[:, keep].T @ j) / np.sqrt(values[keep])[:, None]
    return np.asarray(basis)


def projected(traces: Array, basis: Array) -> Array:
    """Return traces, shape (n, m), without what refitting the base would take up."""
    return np.asarray(traces - (traces @ basis.T) @ basis)


@dataclass(frozen=True)
class Isolability:
    """Cosines between what is left of the effects once the base is refitted.

    Attributes
    ----------
    names : tuple of str
        Causes.
    cosine : ndarray, shape (n, n)
        Absolute cosines.
    absorbed : ndarray, shape (n,)
        Part of each effect's RMS that refitting the base takes up.
    reach : ndarray, shape (n,)
        Largest size, over the noise of the channel where it is largest, within the bounds.
    """

    names: tuple[str, ...]
    cosine: Array
    absorbed: Array
    reach: Array


def neutral_fit(base: Fit, fit: Fit) -> Array:
    """Return the column of a fit with the base's own values in the cause's place."""
    column = column_of(fit, fit.z)
    for free in fit.frees[len(base.frees) :]:
        column[free.place] = base.column[free.place]
    return column


def isolability(problem: Problem, family: Any, base: Fit, causes: Sequence[Cause]) -> Isolability:
    """Simulate each cause small at the base's optimum and compare what is left of it."""
    basis = complement(base)
    fits = [
        (cause.name, fit)
        for cause in causes
        for form in cause.forms
        for fit in begun(problem, family, base, cause, form)
    ]
    if not fits:
        return Isolability((), np.zeros((0, 0)), np.zeros(0), np.zeros(0))
    best: dict[str, tuple[float, Array, float]] = {}
    for at in range(0, len(fits), TOGETHER):
        for name, shown in _shown(problem, base, fits[at : at + TOGETHER], basis):
            if name not in best or shown[0] > best[name][0]:
                best[name] = shown
    rows = np.array(
        [left / max(float(np.linalg.norm(left)), 1e-12) for _, left, _ in best.values()]
    )
    return Isolability(
        tuple(best),
        np.abs(rows @ rows.T),
        np.array([share for _, _, share in best.values()]),
        np.array([size for size, _, _ in best.values()]),
    )


def _shown(
    problem: Problem, base: Fit, fits: Sequence[tuple[str, Fit]], basis: Array
) -> list[tuple[str, tuple[float, Array, float]]]:
    """Return, for each fit, the largest size, what is left of a small effect, what is taken up."""
    columns = [
        column
        for _, fit in fits
        for column in (neutral_fit(base, fit), column_of(fit, fit.z), _full(base, fit))
    ]
    found = problem.residuals(np.array(columns))
    made = []
    for i, (name, _) in enumerate(fits):
        small, large = found[3 * i + 1] - found[3 * i], found[3 * i + 2] - found[3 * i]
        left = projected(np.stack([small, large]), basis)
        raw = float(np.linalg.norm(small))
        share = 1.0 - float(np.linalg.norm(left[0])) / max(raw, 1e-12)
        kept = left[0] if raw > 0.0 else left[1]
        made.append((name, (channel_size(left[1], problem), kept, share)))
    return made


def _full(base: Fit, fit: Fit) -> Array:
    """Return the column with the cause far beyond where its fit starts, within its bounds."""
    column = column_of(fit, fit.z)
    _, form = fit.label
    for term, free in zip(form.terms, fit.frees[len(base.frees) :], strict=True):
        here = base.column[free.place]
        if not free.log:
            column[free.place] = np.clip(30.0 * free.start, free.low, free.high)
        elif term.amount and here > 0.0:
            far = here * (free.start / here) ** 6
            column[free.place] = np.clip(far, free.low, free.high)
    return column


def channel_size(trace: Array, problem: Problem) -> float:
    """Return the RMS over the noise on the channel where it is largest."""
    good = np.isfinite(problem.measured)
    rows = problem.rows(trace)
    sizes = [float(np.sqrt(np.mean(r[g] ** 2))) for r, g in zip(rows, good, strict=True) if g.any()]
    return max(sizes, default=0.0)
