"""Results of a diagnosis of settled readings, and the verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pam_envs.data.tables import ContractionTable
from pam_envs.diagnosis.arrays import Array
from pam_envs.diagnosis.static import search as rule
from pam_envs.diagnosis.static.audit import SetPoint, missed_set_points
from pam_envs.diagnosis.static.compare import (
    Interval,
    Model,
    Study,
    floor,
    intervals,
    parameter_draws,
)
from pam_envs.diagnosis.static.law import Law, NextLoads, load_laws, next_loads
from pam_envs.diagnosis.static.models import Term
from pam_envs.diagnosis.static.search import Search, Trial
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

    def interval(self, name: str) -> Interval:
        """Return the 95 % interval of a parameter of the model, in relative units."""
        names = [n.name for n in self.model.fit.numbers]
        return intervals(self.draws[:, [names.index(name)]])[0]

    def value(self, name: str) -> float:
        """Return a parameter of the model, in relative units."""
        names = [n.name for n in self.model.fit.numbers]
        return float(self.model.fit.theta[0, names.index(name)])

    @property
    def bent(self) -> bool:
        """True if the readings need a load law other than linear."""
        return bends(self.laws)

    @property
    def ties(self) -> list[tuple[Trial, Trial]]:
        """Accepted forms, each with an equally good form of a cause that was not accepted."""
        return ties(self.search)

    def shown_by(self, term: Term) -> str:
        """Return the cause that a term needs beside it to be significant, if any."""
        first = self.search.accepted[0].term.cause
        for pair in self.search.pairs:
            causes = [other.cause for other in pair.terms]
            masked = [other.cause for other in pair.masked]
            if term.cause in masked and first in causes and term.cause != first:
                return first
        return ""


def find(table: ContractionTable, study: Study) -> Findings:
    """Run every stage."""
    found = rule.search(study)
    laws = load_laws(study, found.model)
    tied = [trial.model for tie in ties(found) for trial in tie]
    rivals = [law.model for law in laws] if bends(laws) else tied
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


def bends(laws: Sequence[Law]) -> bool:
    """Return whether a load law other than linear fits significantly better."""
    return any(law.p * len(laws) <= rule.LEVEL for law in laws)


def ties(found: Search) -> list[tuple[Trial, Trial]]:
    """Return accepted forms, each with an equally good form of a cause that was not accepted."""
    named = {trial.term.cause for trial in found.accepted}
    made = []
    for one in found.stages:
        if one.chosen is not None:
            rivals = [t for t in one.trials if t.passes and not t.excluded]
            made += [(one.chosen, t) for t in rivals if t.term.cause not in named]
    return made


def verdict(f: Findings) -> str:
    """Return the verdict in one word."""
    free = int(f.study.cells.used.sum()) - len(f.base.fit.numbers)
    if free < len(f.base.fit.numbers):
        return "insufficient"
    if f.search.accepted:
        return "ambiguous" if f.ties else "named"
    if np.isfinite(f.floor):
        return "adequate" if f.base.held_out <= FLOOR_REACHED * f.floor else "unexplained"
    return "adequate" if whiteness(f.study.cells, f.base) > WHITE else "unexplained"
