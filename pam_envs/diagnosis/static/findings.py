"""Results of a diagnosis of settled readings, and the verdict."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pam_envs.data.tables import ContractionTable
from pam_envs.diagnosis.arrays import Array
from pam_envs.diagnosis.static.audit import SetPoint, missed_set_points
from pam_envs.diagnosis.static.compare import (
    Interval,
    Model,
    Study,
    floor,
    interval,
    parameter_draws,
)
from pam_envs.diagnosis.static.law import Law, NextLoads, load_laws, next_loads
from pam_envs.diagnosis.static.models import Term
from pam_envs.diagnosis.static.search import LEVEL, Search, search
from pam_envs.diagnosis.static.structure import whiteness

FLOOR_REACHED = 1.1
"""Held-out error over the noise floor up to which a model is adequate."""
WHITE = 0.01
"""Without a noise floor: least p-value of white residuals."""


@dataclass(frozen=True)
class Findings:
    """Results of all stages."""

    table: ContractionTable
    study: Study
    search: Search
    draws: Array
    laws: tuple[Law, ...]
    set_points: tuple[SetPoint, ...]
    next: NextLoads | None

    @property
    def base(self) -> Model:
        """Load-blind model."""
        return self.study.base

    @property
    def model(self) -> Model:
        """Model with the named causes."""
        return self.search.model

    @property
    def floor(self) -> float:
        """RMS difference of a repeat from the mean of the others [mm]; NaN without repeats."""
        squares = floor(self.study)
        seen = np.isfinite(squares)
        return float(np.sqrt(np.mean(squares[seen]))) if seen.any() else float("nan")

    def estimate(self, name: str) -> tuple[float, Interval]:
        """Return a parameter of the model and its 95 % interval, in relative units."""
        k = self.model.fit.names.index(name)
        return float(self.model.fit.theta[0, k]), interval(self.draws[:, k])

    @property
    def bent(self) -> bool:
        """True if a load law other than linear fits significantly better."""
        return bent(self.laws)

    @property
    def verdict(self) -> str:
        """Verdict in one word."""
        free = int(self.study.cells.used.sum()) - len(self.base.fit.numbers)
        if free < len(self.base.fit.numbers):
            return "insufficient"
        if self.search.accepted:
            return "ambiguous" if self.search.ties else "named"
        if np.isfinite(self.floor):
            adequate = self.base.held_out <= FLOOR_REACHED * self.floor
        else:
            adequate = whiteness(self.study.cells, self.base) > WHITE
        return "adequate" if adequate else "unexplained"

    def shown_by(self, term: Term) -> str:
        """Return the cause that a term needs beside it to be significant, if any."""
        first = self.search.accepted[0].term.cause
        for pair in self.search.pairs:
            masked = [other.cause for other in pair.masked]
            together = first in [other.cause for other in pair.terms] and term.cause != first
            if term.cause in masked and together:
                return first
        return ""


def bent(laws: tuple[Law, ...]) -> bool:
    """Return whether a load law other than linear fits significantly better."""
    return any(law.p * len(laws) <= LEVEL for law in laws)


def find(table: ContractionTable, study: Study) -> Findings:
    """Run every stage."""
    found = search(study)
    laws = load_laws(study, found.model)
    tied = [trial.model for tie in found.ties for trial in tie]
    rivals = [law.model for law in laws] if bent(laws) else tied
    several = len(rivals) > 1 and len(study.cells.loads) > 1
    return Findings(
        table,
        study,
        found,
        parameter_draws(study, found.model),
        laws,
        missed_set_points(study, found.model),
        next_loads(study, *rivals[:2]) if several else None,
    )
