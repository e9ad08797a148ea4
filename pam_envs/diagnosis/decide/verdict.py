"""Decision of a diagnosis: models with more and more causes, the evidence, the verdict."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from pam_envs.arrays import Array, Indices
from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.decide import compare
from pam_envs.diagnosis.decide.compare import cross_validate
from pam_envs.diagnosis.decide.rule import Judgement, Rule, judge, required_gain
from pam_envs.diagnosis.decide.screen import Screen
from pam_envs.diagnosis.decide.search import search
from pam_envs.diagnosis.decide.structure import Regressors, flexible_r2, spectral_peak
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import Candidate, without_each_cause
from pam_envs.diagnosis.fit.least_squares import PlantFamily, Problem, column_of

Models = tuple[Candidate, list[Candidate]]
"""The best model with some number of causes, and its rivals, best first."""

KEPT = 12  # number of rivals of a level that are judged


@dataclass(frozen=True)
class Level:
    """The best model with some number of causes."""

    model: Candidate
    rivals: list[Candidate]  # all models with as many causes, best first
    left: dict[str, Any]  # see remaining_structure


@dataclass
class Decision:
    """A verdict and its evidence."""

    verdict: str  # "adequate", "named", "ambiguous", "unexplained" or "insufficient"
    model: Candidate  # the base with the named causes
    rivals: list[Candidate] = field(default_factory=list)  # best first
    open_rivals: list[Candidate] = field(default_factory=list)  # those that are not excluded
    evidence: dict[str, Any] = field(default_factory=dict)  # see Ladder.evidence
    level: int = 0  # number of causes beside the differences of the base
    incomplete: bool = False  # whether what is named leaves structure that no cause explains


def remaining_structure(
    problem: Problem, blocks: Blocks, candidate: Candidate, regressors: Regressors
) -> dict[str, Any]:
    """Return structure in a candidate's residual: flexible model, spectral peak, excess error."""
    rows = problem.rows(candidate.fit.residual)
    r2, rest, peaks = [], 0.0, []
    period = float(regressors.values["time"][1] - regressors.values["time"][0])
    for row, reading in zip(rows, problem.measured, strict=True):
        if not np.isfinite(reading).any():
            r2.append(0.0)
            peaks.append((0.0, 0.0))
            continue
        share = flexible_r2(np.where(np.isfinite(reading), row, np.nan), regressors, blocks)
        r2.append(share)
        rest -= float(np.log(1.0 - min(share, 0.999)))
        peaks.append(spectral_peak(row, period, regressors.motion))
    some = blocks.counts.sum(axis=1) > 0
    means = blocks.means(candidate.errors)
    by_channel = [float(v) if s else 0.0 for v, s in zip(means, some, strict=True)]
    found = {"r2": r2, "rest": rest, "peaks": peaks, "peak": max(p[1] for p in peaks)}
    return found | {"excess": max(by_channel), "by_channel": by_channel}


