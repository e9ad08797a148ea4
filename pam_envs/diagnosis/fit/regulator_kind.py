"""Kind of pressure regulator that a recording shows, selected by its pressure alone.

An effect of the valve can make one kind look like another. Dead time, leak and slower exhaust are
therefore free during the selection, and a kind other than a lag of first or second order has to be
clearly better than such a lag with these and any one further effect.
"""

import dataclasses
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from pam_envs.arrays import Array, Flags
from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import frees_for, restarted
from pam_envs.diagnosis.fit.least_squares import (
    FEW_DAMPINGS,
    Fit,
    Free,
    Problem,
    column_of,
    evaluate,
    improve,
    near,
    no_violations,
    promising,
)
from pam_envs.diagnosis.fit.single_muscle import (
    CLOCK,
    CONTROL,
    INTEGRAL,
    OPENINGS,
    ORIFICES,
    SECOND_ORDER,
    SPEEDS,
    STAGES,
    stages_of,
)
from pam_envs.pneumatics.flow import AIRS, REPLACED, SWITCH

FINE_STEP = 0.0101
"""Longest step [s] of a replay with flow through orifices, or a fast regulator."""
RACE, GUESS_ROUNDS, LONG_ROUNDS = 2, 6, 12
"""Rounds after which only fits near the best one continue, and rounds of each stage."""
ORDER_GAIN = 0.05
"""Gain on held-out pressures that a regulator of higher order needs."""
FITS = 1.2
"""Mean square of the pressure's residual over its noise below which no further kind is tried."""
KIND_GAIN, TAIL_GAIN = 0.2, 0.3
"""Least gain of a further kind over the lags with one effect, and that of the slow tail."""
ENOUGH = 0.7
"""Share of the largest possible gain, that of a fit to the noise, that also suffices."""
SHOWN_GAIN, CLOSE, MOST_SHOWN = 0.5, 0.7, 3
"""Least gain of an effect that the pressure shows, share of it that no other effect may reach, and
largest number of such effects."""
PRESSURE, READING = ("regulator.", "pressure."), "pressure."
TAIL, TAIL_FREQUENCY = "regulator.ring_share", "regulator.ring_frequency"
TAIL_DAMPING = 2.0
"""Damping ratio with which the line of a regulator gives a slow share of the pressure."""
TAIL_FREQUENCIES, TAIL_FASTEST = (0.6, 1.0), 2.0
"""Frequencies [Hz] at which a fit of that share starts, and the largest one."""
DELAY, LEAK = 0.02, 0.005
"""Dead time [s] and leak [1/s] at which a fit starts."""
INTEGRALS, RELEASES = (10.0, 40.0), (0.1, 0.5)
"""Gain [1/s2] and release time [s] of an integral part at which a fit starts."""
CHARACTERISTICS = ((0.95, 0.9, 0.8, 0.6), (0.7, 0.5, 0.3, 0.15), (1.3, 1.6, 1.8, 1.9))
"""Values of :data:`SPEEDS` at which a fit starts."""

Made = tuple[Any, Fit]
"""A family with a kind of regulator, and its fit; a kind that cannot be tried gives None."""


