"""Search for causes in a table of readings: one at a time and in pairs, which may mask each other.

Rule: the search continues while the residual is larger than repeats explain. A form is accepted if
its improvement is significant (block-robust, corrected for the number of forms), if it predicts
held-out readings better by a relevant margin, and if it does not predict held-out loads worse.
Accepted causes are tested again beside later ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from pam_envs.diagnosis.static.compare import Interval, Model, Study, gain, lack_of_fit, p_value
from pam_envs.diagnosis.static.models import TERMS, Term

RULE = "readings-1"  # version of the decision rule
LEVEL = 0.05  # significance level over all forms of a stage
LEAST_GAIN = 0.05  # least relevant log ratio of held-out mean squares
RIGHT = 0.005  # without repeats: residual over the largest contraction that needs no explanation
UNEXPLAINED = 0.01  # p-value of the lack of fit below which the search continues
WORSE_LOADS = 1.02  # largest factor by which a form may increase the error on held-out loads
MOST_CAUSES = 4


@dataclass(frozen=True)
class Trial:
    """A form added to a model."""

    term: Term
    model: Model
    p: float  # p-value of this form alone
    tried: int  # number of forms of the stage
    gain: float  # log ratio of held-out mean squares to the model without it
    interval: Interval  # 95 %
    loads_worse: bool
    behind: float = 0.0  # the same of the stage's best form over this one
    behind_interval: Interval = (0.0, 0.0)

    @property
    def adjusted(self) -> float:
        """Bonferroni-corrected p-value."""
        return min(1.0, self.p * self.tried)

    @property
    def passes(self) -> bool:
        """True if the rule accepts it."""
        return self.adjusted <= LEVEL and self.gain >= LEAST_GAIN and not self.loads_worse

    @property
    def excluded(self) -> bool:
        """True if the best form is significantly better."""
        return self.behind_interval[0] > 0.0


@dataclass(frozen=True)
class Stage:
    """All forms added to a model, best first, and the accepted one."""

    parent: Model
    trials: tuple[Trial, ...]
    chosen: Trial | None


@dataclass(frozen=True)
class Pair:
    """Two causes fitted together."""

    terms: tuple[Term, Term]
    alone: tuple[float, float]  # p-value of each added to the base
    beside: tuple[float, float]  # p-value of each added to the other

    @property
    def masked(self) -> tuple[Term, ...]:
        """Causes that are significant only beside the other."""
        both = zip(self.terms, self.alone, self.beside, strict=True)
        return tuple(t for t, alone, beside in both if alone > LEVEL and beside <= LEVEL)


@dataclass(frozen=True)
class Search:
    """Result of a search."""

    stages: tuple[Stage, ...]  # the first on the base
    pairs: tuple[Pair, ...]  # of every two causes
    model: Model
    accepted: tuple[Trial, ...]  # in the order of evidence

    @property
    def ties(self) -> list[tuple[Trial, Trial]]:
        """Accepted forms, each with an equally good form of a cause that was not accepted."""
        named = {trial.term.cause for trial in self.accepted}
        return [
            (chosen, trial)
            for one in self.stages
            if (chosen := one.chosen)
            for trial in one.trials
            if trial.passes and not trial.excluded and trial.term.cause not in named
        ]


def available(study: Study) -> tuple[Term, ...]:
    """Return the forms that can be fitted to the loads and branches of a table."""
    loads, one_way = len(study.cells.loads), not study.cells.falling.any()
    return tuple(t for t in TERMS if t.loads <= loads and not (t.both_ways and one_way))


def unexplained(study: Study, model: Model) -> bool:
    """Return whether the residual is larger than repeats, or a good model, explain."""
    _, p, _ = lack_of_fit(study, model)
    if np.isnan(p):
        return model.rms > RIGHT * study.cells.millimetres
    return p <= UNEXPLAINED


def _trial(study: Study, term: Term, parent: Model, model: Model, p: float, tried: int) -> Trial:
    """Return the trial of a model that extends its parent by a term."""
    value, interval = gain(study, parent, model)
    worse = model.left_load > WORSE_LOADS * parent.left_load
    return Trial(term, model, p, tried, value, interval, worse)


def stage(study: Study, parent: Model, terms: Sequence[Term], singles: Sequence[Model]) -> Stage:
    """Add forms to ``parent``; ``singles`` are models with one of them alone."""
    trials = []
    for term in terms:
        known = [s for s in singles if s.terms == (term,) and parent.terms]
        model = study.extended([parent, *known], (*parent.terms, term))
        p = p_value(study, parent, model)
        trials.append(_trial(study, term, parent, model, p, len(terms)))
    order = sorted(trials, key=lambda trial: (not trial.passes, -trial.gain))
    behind = [gain(study, trial.model, order[0].model) for trial in order]
    ranked = tuple(
        replace(trial, behind=value, behind_interval=interval)
        for trial, (value, interval) in zip(order, behind, strict=True)
    )
    return Stage(parent, ranked, _choice(ranked, terms))


def _choice(ranked: Sequence[Trial], terms: Sequence[Term]) -> Trial | None:
    """Return the best accepted form; of its cause, the best established one not excluded."""
    passing = [trial for trial in ranked if trial.passes]
    if not passing:
        return None
    forms = [t for t in passing if t.term.cause == passing[0].term.cause and not t.excluded]
    return min(forms, key=lambda trial: terms.index(trial.term))


def search(study: Study) -> Search:
    """Search for causes until none is accepted."""
    terms = available(study)
    first = stage(study, study.base, terms, ())
    stages, pairs = [first], _pairs(study, first)
    if not unexplained(study, study.base):
        return Search((first,), pairs, study.base, ())
    accepted = [first.chosen] if first.chosen else _hidden(study, pairs)
    while accepted and len(accepted) < MOST_CAUSES and unexplained(study, accepted[-1].model):
        known = {trial.term.cause for trial in accepted}
        left = [term for term in terms if term.cause not in known]
        if not left:
            break
        singles = [trial.model for trial in first.trials]
        stages.append(stage(study, accepted[-1].model, left, singles))
        chosen = stages[-1].chosen
        if chosen is None:
            break
        accepted.append(chosen)
    kept = _retested(study, accepted)
    model = kept[-1].model if kept else study.base
    return Search(tuple(stages), pairs, model, kept)


def _pairs(study: Study, first: Stage) -> tuple[Pair, ...]:
    """Fit every two causes together, each in its best form."""
    best: dict[str, Trial] = {}
    for trial in first.trials:
        best.setdefault(trial.term.cause, trial)
    if first.chosen:
        best[first.chosen.term.cause] = first.chosen
    made = []
    for one, other in combinations(best.values(), 2):
        model = study.extended([one.model, other.model], (one.term, other.term), 1)
        beside = p_value(study, other.model, model), p_value(study, one.model, model)
        made.append(Pair((one.term, other.term), (one.p, other.p), beside))
    return tuple(made)


def _hidden(study: Study, pairs: Sequence[Pair]) -> list[Trial]:
    """Return two causes that mask each other: significant only together."""
    made = []
    for pair in pairs:
        p = max(pair.beside)
        if p * len(pairs) > LEVEL:
            continue
        model = study.extended([study.base], pair.terms)
        both = [_trial(study, t, study.base, model, p, len(pairs)) for t in pair.terms]
        made += [both] if both[0].passes else []
    return max(made, key=lambda both: both[0].gain, default=[])


def _retested(study: Study, accepted: Sequence[Trial]) -> tuple[Trial, ...]:
    """Return the accepted causes that are significant beside the later ones."""
    kept = list(accepted)
    while len(kept) > 1:
        model = kept[-1].model
        smaller = [_without(study, model, trial.term) for trial in kept[:-1]]
        p = [p_value(study, less, model) for less in smaller]
        at = int(np.argmax(p))
        if p[at] <= LEVEL:
            break
        del kept[at]
        kept[-1] = replace(kept[-1], model=smaller[at])
    return tuple(kept)


def _without(study: Study, model: Model, term: Term) -> Model:
    """Return the model refitted without a term."""
    rest = tuple(t for t in model.terms if t is not term)
    kept = [i for i, name in enumerate(model.fit.names) if name != term.number.name]
    return study.refitted(rest, model.fit.theta[:, kept])