@dataclass(frozen=True)
class Ladder:
    """Forward selection of causes on one base."""

    problem: Problem
    family: PlantFamily
    blocks: Blocks
    base: Candidate
    causes: Sequence[Cause]
    regressors: Regressors
    rule: Rule
    screen: Screen
    seed: int = 0
    unseen: frozenset[str] = frozenset()  # causes that may be rivals, but cannot be named
    # a better base with other friction, over which gains are judged
    reference: Candidate | None = None

    @cached_property
    def handicap(self) -> float:
        """Gain of the reference over the base, by which gains over the base are reduced."""
        if self.reference is None:
            return 0.0
        return max(0.0, self.blocks.gain(self.base.errors, self.reference.errors))

    def named_first(self, rivals: list[Candidate]) -> list[Candidate]:
        """Return models, the best one that may be named first."""
        best = next((r for r in rivals if self.unseen.isdisjoint(r.names)), None)
        if best is None:
            return []
        return [best, *(r for r in rivals if r is not best)]

    def gain(self, model: Candidate, base: Candidate | None = None) -> float:
        """Return the penalised gain of a model over another one (default: base or reference)."""
        if base is None:
            return compare.penalised_gain(self.blocks, self.base, model, self.rule) - self.handicap
        return compare.penalised_gain(self.blocks, base, model, self.rule)

    def level(self, model: Candidate, rivals: list[Candidate]) -> Level:
        """Return a level with the remaining structure of its model."""
        left = remaining_structure(self.problem, self.blocks, model, self.regressors)
        return Level(model, rivals, left)

    def models(self) -> list[Models]:
        """Return the best models with one cause, two, ... while a further one may be accepted."""
        rivals = search(self.problem, self.family, self.blocks, self.base, self.causes, self.screen)
        if not rivals:
            return []
        rivals = compare.prefer_simpler(self.blocks, self.base, rivals, self.rule)
        rivals = self.named_first(rivals)
        if not rivals:
            return []
        found, repaired = [(rivals[0], rivals)], False
        while len(found) < self.rule.most:
            larger = self.larger(found)
            if not larger:
                break
            better = None if repaired else self.without_one_cause(larger[0], found[-1])
            repaired = better is not None
            if better is None:
                found.append((larger[0], larger))
            else:  # the added cause only freed a fit from a local optimum
                found[-1] = better
        return found

    def larger(self, found: Sequence[Models]) -> list[Candidate]:
        """Return models with one more cause than the last, best first; none if none is needed."""
        model, rivals = found[-1]
        first_gain = self.gain(found[0][0])
        possible = compare.possible_gain(self.blocks, model)
        required = required_gain(first_gain, possible, self.rule)
        if first_gain < self.rule.least_gain or possible < required:
            return []
        data = (self.problem, self.family, self.blocks)
        larger = search(*data, model, self.causes, self.screen, 2, self.rule.hint * required)
        if max((self.gain(c, model) for c in larger), default=0.0) < required:
            return []
        if len(found) == 1:
            best = max(self.gain(c) for c in larger)
            for first in rivals[1 : self.rule.beam]:
                behind = max(0.0, best - self.gain(first))
                larger += search(*data, first, self.causes, self.screen, 2, behind)[:4]
        larger.sort(key=lambda c: -self.gain(c))
        larger = compare.distinct(larger)
        return self.named_first(
            compare.prefer_simpler(self.blocks, self.base, larger, self.rule) if larger else []
        )

    def without_one_cause(self, model: Candidate, known: Models) -> Models | None:
        """Return smaller models if one started from a larger model beats the known one.

        A fit may need a second cause to leave a local optimum, and keep the better one without it.
        """
        made = without_each_cause(self.problem, self.blocks, self.base, model).values()
        best = max(
            (m for m in made if self.unseen.isdisjoint(m.names)), key=self.gain, default=None
        )
        if best is None or self.gain(best) < self.gain(known[0]) + self.rule.simpler:
            return None
        rivals = [best, *(r for r in known[1] if set(r.names) != set(best.names))]
        rivals = self.named_first(compare.prefer_simpler(self.blocks, self.base, rivals, self.rule))
        return rivals[0], rivals

    def differs(self) -> bool:
        """Return whether law or friction of the rig differ from those of a plain plant."""
        known = {free.name for free in self.base.fit.frees}
        return any(cause.lawlike for cause, _ in self.base.causes) or any(
            term.name in known
            for cause in self.causes
            if cause.common and cause.lawlike
            for form in cause.forms
            for term in form.terms
            if term.amount
        )

    def faults(self, plain: Candidate) -> list[dict[str, Any]]:
        """Return the evidence on each common difference of the base that is a fault.

        One that is like another law is none. ``plain`` is the base without differences. For each
        fault: its ``name``, its ``gain``, the p-value (``unsure``) and the mean squares by channel
        of a base refitted without it (``without``) and of the base (``left``), and the gain of the
        best other cause in its place (``rival``).
        """
        names = {c.name for c, _ in self.base.causes if not c.lawlike}
        smaller = without_each_cause(self.problem, self.blocks, plain, self.base, names)
        made = []
        for name, less in smaller.items():
            others = [c for c in self.causes if c.name != name]
            screen = Screen.make(self.problem, self.family, less.fit, others)
            found = search(self.problem, self.family, self.blocks, less, others, screen)
            made.append(
                {
                    "name": name,
                    "gain": self.gain(self.base, less),
                    "unsure": compare.p_value(
                        self.problem, self.blocks, less, self.base, len(found) + 1
                    ),
                    "without": {"by_channel": self._means(less)},
                    "left": {"by_channel": self._means(self.base)},
                    "rival": max((self.gain(c, less) for c in found), default=0.0),
                }
            )
        return made

    def _means(self, model: Candidate) -> list[float]:
        """Return the held-out mean square over the noise by channel, 0 without readings."""
        some = self.blocks.counts.sum(axis=1) > 0
        means = self.blocks.means(model.errors)
        return [float(v) if s else 0.0 for v, s in zip(means, some, strict=True)]

    def evidence(self, levels: Sequence[Level]) -> dict[str, Any]:
        """Return the input of the rule, in plain types.

        ``blocks`` is the number of held-out blocks, and ``differs`` whether law or friction of the
        rig differ from those of a plain plant. ``driving`` are the channels that drive the others.
        ``levels`` has one entry for each number of causes from none: ``gain`` over the base,
        ``added`` over the level before, the ``possible`` gain if only noise were left, the p-value
        (``unsure``), the remaining structure (``left``), whether the added cause is like another
        law (``lawlike``), and the ``rivals``, best first, each with ``names``, ``forms``,
        ``gain``, ``better`` (share of bootstrap samples in which it beats the best), ``imitates``
        (it contains the best as a limit) and ``out`` (excluded before the cross-validation).
        """
        draws = self.blocks.draws(self.rule.draws, self.seed)
        made = []
        for k, level in enumerate(levels):
            before = levels[max(k - 1, 0)].model
            further = [c for c, _ in level.model.causes if c.name not in before.names]
            lawlike = bool(further) and all(c.lawlike for c in further)
            made.append(
                {
                    "gain": self.gain(level.model) if k else 0.0,
                    "added": self.gain(level.model, before) - (self.handicap if k == 1 else 0.0),
                    "possible": compare.possible_gain(self.blocks, before),
                    "unsure": compare.p_value(
                        self.problem, self.blocks, before, level.model, len(level.rivals)
                    ),
                    "left": level.left,
                    "lawlike": lawlike,
                    "rivals": [
                        self.row(self.blocks, self.base, rival, level.model, draws)
                        for rival in level.rivals[:KEPT]
                    ],
                }
            )
        return {
            "blocks": int(self.blocks.held_out.sum()),
            "differs": self.differs(),
            "driving": [k for k, c in enumerate(self.family.channels) if c.startswith("pressure")],
            "levels": made,
        }

    def row(
        self,
        blocks: Blocks,
        base: Candidate,
        rival: Candidate,
        best: Candidate,
        draws: Indices,
    ) -> dict[str, Any]:
        """Return the evidence on one rival."""
        return {
            "names": list(rival.names),
            "forms": [form.name for _, form in rival.causes],
            "gain": compare.penalised_gain(blocks, base, rival, self.rule) - self.handicap,
            "better": compare.share_ahead(blocks, rival, best, draws),
            "imitates": compare.imitates(rival, best),
            "out": False,
        }

    def cross_validate(
        self, levels: list[Level], judged: Judgement, evidence: dict[str, Any]
    ) -> None:
        """Compare open rivals on all blocks; update the level and its evidence in place."""
        level, found = levels[judged.level], evidence["levels"][judged.level]
        first, *others = found["rivals"]
        ahead = [  # of which the first is a limit
            k for k, r in enumerate(others, 1) if r["imitates"] and r["gain"] > first["gain"]
        ]
        places = [0, *judged.open_rivals, *ahead]
        smaller = levels[judged.level - 1].model
        compared = [levels[0].model, smaller, *(level.rivals[k] for k in places)]
        base, before, *again = cross_validate(self.problem, self.blocks, compared, self.rule)
        every = replace(self.blocks, held_out=np.ones_like(self.blocks.held_out))
        ranked = sorted(again, key=lambda c: -compare.penalised_gain(every, base, c, self.rule))
        order = compare.prefer_simpler(every, base, ranked, self.rule)
        order = self.named_first(order) or order
        draws = every.draws(self.rule.draws, self.seed)
        rows = [self.row(every, base, c, order[0], draws) for c in order]
        places = [places[next(i for i, c in enumerate(again) if c is o)] for o in order]
        others = [k for k in range(len(level.rivals)) if k not in places]
        excluded = [found["rivals"][k] | {"out": True} for k in others if k < len(found["rivals"])]
        best = level.rivals[places[0]]
        found |= {
            "rivals": rows + excluded,
            "crossed": len(rows),
            "gain": rows[0]["gain"],
            "added": compare.penalised_gain(every, before, order[0], self.rule)
            - (self.handicap if judged.level == 1 else 0.0),
            "unsure": compare.p_value(self.problem, self.blocks, smaller, best, len(level.rivals)),
        }
        if best is not level.model:
            found["left"] = self.level(best, []).left
        rivals = [level.rivals[k] for k in (*places, *others)]
        levels[judged.level] = Level(best, rivals, found["left"])