@dataclass(frozen=True)
class Selection:
    """Fits of the kinds of regulator of a family to the pressure alone."""

    problem: Problem
    family: Any
    blocks: Blocks
    limit: Cause  # a limited rate, which the lags may have
    causes: Sequence[Cause]  # others that may act on the pressure, or on its reading
    # gives parameters of the static law, with which orifices fill the volume of the muscle
    law: Callable[[Any], Mapping[str, float]]

    def selected(self) -> tuple[Any, Fit, dict[str, Form]]:
        """Return the family with the regulator that the pressure needs, its fit, and effects.

        The regulator is a lag of first or second order or, if that is not sufficient, one of four
        others: a lag with a slow tail, with a rate not proportional to the error, or with an
        integral part, or orifices. The effects are forms of causes that the pressure clearly shows,
        such as a rate limit.
        """
        family, fit = self.kind()
        return family, *self.of(family).with_shown_effects(fit)

    def kind(self) -> tuple[Any, Fit]:
        """Return the family with the selected regulator, and its fit with the effects aside."""
        family, fit = self.lags()
        if not self.lacks(fit):
            return family, fit
        reached = self.of(family).with_one_effect(fit)
        best = family, fit
        further = (
            (self.slow_tail, TAIL_GAIN),
            (self.characteristic, KIND_GAIN),
            (self.integral, KIND_GAIN),
            (self.orifices, KIND_GAIN),
        )
        for kind, least in further:
            if not self.lacks(reached):
                break
            made = kind(family, fit)
            enough = min(least, ENOUGH * self.possible(reached))
            if made is not None and self.gain(reached, made[1]) >= enough:
                best, reached = made, made[1]
        return best

    def lags(self) -> tuple[Any, Fit]:
        """Return the family with a lag of first or second order and its fit."""
        family = self.family
        lag = (*regulator_of(family), *self.aside(family))
        known = {f.name for f in lag}
        flows = family.plant.air == "flow"
        orders = [lag] if flows else [lag, *second_orders(family, lag)]
        limits: list[tuple[Free, ...]] = [()]
        for form in self.limit.forms:
            if not flows and not any(t.name in known for t in form.terms):
                limits += [frees_for(family, form, values) for values in form.starts]
        tried = [(*order, *limit) for order in orders for limit in limits]
        fits = [Fit.at_start(frees, family.column) for frees in tried]
        chosen = self.simplest(fits, LONG_ROUNDS)
        # simpler ones that were behind begin again where it ended
        found = chosen.values()
        simpler = [frees for frees in tried if {f.name for f in frees} < set(found)]
        again = [Fit.at_start(start_at_guess(frees, found), family.column) for frees in simpler]
        chosen = self.simplest([*sorted(again, key=_size), chosen], LONG_ROUNDS)
        if flows:
            return self.with_control(chosen)
        return with_values(family, chosen, STAGES), chosen

    def aside(self, family: Any) -> tuple[Free, ...]:
        """Return effects that are free while a kind is selected, unless the base holds them.

        The leak is free only if the valve is shut in some samples.
        """
        starts = {"regulator.dead_time": {"start": DELAY}}
        if family.plant.air != "flow":
            starts["regulator.exhaust_ratio"] = {"start": 1.0, "log": True}
        if family.is_shut:
            starts["regulator.leak"] = {"start": LEAK, "scale": LEAK}
        known = {free.name for free in family.base()}
        return tuple(family.free(n, **given) for n, given in starts.items() if n not in known)

    def with_effects(
        self, fit: Fit, shown: Mapping[str, Form] | None = None
    ) -> dict[str, tuple[Form, Fit]]:
        """Return, for each cause that a fit lacks, its best form and the fit with it.

        Causes in ``shown`` and forms that share a parameter with those are left out. Of a form with
        parameters that are free already, the others are added.
        """
        shown = shown or {}
        taken = {t.name for form in shown.values() for t in form.terms}
        known, fits = {f.name for f in fit.frees}, []
        for cause in (c for c in self.causes if c.name not in shown):
            for form in filter(self.acts, cause.forms):
                if taken & {t.name for t in form.terms}:
                    continue
                for values in form.starts:
                    frees = [f for f in frees_for(self.family, form, values) if f.name not in known]
                    if not frees:
                        break
                    z = np.concatenate([fit.z, [f.inner(f.start) for f in frees]])
                    more = restarted(fit, frees=(*fit.frees, *frees), z=z, shared=None)
                    fits.append((cause.name, form, more))
        evaluate(self.only, [more for *_, more in fits])
        for rounds in (RACE, GUESS_ROUNDS):
            improve(self.only, [more for *_, more in fits], rounds, 1e-4, FEW_DAMPINGS)
            best = {n: min(m.cost for name, _, m in fits if name == n) for n, *_ in fits}
            fits = [made for made in fits if made[2].cost == best[made[0]]]
        return {name: (form, more) for name, form, more in fits}

    def acts(self, form: Form) -> bool:
        """Return whether a form acts on the pressure alone, and on this kind of regulator."""
        names = {t.name for t in form.terms if t.amount}
        return (
            all(name.startswith(PRESSURE) for name in names)
            and not names & self.family.plant.inert
            and ("regulator.leak" not in names or self.family.is_shut)
        )

    def with_one_effect(self, fit: Fit) -> Fit:
        """Return the best fit of a regulator with one further effect, or without."""
        made = [more for _, more in self.with_effects(fit).values()]
        return min((fit, *made), key=lambda f: -self.gain(fit, f))

    def with_shown_effects(self, fit: Fit) -> tuple[Fit, dict[str, Form]]:
        """Return a fit with the effects that the pressure clearly shows, and their forms by cause.

        Each gains clearly more than any other one.
        """
        fit, shown = self.with_limit(fit)
        while len(shown) < MOST_SHOWN and self.lacks(fit):
            found = self.with_effects(fit, shown)
            gains = sorted((self.gain(fit, more), name) for name, (_, more) in found.items())
            if not gains or gains[-1][0] < SHOWN_GAIN:
                break
            name = gains[-1][1]
            form, more = found[name]
            alone = len(gains) < 2 or gains[-2][0] < CLOSE * gains[-1][0]
            if not alone or any(t.name.startswith(READING) for t in form.terms):
                break
            fit, shown[name] = self.spare(more, form)
        return fit, shown

    def with_limit(self, fit: Fit) -> tuple[Fit, dict[str, Form]]:
        """Return a fit whose only effect is a rate limit, if needed, and that form by cause."""
        known = fit.values()
        form = next((f for f in self.limit.forms if all(t.name in known for t in f.terms)), None)
        less = self.without(fit, ())
        if form is None:
            return less, {}
        limited = self.without(fit, form.terms)
        if self.gain(less, limited) < KIND_GAIN:
            return less, {}
        limited, form = self.spare(limited, form)
        return limited, {self.limit.name: form}

    def without(self, fit: Fit, terms: Sequence[Term]) -> Fit:
        """Return a fit with the regulator, some terms and no other effects."""
        kept = {f.name for f in regulator_of(self.family)} | {t.name for t in terms}
        return self.less(fit, [f.name for f in fit.frees if f.name not in kept])

    def less(self, fit: Fit, names: Collection[str]) -> Fit:
        """Return a fit without some parameters, which take the values of the plant."""
        frees = tuple(f for f in fit.frees if f.name not in names)
        z = np.array([v for f, v in zip(fit.frees, fit.z, strict=True) if f.name not in names])
        column = fit.column.copy()
        gone = [f.place for f in fit.frees if f.name in names]
        column[gone] = self.family.column[gone]
        made = restarted(fit, frees=frees, z=z, column=column, shared=None)
        evaluate(self.only, [made])
        return self.simplest([made], LONG_ROUNDS)

    def spare(self, fit: Fit, form: Form) -> tuple[Fit, Form]:
        """Return a fit and a form without the shape terms that they do not need."""
        terms = form.terms
        for term in terms:
            if not term.amount:
                less = self.less(fit, [term.name])
                if self.gain(less, fit) < ORDER_GAIN:
                    fit, terms = less, tuple(t for t in terms if t is not term)
        return fit, dataclasses.replace(form, terms=terms)

    def slow_tail(self, family: Any, fit: Fit) -> Made | None:
        """Return the lag with a share of the pressure that follows slowly.

        Air that flows into dead volumes, or an integrating pilot, gives such a tail.
        """
        plant = family.plant
        if any(plant.value(name) != plant.neutral[name] for name in (TAIL, "regulator.ring_flow")):
            return None
        overdamped = {"regulator.ring_damping": TAIL_DAMPING}
        other = dataclasses.replace(family, plant=plant.replace(overdamped))
        column = column_of(fit, fit.z)
        column[other.free("regulator.ring_damping").place] = TAIL_DAMPING
        frees = start_at_guess(fit.frees, fit.values())
        share = other.free(TAIL, start=0.05, high=0.5, scale=0.02)
        fits = []
        for hertz in TAIL_FREQUENCIES:
            turns = other.free(TAIL_FREQUENCY, start=hertz, high=TAIL_FASTEST, log=True)
            fits.append(Fit.at_start((*frees, share, turns), column))
        made = self.simplest(fits)
        return with_values(other, made, (TAIL, TAIL_FREQUENCY)), made

    def characteristic(self, family: Any, fit: Fit) -> Made | None:
        """Return the lag, of first or second order, whose rate is not proportional to the error."""
        plant = family.plant
        if plant.air == "flow" or any(plant.value(n) != plant.neutral[n] for n in SPEEDS):
            return None
        given = dict(zip(SPEEDS, CHARACTERISTICS[0], strict=True))
        other = dataclasses.replace(family, plant=plant.replace(given)).finer(FINE_STEP)
        fits = []
        for speeds in CHARACTERISTICS:
            begin = fit.values() | dict(zip(SPEEDS, speeds, strict=True))
            frees = start_at_guess((*regulator_of(other), *self.aside(other)), begin)
            orders = [frees, *second_orders(other, frees)]
            fits += [Fit.at_start(order, other.column) for order in orders]
        made = self.of(other).simplest(fits, LONG_ROUNDS)
        return with_values(other, made, (*SPEEDS, *STAGES)), made

    def integral(self, family: Any, fit: Fit) -> Made | None:
        """Return the lag with a controller that also has an integral part."""
        plant = family.plant
        if plant.air == "flow" or plant.regulator.integral != 0.0:
            return None
        other, column = family.finer(FINE_STEP), column_of(fit, fit.z)
        frees = start_at_guess(fit.frees, fit.values())
        fits = []
        for rate, release in product(INTEGRALS, RELEASES):
            gain = other.free(INTEGRAL[0], start=rate)
            time = other.free(INTEGRAL[1], start=release)
            fits.append(Fit.at_start((*frees, gain, time), column))
        made = self.of(other).simplest(fits, LONG_ROUNDS)
        return with_values(other, made, INTEGRAL), made

    def orifices(self, family: Any, fit: Fit) -> Made | None:
        """Return the plant with flow through orifices.

        The muscle, whose volume is filled, is that of the family or one with another law.
        """
        if not can_flow(self.family):
            return None
        other = dataclasses.replace(family, plant=orifices_of(family)).finer(FINE_STEP)
        law = self.law(family)
        full = family.plant.regulator.max_pressure
        columns = [other.column, column_with(other, law)] if law else [other.column]
        fits = []
        for size, source in product(family.conductances, (1.05 * full, 1.5 * full)):
            begin = {"regulator.conductance": size, "regulator.source_pressure": source}
            frees = start_at_guess((*regulator_of(other), *self.aside(other)), begin)
            fits += [Fit.at_start(frees, column) for column in columns]
        of = self.of(other)
        return of.with_control(of.simplest(promising(of.only, fits), LONG_ROUNDS))

    def with_control(self, fit: Fit) -> Made:
        """Return the orifices and a fit, with a lag of the opening and an integral part if needed.

        Both come together, since a lag of some milliseconds shows only when the motion fits too.
        What the plant already has is kept.
        """
        if not self.lacks(fit) or CONTROL & set(stages_of(self.family.plant)):
            return self.family, fit
        begin = start_at_guess(fit.frees, fit.values())
        values = {name: value for opening in OPENINGS for name, value in opening.items()}
        further = (self.family.free(name, start=value) for name, value in values.items())
        more = Fit.at_start((*begin, *further), column_of(fit, fit.z))
        made = self.simplest([fit, more], LONG_ROUNDS)
        return with_values(self.family, made, CONTROL), made

    def of(self, family: Any) -> "Selection":
        """Return the selection with the simulation of another family."""
        return dataclasses.replace(self, family=family)

    @cached_property
    def pressures(self) -> Flags:
        """Whether each channel is a pressure that was recorded, (channels,)."""
        named = [channel.startswith("pressure") for channel in self.family.channels]
        return np.array(named) & np.isfinite(self.problem.measured).any(axis=1)

    @cached_property
    def only(self) -> Problem:
        """The problem of fitting the pressure alone."""
        alone = np.where(self.pressures[:, None], self.problem.measured, np.nan)
        return dataclasses.replace(
            self.problem,
            measured=alone,
            simulate=self.family.simulate,
            tie=self.family.tie,
            violations=no_violations,
            checks=0,
        )

    def left(self, fit: Fit) -> Array:
        """Return the mean squares of the pressures' residuals over their noise, (pressures,)."""
        errors = self.blocks.errors(self.only.rows(fit.residual))
        return np.asarray(self.blocks.means(errors)[self.pressures])

    def lacks(self, fit: Fit) -> bool:
        """Return whether a regulator leaves more of a pressure than noise."""
        return bool(self.left(fit).max() >= FITS)

    def possible(self, fit: Fit) -> float:
        """Return the largest possible gain over a fit, that of a model that leaves only noise."""
        return float(np.log(np.maximum(1.0, self.left(fit))).sum())

    def gain(self, before: Fit, after: Fit) -> float:
        """Return the gain of a fit over another one."""
        rows = (self.only.rows(fit.residual) for fit in (before, after))
        return self.blocks.gain(*map(self.blocks.errors, rows))

    def simplest(self, fits: list[Fit], rounds: int = GUESS_ROUNDS) -> Fit:
        """Return the best of some fits; one with more parameters needs a gain."""
        return simplest(self.only, self.blocks, fits, rounds)


