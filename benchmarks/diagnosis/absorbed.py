"""Part of an effect's trace that a refit of the flexible base does not absorb.

The base of a clean rig lacks the differences that this rig does not need. Where a hidden effect
calls for one, as the friction of a guide does for friction driven by length, the refit adds it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pam_envs.arrays import Array
from pam_envs.data.recording.clock import runs_of
from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.decide.flexible_base import STARTS
from pam_envs.diagnosis.decide.isolability import base_subspace, projected
from pam_envs.diagnosis.diagnosis import Study
from pam_envs.diagnosis.fit.candidate import complete_jacobian, frees_for, restarted
from pam_envs.diagnosis.fit.least_squares import Fit, Free, Problem, column_of, evaluate
from pam_envs.diagnosis.fit.single_muscle import clock_of

SHIFT = 0.5
"""Step between the clock offsets that are tried [rows]; a refit has one of them."""
RANK = 1e-6
"""Least eigenvalue, over the largest, of a direction that counts."""


@dataclass(frozen=True)
class Absorbed:
    """Changes of the readings, in vectors of residuals, that a refit of a base can make."""

    problem: Problem
    always: Array  # by base, offsets of each channel, and settling, shape (k, m)
    differences: Mapping[str, Array]  # by common differences that the clean rig does not need
    shifts: Sequence[Array] = ()  # by offsets of the clock, each (m,)
    bases: dict[str, Array] = field(default_factory=dict)  # orthonormal, by hidden effect

    @classmethod
    def of(cls, study: Study, causes: Sequence[Cause], outputs: Array) -> "Absorbed":
        """Return the changes of the base of a clean rig, with noise-free ``outputs`` (channels, T).

        Each difference is linearised where it vanishes, at its starting shapes.
        """
        problem, made = study.problem, [base_subspace(study.normal.fit)]
        made += [problem.vectors(rows.reshape(1, -1)) for rows in _offsets(problem)]
        moved = [problem.vectors(rows.reshape(1, -1))[0] for rows in _shifts(study, outputs)]
        return cls(problem, np.vstack(made), dict(_differences(study, causes)), moved)

    def left(self, rows: Array, name: str = "") -> Array:
        """Return the unabsorbed part of a hidden effect's trace, over the noise (channels, T).

        It is the least that remains with one of the offsets of the clock, or with none.
        """
        basis = self.bases.get(name)
        if basis is None:
            more = [found for cause, found in self.differences.items() if cause != name]
            basis = self.bases[name] = orthonormal(np.vstack([self.always, *more]))
        whole = self.problem.vectors(rows.reshape(1, -1))[0]
        tried = np.array([whole, *(whole - moved for moved in self.shifts)])
        left = projected(tried, basis)
        return self.problem.rows(left[int(np.argmin(np.einsum("ki,ki->k", left, left)))])


def orthonormal(rows: Array) -> Array:
    """Return an orthonormal basis of the span of rows (n, m), shape (rank, m)."""
    sizes = np.linalg.norm(rows, axis=1)
    scaled = rows[sizes > 0.0] / sizes[sizes > 0.0, None]
    values, vectors = np.linalg.eigh(scaled @ scaled.T)
    kept = values > RANK * values[-1]
    return np.asarray((vectors[:, kept].T @ scaled) / np.sqrt(values[kept])[:, None])


def _offsets(problem: Problem) -> Iterator[Array]:
    """Yield offset, and settling after the start, of each channel (channels, T)."""
    for k in range(len(problem.measured)):
        for shape in problem.shapes:
            rows = np.zeros(problem.measured.shape)
            rows[k] = shape
            yield rows


def _shifts(study: Study, outputs: Array) -> Iterator[Array]:
    """Yield the changes of readings over their noise (channels, T) by an offset of the clock."""
    recording = study.recording
    most = clock_of(recording, study.sheet) / recording.period
    at = np.arange(len(recording.time), dtype=float)
    runs = runs_of(recording.restart)
    for late in SHIFT * np.arange(1, int(most / SHIFT) + 1):
        for sign in (-1.0, 1.0):
            moved = np.empty_like(outputs)
            for run in runs:
                for channel, values in zip(moved, outputs, strict=True):
                    channel[run] = np.interp(at[run] + sign * late, at[run], values[run])
            yield (moved - outputs) / study.problem.noise[:, None]


def _differences(study: Study, causes: Sequence[Cause]) -> Iterator[tuple[str, Array]]:
    """Yield each common difference that a base lacks, and the changes that it can make (k, m)."""
    fit, flexible = study.normal.fit, study.flexible
    known = {free.name for free in fit.frees}
    for cause, form in flexible.chosen(causes):
        absent, made = flexible.absent([(cause, form)]), []
        for k in range(STARTS):
            values = [absent.get(t.name, s) for t, s in zip(form.terms, form.start(k), strict=True)]
            frees = [f for f in frees_for(study.family, form, values) if f.name not in known]
            if frees:
                made.append(_changes(study.problem, fit, frees))
        if made:
            yield cause.name, np.vstack(made)


def _changes(problem: Problem, fit: Fit, frees: Sequence[Free]) -> Array:
    """Return an orthonormal basis of the changes by further parameters of a fit (k, m)."""
    z = np.array([f.inner(f.within(f.start)) for f in frees])
    alone = restarted(fit, frees=tuple(frees), z=z, column=column_of(fit, fit.z), shared=None)
    evaluate(problem, [alone])
    complete_jacobian(problem, alone)
    return base_subspace(alone)
