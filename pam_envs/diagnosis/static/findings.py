"""Results of a diagnosis of settled readings, and the verdict in a few sentences."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pam_envs.arrays import Array
from pam_envs.data.tables import ContractionTable
from pam_envs.diagnosis.static import compare
from pam_envs.diagnosis.static.audit import SetPoint, missed_set_points
from pam_envs.diagnosis.static.compare import floor
from pam_envs.diagnosis.static.law import Law, NextLoads, load_laws, next_loads
from pam_envs.diagnosis.static.models import Number, Term, units
from pam_envs.diagnosis.static.search import LEVEL, Search
from pam_envs.diagnosis.static.search import search as find_causes
from pam_envs.diagnosis.static.structure import whiteness

FLOOR_REACHED = 1.1  # held-out error over the noise floor up to which a model is adequate
WHITE = 0.01  # without a noise floor: least p-value of white residuals


@dataclass(frozen=True)
class Findings:
    """Results of all stages, each computed when it is first read."""

    table: ContractionTable
    study: compare.Study

    @cached_property
    def search(self) -> Search:
        """Search for causes."""
        return find_causes(self.study)

    @cached_property
    def draws(self) -> Array:
        """Bootstrap samples of the parameters."""
        return compare.parameter_draws(self.study, self.model)

    @cached_property
    def laws(self) -> tuple[Law, ...]:
        """Load laws other than linear."""
        return load_laws(self.study, self.model)

    @cached_property
    def set_points(self) -> tuple[SetPoint, ...]:
        """Pressures with implausible readings."""
        return missed_set_points(self.study, self.model)

    @cached_property
    def next(self) -> NextLoads | None:
        """Loads that separate two load laws, or two causes, if they are not separated."""
        tied = [trial.model for tie in self.search.ties for trial in tie]
        rivals = [law.model for law in self.laws] if self.bent else tied
        several = len(rivals) > 1 and len(self.study.cells.loads) > 1
        return next_loads(self.study, *rivals[:2]) if several else None

    @property
    def base(self) -> compare.Model:
        """Load-blind model."""
        return self.study.base

    @property
    def model(self) -> compare.Model:
        """Model with the named causes."""
        return self.search.model

    @property
    def floor(self) -> float:
        """RMS difference of a repeat from the mean of the others [mm]; NaN without repeats."""
        squares = floor(self.study)
        seen = np.isfinite(squares)
        return float(np.sqrt(np.mean(squares[seen]))) if seen.any() else float("nan")

    def estimate(self, name: str) -> tuple[float, compare.Interval]:
        """Return a parameter of the model and its 95 % interval, in relative units."""
        k = self.model.fit.names.index(name)
        return float(self.model.fit.theta[0, k]), compare.interval(self.draws[:, k])

    @property
    def bent(self) -> bool:
        """True if a load law other than linear fits significantly better."""
        return any(law.p * len(self.laws) <= LEVEL for law in self.laws)

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


def sentences(f: Findings) -> str:
    """Return the verdict in one to four sentences."""
    if f.verdict == "insufficient":
        cells, needed = int(f.study.cells.used.sum()), 2 * len(f.base.fit.numbers)
        return (
            f"The table has {cells} cells; a static law with hysteresis needs at least {needed} to "
            "be fitted and judged. Measure more pressures, up and down."
        )
    if f.search.accepted:
        return " ".join(part for part in (_missed(f), _named(f), _loads(f), _left(f)) if part)
    if f.verdict == "adequate":
        return f"{_missed(f)} The load-blind model is adequate: the table shows no cause."
    _, _, size = compare.lack_of_fit(f.study, f.base)
    much = f" of {size:.2f} mm" if np.isfinite(size) else ""
    text = f"An error{much} beyond the repeats is left, which no known cause explains."
    return f"{_missed(f)} {text}"


def _missed(f: Findings) -> str:
    held, kind = f.base.held_out, f.study.lanes.kind
    text = f"The error of a load-blind muscle on held-out {kind} is {held:.2f} mm"
    if np.isfinite(f.floor):
        return f"{text}, {held / f.floor:.1f} times the noise floor of {f.floor:.3f} mm."
    return f"{text}; without repeats the noise floor is unknown."


def _named(f: Findings) -> str:
    parts = []
    for term in (trial.term for trial in f.search.accepted):
        masking = f.shown_by(term)
        hidden = f" (significant only beside {masking})" if masking else ""
        parts.append(f"{term.cause} as {term.form}, {_number(f, term.number)}{hidden}")
    rivals = sorted({rival.term.cause for _, rival in f.search.ties})
    text = f"Named: {'; '.join(parts)}."
    return f"{text} Not separated from {' and '.join(rivals)}." if rivals else text


def _number(f: Findings, number: Number) -> str:
    scale = units(number, f.study.cells.scale)
    value, (low, high) = f.estimate(number.name)
    value, low, high = value * scale, low * scale, high * scale
    if number.unit == "1/kg":
        return f"{100 * value:+.1f} %/kg ({100 * low:+.1f} to {100 * high:+.1f})"
    unit = "" if number.unit == "1" else f" {number.unit}"
    return f"{value:.3g}{unit} ({low:.2g} to {high:.2g})"


def _loads(f: Findings) -> str:
    before, after = f.base.left_load, f.model.left_load
    if not np.isfinite(before):
        return ""
    cut = 100.0 * (1.0 - after / before)
    text = f"The error on a held-out load is {after:.2f} instead of {before:.2f} mm ({-cut:+.0f} %)"
    if not f.bent:
        return text + " with effects linear in load."
    power = f.laws[0]
    label = "post hoc, not held out" if power.post_hoc else "held out"
    return (
        f"{text} with effects linear in load, as fixed beforehand; {power.model.left_load:.2f} mm "
        f"with the exponent {power.value:.1f} ({label})."
    )


def _left(f: Findings) -> str:
    ratio = f.model.held_out / f.floor
    if not np.isfinite(ratio):
        return ""
    held = f"{f.model.held_out:.2f} mm on held-out {f.study.lanes.kind}"
    if ratio <= FLOOR_REACHED:
        return f"The noise floor is reached: {held}."
    f_value, _, size = compare.lack_of_fit(f.study, f.model)
    return (
        f"The noise floor is not reached: {held} is {ratio:.1f} times it, {size:.2f} mm are not "
        f"explained by repeats (lack of fit F = {f_value:.0f})."
    )