def _size(fit: Fit) -> int:
    return len(fit.frees)


def regulator_of(family: Any) -> tuple[Free, ...]:
    """Return the free parameters of the regulator, the volume behind it and the clock."""
    every = family.base()
    others = (*family.volumes, CLOCK)
    return tuple(f for f in every if f.name.startswith("regulator.") or f.name in others)


def second_orders(family: Any, frees: tuple[Free, ...]) -> list[tuple[Free, ...]]:
    """Return the free parameters of a lag with those of each second order.

    An empty list if the lag already is of second order.
    """
    if {f.name for f in frees} & STAGES:
        return []
    return [
        (*frees, *(family.free(name, start=start) for name, start in order.items()))
        for order in reversed(SECOND_ORDER)
    ]


def with_values(family: Any, fit: Fit, names: Collection[str]) -> Any:
    """Return the family whose plant has some parameters of a fit, as far as they are free in it."""
    values = {name: value for name, value in fit.values().items() if name in names}
    return dataclasses.replace(family, plant=family.plant.replace(values)) if values else family


def simplest(problem: Problem, blocks: Blocks, fits: list[Fit], rounds: int = GUESS_ROUNDS) -> Fit:
    """Return the best of some fits; one with more parameters needs a gain."""
    evaluate(problem, [fit for fit in fits if not len(fit.residual)])
    improve(problem, fits, RACE, 1e-4, FEW_DAMPINGS)
    improve(problem, near(fits), rounds - RACE, 1e-4, FEW_DAMPINGS)
    errors = [blocks.errors(problem.rows(fit.residual)) for fit in fits]
    chosen = 0
    for k in range(1, len(fits)):
        more = len(fits[k].frees) > len(fits[chosen].frees)
        if blocks.gain(errors[chosen], errors[k]) > (ORDER_GAIN if more else 0.0):
            chosen = k
    improve(problem, [fits[chosen]], rounds - RACE, 1e-4, FEW_DAMPINGS)  # it may have been behind
    return fits[chosen]


