"""Flexible base: the differences in which rigs commonly depart from the base plant.

Readings of a real rig differ from every model in the shape of the force law, in what drives the
friction and in the order and rate of the regulator. A cause is judged by what is left when these
have been fitted (kennedy2001). A difference that the recording does not need is dropped again.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from pam_envs.arrays import Array, Flags
from pam_envs.data.recording.clock import runs_of
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.cause import Cause, Form
from pam_envs.diagnosis.decide import compare
from pam_envs.diagnosis.decide.rule import Rule
from pam_envs.diagnosis.fit import least_squares as lsq
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import (
    Candidate,
    complete_jacobian,
    frees_for,
    refit,
    restarted,
    without_each_cause,
)

SETTLING = (0.5, 2.0, 6.0)
"""Time constants [s] of the settling after a start that was not at rest."""
MOST_STARTS = 6
"""Largest number of restarts that have their own settling."""
ROUNDS = 30
RACE, LONG_RACE = 2, 8
"""Rounds after which only the best of several starts continues: with one guess, and with several,
of which one may be near the optimum and the others at the bottom of another valley."""
CLEAR = 1.0
"""Gain of a difference from which it is needed without a further look."""
OBVIOUS = 0.4
"""Gain of a difference by a linear model above which it is kept without a refit."""
NOISE_ONLY = 1.06
"""Mean square of the residual over the noise below which the base needs no difference."""
SHOWN = 2.0
"""Least distance of a parameter from the plain plant's value, over its standard deviation."""
BEGIN_ROUNDS, ANCHOR = 6, 0.25
"""Rounds of a fit with the parameters of the start of the recording, and the standard deviation of
their change in later fits, over their scale."""
SPARSE_ROUNDS, SPARSE_LOSS = 4, 0.02
"""Rounds of a fit without the others, and the gain that it may lose."""
STARTS = 2
"""Number of starting values of each difference."""
FAR = 2.0
"""Gain of the base over one with other friction from which the other is given up."""
NOTHING = 1e-3
"""Mean square over the noise below which a difference changes nothing: a gain of about 0.001."""


def shapes_of(recording: Recording, sheet: Rig) -> Array:
    """Return the shapes that readings may contain beside the plant's, (k, T).

    A zero offset, one for each run of a sensor that was zeroed again, and the settling after each
    start, unless the rig declares that it began at rest.
    """
    n, period = len(recording.time), recording.period
    runs = runs_of(recording.restart)
    made = [np.ones(n)]
    if sheet.rezeroed:
        made = [(recording.segment == k).astype(float) for k in range(len(recording.segments))]
    if not sheet.settled:
        for run, tau in product(runs[:MOST_STARTS], SETTLING):
            shape = np.zeros(n)
            shape[run] = np.exp(-period * np.arange(run.stop - run.start) / tau)
            made.append(shape)
    return np.array(made)


def together(forms: Sequence[Form]) -> Form:
    """Return the form with the terms of several forms."""
    terms = {term.name: term for form in forms for term in form.terms}
    return Form(" and ".join(form.name for form in forms), tuple(terms.values()))


def _shown(
    causes: Sequence[tuple[Cause, Form]], names: Collection[str]
) -> Iterator[tuple[Cause, Form]]:
    """Yield causes with the terms of some names, without those that have no amount left."""
    for cause, form in causes:
        terms = tuple(t for t in form.terms if t.name in names)
        if any(t.amount for t in terms):
            yield cause, replace(form, terms=terms)


def _idle(causes: Sequence[tuple[Cause, Form]], names: Collection[str]) -> Iterator[str]:
    """Yield the terms that only shape effects without an amount among some names."""
    for cause, _ in causes:
        on = [form for form in cause.forms if any(t.amount and t.name in names for t in form.terms)]
        used = {t.name for form in on for t in form.terms}
        yield from (t.name for form in cause.forms for t in form.terms if t.name not in used)