def decide(
    problem: Problem,
    family: PlantFamily,
    blocks: Blocks,
    base: Candidate,
    causes: Sequence[Cause],
    regressors: Regressors,
    rule: Rule,
    seed: int = 0,
    unseen: Sequence[Cause] = (),
    plain: Candidate | None = None,
    reference: Candidate | None = None,
) -> Decision:
    """Search for causes, add further ones while they are accepted, and give the verdict.

    ``unseen`` are causes that lack their experiment: rivals that are never named. ``plain`` is the
    base without the common differences, if it has any. ``reference`` is a base with other
    friction, over which a cause must gain too.
    """
    ladder = Ladder(
        problem,
        family,
        blocks,
        base,
        [*causes, *unseen],
        regressors,
        rule,
        Screen.make(problem, family, base.fit, [*causes, *unseen]),
        seed,
        frozenset(cause.name for cause in unseen),
        reference,
    )
    better = base if reference is None or ladder.handicap == 0.0 else reference
    bottom = replace(ladder.level(better, []), model=base)
    levels = [bottom, *(ladder.level(*models) for models in ladder.models())]
    evidence = ladder.evidence(levels)
    judged = judge(evidence, rule)
    if judged.verdict == "ambiguous":
        ladder.cross_validate(levels, judged, evidence)
        judged = judge(evidence, rule)
    if judged.verdict == "unexplained" and plain is not None:
        evidence["faults"] = ladder.faults(plain)
        judged = judge(evidence, rule)
    selected = levels[judged.level]
    rivals = selected.rivals if judged.level else levels[min(1, len(levels) - 1)].rivals
    still = [rivals[k] for k in judged.open_rivals]
    verdict = judged.verdict
    if verdict == "adequate" and base.causes:
        verdict = "named"
    return Decision(
        verdict, selected.model, rivals, still, evidence, judged.level, judged.incomplete
    )


def effect_traces(problem: Problem, family: PlantFamily, model: Candidate) -> dict[str, Array]:
    """Return the contribution of each cause of a model to the outputs, shape (channels, T)."""
    whole = column_of(model.fit, model.fit.z)
    columns = [whole]
    for _, form in model.causes:
        without = whole.copy()
        for term in form.terms:
            place = family.free(term.name, log=False).place
            without[place] = family.column[place]
        columns.append(without)
    stacked = np.array(columns)
    problem.tie(stacked)
    found = problem.simulate(stacked)
    return {
        cause.name: found[:, :, 0] - found[:, :, i + 1] for i, (cause, _) in enumerate(model.causes)
    }