def column_with(family: Any, law: Mapping[str, float]) -> Array:
    """Return the column of a family with some parameters, within their bounds."""
    column = family.column
    for name, value in law.items():
        free = family.free(name)
        column[free.place] = free.within(value)
    family.tie(column[None])
    return column


def can_flow(family: Any) -> bool:
    """Return whether flow through orifices may replace the regulator of a family's plant."""
    plant = family.plant
    effects = {f"regulator.{name}" for name in REPLACED} & set(plant.neutral)
    return (
        plant.air != "flow"
        and not plant.flowless
        and all(plant.value(n) == plant.neutral[n] for n in effects - STAGES)
    )


def orifices_of(family: Any) -> Any:
    """Return a family's plant with flow through orifices at their starting values."""
    plant = family.plant
    source = max(ORIFICES["regulator.source_pressure"], 1.2 * plant.regulator.max_pressure)
    first_order = {name: plant.neutral[name] for name in STAGES & set(plant.neutral)}
    values = {**family.orifices, "regulator.source_pressure": source, **first_order}
    return plant.replace_with_substeps({**values, SWITCH: float(AIRS.index("flow"))})


def start_at_guess(frees: tuple[Free, ...], found: dict[str, float]) -> tuple[Free, ...]:
    """Return free parameters that start at the guess, within their bounds."""
    return tuple(
        dataclasses.replace(f, start=f.within(found[f.name])) if f.name in found else f
        for f in frees
    )