@dataclass(frozen=True)
class FlexibleBase:
    """Selection of the common differences on a fitted base."""

    problem: lsq.Problem
    family: lsq.PlantFamily
    blocks: Blocks
    base: Candidate
    rule: Rule
    guesses: Sequence[Mapping[str, float]] = ()  # starting values by parameter
    # effects of the valve that the pressure clearly shows, by cause
    shown: Mapping[str, Form] = field(default_factory=dict)
    # whether a linear model may show that a difference is needed, without a refit
    linear: bool = True
    begins: Sequence[str] = ()  # parameters of the start of the recording
    # gives the starting values with friction of one kind alone
    others: Callable[[], Sequence[Mapping[str, float]]] = tuple

    def chosen(self, causes: Sequence[Cause]) -> list[tuple[Cause, Form]]:
        """Return the common differences that the base lacks, each in the form of all its forms.

        Effects of the valve are among them where the pressure alone has shown them.
        """
        known = {f.name for f in self.base.fit.frees}
        made = []
        for cause in causes:
            shown = self.shown.get(cause.name)
            if shown is not None:
                difference = replace(cause, common=True), shown
            elif cause.common and not cause.in_valve:
                difference = cause, together(cause.forms)
            else:
                continue
            if not any(t.name in known for t in difference[1].terms):
                made.append(difference)
        return made

    def alternatives(self, causes: Sequence[Cause], normal: Candidate) -> Iterator[Candidate]:
        """Yield other bases, unless they are far worse than ``normal``.

        Each has friction of one kind alone, if the calibration gives starting values of it. Without
        such values there is one base, with every difference, if ``normal`` lacks one. An effect
        that is no common difference may have led the selection to the wrong base.
        """
        chosen, guesses = self.chosen(causes), self.others()
        models = [self.with_one_friction(chosen, normal, guess) for guess in guesses]
        if not guesses and any(cause.name not in normal.names for cause, _ in chosen):
            models = [self.fitted(chosen)]
        for model in models:
            if self.blocks.gain(normal.errors, model.errors) >= -FAR:
                made = self.anchored(self.sparse(self.begun(model)))
                complete_jacobian(self.problem, made.fit)
                yield made

    def with_one_friction(
        self,
        chosen: Sequence[tuple[Cause, Form]],
        normal: Candidate,
        guess: Mapping[str, float],
    ) -> Candidate:
        """Return the base with the differences of a guess, and the shown ones of ``normal``."""
        alone = []
        for cause, form in chosen:
            shown = cause.name in self.shown
            terms = tuple(t for t in form.terms if shown or t.name in guess)
            if any(t.amount for t in terms) and (not shown or cause.name in normal.names):
                alone.append((cause, replace(form, terms=terms)))
        return replace(self, guesses=(guess,)).fitted(alone, 0)

    def fitted(self, causes: Sequence[tuple[Cause, Form]], starts: int = STARTS) -> Candidate:
        """Return the base extended by some causes at once, from the best of several starts."""
        plain, fits = self.base.fit, []
        begins: list[tuple[Array, int, Mapping[str, float]]]
        begins = [(plain.z, k, {}) for k in range(starts)]
        for guess in self.guesses:
            guessed = [f.inner(f.within(guess.get(f.name, f.start))) for f in plain.frees]
            begins.append((np.array(guessed), 0, {**self.absent(causes), **guess}))
        for begin, k, guess in begins:
            frees = tuple(
                free
                for _, form in causes
                for free in frees_for(
                    self.family,
                    form,
                    [
                        guess.get(t.name, start)
                        for t, start in zip(form.terms, form.start(k), strict=True)
                    ],
                )
            )
            z = np.concatenate([begin, [f.inner(f.within(f.start)) for f in frees]])
            fits.append(restarted(plain, frees=(*plain.frees, *frees), z=z, shared=None))
        fits = lsq.promising(self.problem, fits)
        race = LONG_RACE if len(self.guesses) > 1 else RACE
        lsq.improve(self.problem, fits, race, 1e-4, lsq.FEW_DAMPINGS)
        best = min(fits, key=lambda f: f.cost)
        lsq.improve(self.problem, [best], ROUNDS, 1e-3)
        errors = self.blocks.errors(self.problem.rows(best.residual))
        return Candidate(tuple(causes), best, errors)

    def absent(self, causes: Sequence[tuple[Cause, Form]]) -> dict[str, float]:
        """Return the values of amounts at which causes have no effect."""
        neutral = self.family.column
        amounts = [t for _, form in causes for t in form.terms if t.amount]
        return {t.name: float(neutral[self.family.free(t.name).place]) for t in amounts}

    def plain(self, fit: lsq.Fit) -> Array:
        """Return the plain plant's parameters in the coordinates of a fit; some are not finite."""
        neutral = self.family.column
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.array([f.inner(neutral[f.place]) for f in fit.frees])

    def needed(self, model: Candidate) -> Candidate:
        """Return a model without the common differences that the recording does not need.

        It names those with a clear gain; the parameters of the others remain, as a calibration.
        """
        data = (self.problem, self.blocks, self.base)
        needed: set[str] = set()  # the fewer others remain, the more they are
        while any(cause.common for cause, _ in model.causes):
            expected = self.expected(model)
            limit, clear = (OBVIOUS, CLEAR) if self.linear else (np.inf, np.inf)
            limits = {c.name: max(limit, self.least_gain_of(c, model)) for c, _ in model.causes}
            doubtful = {n for n, g in expected.items() if g <= limits[n] and n not in needed}
            smaller = without_each_cause(*data, model, doubtful, clear)
            losses = {name: self.loss(less, model) for name, less in smaller.items()}
            needed |= {name for name, loss in losses.items() if loss > CLEAR}
            least = min(losses, key=lambda name: losses[name], default="")
            if losses.get(least, np.inf) > 0.0:
                gains = {n: self.blocks.gain(c.errors, model.errors) for n, c in smaller.items()}
                kept = tuple(
                    (c, f)
                    for c, f in model.causes
                    if gains.get(c.name, np.inf) >= self.least_gain_of(c, model)
                )
                return replace(model, causes=kept)
            model = smaller[least]
        return model

    def least_gain_of(self, cause: Cause, model: Candidate) -> float:
        """Return the gain from which a common difference of a model is named."""
        if cause.lawlike and not cause.by_nature:
            return self.rule.unusual_gain
        others = [c for c, _ in model.causes if c.name != cause.name]
        apart = cause.by_nature or cause.name in self.shown
        apart = apart or not any(c.lawlike for c in others)
        return self.rule.common_gain if apart else self.rule.lawlike_further

    def expected(self, model: Candidate) -> dict[str, float]:
        """Return the gain lost without each common difference, by a linear model of the residual.

        Refits lose more, since bounds stop them. It is 0 where the difference has no neutral value
        in the coordinates of the fit.
        """
        spread = self.spread(model)
        fit, plain, found = model.fit, self.plain(model.fit), {}
        names = [f.name for f in fit.frees]
        for cause, form in model.causes:
            places = [names.index(t.name) for t in form.terms if t.amount and t.name in names]
            if not cause.common or not places:
                continue
            moved = plain[places] - fit.z[places]
            if not np.isfinite(moved).all():
                found[cause.name] = 0.0
                continue
            more = float(moved @ np.linalg.pinv(spread[np.ix_(places, places)]) @ moved)
            found[cause.name] = float(np.log1p(more / max(fit.cost, 1e-12)))
        return found

    def spread(self, model: Candidate) -> Array:
        """Return the covariance of a model's coordinates by a linear model of its residual."""
        complete_jacobian(self.problem, model.fit)
        normal, _ = lsq.normal_equations(self.problem, model.fit)
        return np.asarray(np.linalg.pinv(normal, hermitian=True))

    def loss(self, smaller: Candidate, model: Candidate) -> float:
        """Return the gain lost without a cause beyond that which the rule asks of it.

        Zero or less: the cause is not needed.
        """
        gain = self.blocks.gain(smaller.errors, model.errors)
        unsure = compare.p_value(self.problem, self.blocks, smaller, model, 1)
        return gain - self.rule.least_gain if unsure <= self.rule.doubt else -1.0

    def select(self, causes: Sequence[Cause]) -> Candidate:
        """Return the base with the common differences that the recording needs."""
        chosen = self.chosen(causes)
        if not chosen or self.fits():
            return self.base
        model = self.needed(self.with_fault_alone(chosen, self.acting(self.fitted(chosen))))
        model = self.with_needed_forms(self.sparse(self.begun(model)))
        if len(model.fit.frees) > len(self.base.fit.frees):
            model = refit(self.problem, self.blocks, model, 2)
        model = self.anchored(model)
        complete_jacobian(self.problem, model.fit)
        return model

    def with_fault_alone(self, chosen: Sequence[tuple[Cause, Form]], model: Candidate) -> Candidate:
        """Return the base with one fault as its only difference, if that suffices, else ``model``.

        It suffices if it is as good as ``model`` and better than all other differences together.
        With a large fault, the fit of all differences may end in a local minimum that dropping them
        one by one does not leave.
        """
        least = self.rule.least_gain
        for cause, form in chosen:
            if cause.by_nature or cause.lawlike or cause.name in self.shown:
                continue
            alone = self.fitted([(cause, form)])
            if self.blocks.gain(alone.errors, model.errors) > least:
                continue
            others = self.fitted([other for other in chosen if other[0] is not cause])
            if self.blocks.gain(others.errors, alone.errors) > least:
                return alone
        return model

    def anchored(self, model: Candidate) -> Candidate:
        """Return a model whose parameters of the start of the recording stay near their values.

        Fits without the blocks that show them, as on held-out data, would not determine them.
        """
        frees = tuple(
            replace(f, start=value, prior=ANCHOR) if f.name in self.begins else f
            for f, value in zip(model.fit.frees, model.fit.values().values(), strict=True)
        )
        if frees == model.fit.frees:
            return model
        fit = restarted(model.fit, frees=frees, shared=None)
        fit.take(model.fit.slopes)
        lsq.evaluate(self.problem, [fit])
        return replace(model, fit=fit)

    def begun(self, model: Candidate) -> Candidate:
        """Return a model fitted together with the parameters of the start of the recording."""
        known = {f.name for f in model.fit.frees}
        frees = tuple(self.family.free(name) for name in self.begins if name not in known)
        if not frees:
            return model
        z = np.concatenate([model.fit.z, [f.inner(f.start) for f in frees]])
        fit = restarted(model.fit, frees=(*model.fit.frees, *frees), z=z, shared=None)
        lsq.evaluate(self.problem, [fit])
        lsq.improve(self.problem, [fit], BEGIN_ROUNDS, 1e-4)
        errors = self.blocks.errors(self.problem.rows(fit.residual))
        return Candidate(model.causes, fit, errors)

    def sparse(self, model: Candidate) -> Candidate:
        """Return a model whose differences have the parameters that the recording shows.

        Those within :data:`SHOWN` standard deviations of the plain plant take its values, one after
        the other by a linear model of the residual.
        """
        fit, plain, spread = model.fit, self.plain(model.fit), self.spread(model)
        known = {f.name for f in self.base.fit.frees}
        free = [k for k, f in enumerate(fit.frees) if f.name not in known and np.isfinite(plain[k])]
        limit = SHOWN**2 * max(1.0, fit.cost / self.problem.sampled)
        kept, z = np.ones(len(plain), bool), fit.z
        while free:
            off = z[free] - plain[free]
            worse = off**2 / np.maximum(np.diag(spread)[free], 1e-300)
            least = int(np.argmin(worse))
            if worse[least] > limit:
                break
            k = free.pop(least)
            row = spread[k]
            z = z - row / row[k] * off[least]
            spread = spread - np.outer(row, row) / row[k]
            kept[k] = False
        if kept.all():
            return model
        shown = {f.name for f, k in zip(fit.frees, kept, strict=True) if k}
        idle = set(_idle(model.causes, shown))
        kept &= np.array([f.name not in idle for f in fit.frees])
        smaller = self.reduced(model, kept, z, SPARSE_ROUNDS)
        return smaller if self.blocks.gain(smaller.errors, model.errors) < SPARSE_LOSS else model

    def with_needed_forms(self, model: Candidate) -> Candidate:
        """Return a model without those forms of its differences that it hardly needs."""
        for cause in (c for c, _ in model.causes if c.name not in self.shown):
            for form in cause.forms if len(cause.forms) > 1 else ():
                names = [f.name for f in model.fit.frees]
                group = [names.index(t.name) for t in form.terms if t.name in names]
                if not any(t.amount and t.name in names for t in form.terms):
                    continue
                off = model.fit.z[group] - self.plain(model.fit)[group]
                if not np.isfinite(off).all():
                    continue
                columns = self.spread(model)[group]
                z = model.fit.z - columns.T @ np.linalg.pinv(columns[:, group]) @ off
                kept = np.ones(len(names), bool)
                kept[group] = False
                smaller = self.reduced(model, kept, z, SPARSE_ROUNDS)
                if self.blocks.gain(smaller.errors, model.errors) < SPARSE_LOSS:
                    model = smaller
        return model

    def reduced(self, model: Candidate, kept: Flags, z: Array, rounds: int) -> Candidate:
        """Return a model fitted without some of its parameters, which take the plain values.

        ``kept`` are the others, and ``z`` the coordinates at which the fit starts, both (k,).
        """
        fit, neutral = model.fit, self.family.column
        column = fit.column.copy()
        for gone in np.flatnonzero(~kept):
            column[fit.frees[gone].place] = neutral[fit.frees[gone].place]
        frees = tuple(f for f, k in zip(fit.frees, kept, strict=True) if k)
        inside = np.array([np.clip(v, *f.span) for f, v in zip(frees, z[kept], strict=True)])
        less = restarted(fit, frees=frees, z=inside, column=column, shared=None)
        less.take(fit.slopes[kept])
        lsq.evaluate(self.problem, [less])
        lsq.improve(self.problem, [less], rounds, 1e-4)
        errors = self.blocks.errors(self.problem.rows(less.residual))
        return Candidate(tuple(_shown(model.causes, {f.name for f in frees})), less, errors)

    def acting(self, model: Candidate) -> Candidate:
        """Return a model without the common differences that change nothing at their values."""
        fit, neutral = model.fit, self.family.column
        here = lsq.column_of(fit, fit.z)
        common = [form for cause, form in model.causes if cause.common]
        columns = np.repeat(here[None], len(common), axis=0)
        for column, form in zip(columns, common, strict=True):
            for term in form.terms:
                place = self.family.free(term.name, log=False).place
                column[place] = neutral[place]
        moved = self.problem.residuals(columns) - self.problem.residuals(here[None])
        gone = {
            term.name
            for form, change in zip(common, moved, strict=True)
            if np.mean(change**2) < NOTHING
            for term in form.terms
        }
        if not gone:
            return model
        complete_jacobian(self.problem, fit)
        kept = np.array([f.name not in gone for f in fit.frees])
        return self.reduced(model, kept, fit.z, 0)

    def fits(self) -> bool:
        """Return whether the base leaves hardly more than noise on every channel."""
        some = self.blocks.counts.sum(axis=1) > 0
        return bool(np.all(self.blocks.means(self.base.errors)[some] < NOISE_ONLY))
