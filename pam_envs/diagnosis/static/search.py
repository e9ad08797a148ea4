"""Search for causes in a table of readings: one at a time and in pairs, which may mask each other.

Rule: the search continues while the residual is larger than repeats explain. A form is accepted if
its improvement is significant (block-robust, corrected for the number of forms), if it predicts
held-out readings better by a relevant margin, and if it does not predict held-out loads worse.
Accepted causes are tested again beside later ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from pam_envs.diagnosis.static.compare import Interval, Model, Study, gain, lack_of_fit, p_value
from pam_envs.diagnosis.static.models import TERMS, Term

RULE = "readings-1"
"""Version of the decision rule."""
LEVEL = 0.05
"""Significance level over all forms of a stage."""
LEAST_GAIN = 0.05
"""Least relevant log ratio of held-out mean squares."""
RIGHT = 0.005
"""Without repeats: residual over the largest contraction that needs no explanation."""
UNEXPLAINED = 0.01
"""p-value of the lack of fit below which the search continues."""
WORSE_LOADS = 1.02
"""Largest factor by which a form may increase the error on held-out loads."""
MOST_CAUSES = 4


@dataclass(frozen=True)
class Trial:
    """A form added to a model.

    Attributes
    ----------
    term : Term
        The form.
    model : Model
        The model with it.
    p : float
        See :func:`p_value`, for this form alone.
    tried : int
        Number of forms of the stage.
    gain, interval : float, tuple
        Log ratio of held-out mean squares to the model without it, and its 95 % interval.
    loads_worse : bool
        Whether it predicts held-out loads worse.
    behind, behind_interval : float, tuple
        Gain of the stage's best form over this one, and its 95 % interval.
    """

    term: Term
    model: Model
    p: float
    tried: int
    gain: float
    interval: Interval
    loads_worse: bool
    behind: float = 0.0
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
    """Two causes fitted together.

    Attributes
    ----------
    terms : tuple of Term
        The two causes.
    model : Model
        The model with both.
    alone, beside : tuple of float
        p-value of each added to the base, and added to the other.
    """

    terms: tuple[Term, Term]
    model: Model
    alone: tuple[float, float]
    beside: tuple[float, float]

    @property
    def masked(self) -> tuple[Term, ...]:
        """Causes that are significant only beside the other."""
        both = zip(self.terms, self.alone, self.beside, strict=True)
        return tuple(t for t, alone, beside in both if alone > LEVEL and beside <= LEVEL)


@dataclass(frozen=True)
class Search:
    """Result of the search.

    Attributes
    ----------
    stages : tuple of Stage
        Stages, the first on the base.
    pairs : tuple of Pair
        Every two causes, each in its best form.
    model : Model
        The accepted model.
    accepted : tuple of Trial
        Accepted forms, in the order of evidence.
    dropped : tuple of Term
        Forms that are no longer significant beside later ones.
    """

    stages: tuple[Stage, ...]
    pairs: tuple[Pair, ...]
    model: Model
    accepted: tuple[Trial, ...]
    dropped: tuple[Term, ...] = field(default=())


def available(study: Study, terms: Sequence[Term] = TERMS) -> tuple[Term, ...]:
    """Return the forms that can be fitted to the loads and branches of a table."""
    cells = study.cells
    one_way = not cells.falling.any()
    return tuple(t for t in terms if t.loads <= len(cells.loads) and not (t.both_ways and one_way))


def unexplained(study: Study, model: Model) -> bool:
    """Return whether the residual is larger than repeats, or a good model, explain."""
    _, p, _ = lack_of_fit(study, model)
    if np.isnan(p):
        return model.rms > RIGHT * study.cells.millimetres
    return p <= UNEXPLAINED


def stage(study: Study, parent: Model, terms: Sequence[Term], singles: Sequence[Model]) -> Stage:
    """Add forms to ``parent``; ``singles`` are models with one of them alone."""
    trials = []
    for term in terms:
        known = [s for s in singles if s.terms == (term,) and parent.terms]
        model = study.extended([parent, *known], (*parent.terms, term))
        value, interval = gain(study, parent, model)
        worse = model.left_load > WORSE_LOADS * parent.left_load
        p = p_value(study, parent, model)
        trials.append(Trial(term, model, p, len(terms), value, interval, worse))
    ranked = _ranked(study, trials)
    return Stage(parent, ranked, _choice(study, ranked, terms))


def _ranked(study: Study, trials: Sequence[Trial]) -> tuple[Trial, ...]:
    """Return the trials, best first, each with its distance from the best."""
    order = sorted(trials, key=lambda trial: (not trial.passes, -trial.gain))
    best = order[0].model if order else None
    made = []
    for trial in order:
        behind, interval = gain(study, trial.model, best) if best else (0.0, (0.0, 0.0))
        values = {**vars(trial), "behind": behind, "behind_interval": interval}
        made.append(Trial(**values))
    return tuple(made)


def _choice(study: Study, ranked: Sequence[Trial], terms: Sequence[Term]) -> Trial | None:
    """Return the best accepted form; of its cause, the best established one not excluded."""
    passing = [trial for trial in ranked if trial.passes]
    if not passing:
        return None
    forms = [t for t in passing if t.term.cause == passing[0].term.cause and not t.excluded]
    return min(forms, key=lambda trial: terms.index(trial.term))


def search(study: Study) -> Search:
    """Search for causes until none is accepted."""
    terms = available(study)
    stages = [stage(study, study.base, terms, ())] if terms else []
    singles = [trial.model for trial in stages[0].trials] if stages else []
    pairs = _pairs(study, stages[0]) if stages else ()
    if not stages or not unexplained(study, study.base):
        return Search(tuple(stages), pairs, study.base, ())
    accepted = [stages[0].chosen] if stages[0].chosen else _hidden(study, pairs)
    while accepted and len(accepted) < MOST_CAUSES and unexplained(study, accepted[-1].model):
        parent = accepted[-1].model
        known = {trial.term.cause for trial in accepted}
        left = [term for term in terms if term.cause not in known]
        if not left:
            break
        stages.append(stage(study, parent, left, singles))
        chosen = stages[-1].chosen
        if chosen is None:
            break
        accepted.append(chosen)
    return _retested(study, Search(tuple(stages), pairs, study.base, tuple(accepted)))


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
        made.append(Pair((one.term, other.term), model, (one.p, other.p), beside))
    return tuple(made)


def _hidden(study: Study, pairs: Sequence[Pair]) -> list[Trial]:
    """Return two causes that mask each other: significant only together."""
    made = []
    for pair in pairs:
        p = max(pair.beside)
        if p * len(pairs) > LEVEL:
            continue
        model = study.extended([study.base], pair.terms)
        value, interval = gain(study, study.base, model)
        worse = model.left_load > WORSE_LOADS * study.base.left_load
        both = [Trial(term, model, p, len(pairs), value, interval, worse) for term in pair.terms]
        made += [both] if both[0].passes else []
    return max(made, key=lambda both: both[0].gain, default=[])


def _retested(study: Study, found: Search) -> Search:
    """Drop accepted causes that are not significant beside the later ones."""
    accepted, dropped = list(found.accepted), []
    while len(accepted) > 1:
        model = accepted[-1].model
        judged = [(_without(study, model, trial.term), trial) for trial in accepted[:-1]]
        tested = [(p_value(study, less, model), less, trial) for less, trial in judged]
        p, less, trial = max(tested, key=lambda one: one[0])
        if p <= LEVEL:
            break
        accepted.remove(trial)
        dropped.append(trial.term)
        accepted[-1] = Trial(**{**vars(accepted[-1]), "model": less})
    model = accepted[-1].model if accepted else study.base
    return Search(found.stages, found.pairs, model, tuple(accepted), tuple(dropped))


def _without(study: Study, model: Model, term: Term) -> Model:
    """Return the model refitted without a term."""
    rest = tuple(t for t in model.terms if t is not term)
    names = [n.name for n in model.fit.numbers]
    gone = {n.name for n in term.numbers}
    kept = [i for i, name in enumerate(names) if name not in gone]
    return study.refitted(rest, model.fit.theta[:, kept])
