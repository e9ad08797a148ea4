"""Calibration of the plant's base parameters, so that wrong values are not taken for effects."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import product

import numpy as np
from scipy.ndimage import uniform_filter1d

from pam_envs.arrays import Array
from pam_envs.diagnosis.cause import Form
from pam_envs.diagnosis.fit.balance import Balance
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import Candidate, fit_base, frees_for, restarted
from pam_envs.diagnosis.fit.least_squares import (
    FEW_DAMPINGS,
    LANES,
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
    BORE,
    CLOCK,
    LAG,
    ORIFICES,
    PILOT,
    START,
    MuscleFamily,
    spanning,
    states_of,
)
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.pneumatics.flow import AIRS, REPLACED, SWITCH

FAST = 0.04  # lag [s] below which the replay takes finer steps, as with orifices
FINE_STEP, FINEST_STEP = 0.0101, 0.0051
"""Longest steps [s] of a replay with a fast regulator of first and of second order."""
RACE, GUESS_ROUNDS, FLOW_ROUNDS, ROUNDS = 2, 6, 12, 10
"""Rounds after which only fits near the best one continue, and rounds of each stage."""
DAMPING = "mass.damping"
SMOOTH = 0.1  # window [s] over which measured pressures are averaged


@dataclasses.dataclass(frozen=True)
class Calibration:
    """Base of a plant, fitted to a recording."""

    family: MuscleFamily
    problem: Problem
    base: Candidate
    guesses: Sequence[Mapping[str, float]]  # starting values, of the base and its differences
    rate: Form | None  # form of the limited rate that the pressure needs
    # whether a linear model may show that a difference is needed, without a refit
    linear: bool = True
    # parameters of the start of the recording, which are fitted beside the differences
    begins: tuple[str, ...] = ()
    # gives the starting values with friction of one kind alone
    others: Callable[[], Sequence[Mapping[str, float]]] = tuple


def calibrate(
    family: MuscleFamily,
    measured: Array,
    noise: Array,
    blocks: Blocks,
    time: Array,
    shapes: Array | None = None,
    rates: Sequence[Form] = (),
) -> Calibration:
    """Fit the base of a plant.

    The regulator is fitted first, to the pressure alone, in several orders; then the static map
    and the friction by a regression of the force balance; then all parameters by simulation, from
    that guess and from the given plant. ``measured`` (channels, T) is NaN where there is no
    reading, ``noise`` is its RMS (channels,), ``shapes`` those of :class:`Problem`; ``rates`` are
    the forms of a limited rate that the regulator may have.
    """
    extra = np.zeros((0, 0)) if shapes is None else shapes
    pressure = np.where(np.isfinite(measured[1]), measured[1], np.maximum(0, family.inputs.command))
    states = states_of(measured[0], pressure, family.plant)
    family = dataclasses.replace(family, plant=spanning(family.plant, states), states=states)
    problem = Problem(
        family.simulate,
        measured,
        noise,
        blocks.train,
        time,
        family.tie,
        extra,
        family.violations,
        family.checks,
    )
    column, rate = family.column, None
    found: dict[str, float] = {}
    plays = family.plant.hysteresis.model.kind == PlayOperator.kind
    moved = np.isfinite(measured[0]).any() and plays
    if np.isfinite(measured[1]).any():
        regulated, fit = regulator(problem, family, blocks, rates)
        family = regulated
        if lacks(problem, blocks, fit):
            family, fit = slow_tail(problem, regulated, blocks, fit) or (family, fit)
            if can_flow(regulated) and lacks(problem, blocks, fit):
                rough: dict[str, float] = {}
                if moved:
                    balance = Balance.of(family, measured[0], smoothed(pressure, time), noise[0])
                    rough = balance.flexible() if balance is not None else {}
                family, fit = orifices(problem, regulated, blocks, fit, rough) or (family, fit)
        found |= fit.values()
        rate = next((r for r in rates if all(t.name in found for t in r.terms)), None)
        if family.plant.air == "regulator" and found[LAG] < FAST:
            family = family.finer(FINEST_STEP if set(PILOT) <= set(found) else FINE_STEP)
        problem = replayed_by(family, problem)
        column = column_of(fit, fit.z)
    frees = family.base()
    tried: list[tuple[Free, ...]] = [frees]
    law: dict[str, float] = {}
    wide: dict[str, float] = {}
    others: Callable[[], Sequence[Mapping[str, float]]] = tuple
    if moved:
        pressure = family.simulate(column[None])[1, :, 0]
        balance = Balance.of(family, measured[0], pressure, noise[0])
        if balance is not None:
            balance = balance.with_best_braid()
            law, wide = balance.solve(), balance.flexible()
            law[DAMPING] = best_damping(problem, column_with(family, found | law | wide), family)
            others = partial(with_one_friction, balance, found | law)
        guess = start_at_guess(frees, found | law)
        tried = [guess, frees] if law else [guess]
    plain = family.column
    best = fit_base(problem, blocks, plain, tried, ROUNDS)
    guesses = (found | law | wide,)
    return Calibration(family, problem, best, guesses, rate, begins=(START,), others=others)


def with_one_friction(balance: Balance, found: dict[str, float]) -> list[dict[str, float]]:
    """Return starting values with friction of one kind alone, beside those already found."""
    return [found | other for other in balance.others()]


def smoothed(pressure: Array, time: Array) -> Array:
    """Return measured pressures (T,) without the fast part of their noise."""
    window = max(1, round(SMOOTH / float(time[1] - time[0])))
    return np.asarray(uniform_filter1d(pressure, window))


def column_with(family: MuscleFamily, law: Mapping[str, float]) -> Array:
    """Return the column of a family with some parameters, within their bounds."""
    column = family.column
    for name, value in law.items():
        free = family.free(name)
        column[free.place] = free.within(value)
    family.tie(column[None])
    return column


def best_damping(problem: Problem, column: Array, family: MuscleFamily) -> float:
    """Return the damping [N s/m] with which a column fits best: slow motion does not show it."""
    free = family.free(DAMPING)
    columns = np.tile(column, (LANES, 1))
    columns[:, free.place] = np.geomspace(free.low, free.high, LANES)
    left = problem.residuals(columns)[:, : problem.seen]
    return float(columns[np.argmin(np.einsum("ki,ki->k", left, left)), free.place])


def replayed_by(family: MuscleFamily, problem: Problem) -> Problem:
    """Return a problem whose columns are those of a family."""
    return dataclasses.replace(
        problem, simulate=family.simulate, tie=family.tie, violations=family.violations
    )


ORDER_GAIN = 0.05
"""Gain on held-out pressures that a regulator of higher order needs."""
FITS, FLOW_GAIN = 1.5, 0.2
"""Mean square of the pressure's residual over its noise below which nothing more is tried, and the
gain that flow through orifices needs."""
TAIL, TAIL_FREQUENCY = "regulator.ring_share", "regulator.ring_frequency"
TAIL_DAMPING = 2.0
"""Damping ratio with which the line of a regulator gives a slow share of the pressure."""
TAIL_FREQUENCIES, TAIL_FASTEST = (0.6, 1.0), 2.0
"""Frequencies [Hz] at which a fit of that share starts, and the largest one."""
TAIL_GAIN = 0.3
"""Gain that it needs."""
DELAY, LEAK = 0.02, 0.005
"""Dead time [s] and leak [1/s] at which a fit starts."""
CONDUCTANCES = (1e-10, 8e-10)
"""Conductances [m3/(s Pa)] at which a fit starts."""


def regulator(
    problem: Problem, family: MuscleFamily, blocks: Blocks, rates: Sequence[Form]
) -> tuple[MuscleFamily, Fit]:
    """Return the plant with the regulator that the pressure needs, and its fit to the pressure.

    First order or with a pilot stage, either with or without a limit of its rate (``rates``).
    """
    lag = (*regulator_of(family), *leak_of(family))
    known = {f.name for f in lag}
    second = (*lag, *(family.free(name, start=start) for name, start in PILOT.items()))
    flows = family.plant.air == "flow"
    orders = [lag] if flows or known & set(PILOT) else [lag, second]
    limits: list[tuple[Free, ...]] = [()]
    for form in rates:
        if not flows and not any(t.name in known for t in form.terms):
            limits += [frees_for(family, form, values) for values in form.starts]
    fits = [Fit.at_start((*order, *limit), family.column) for order in orders for limit in limits]
    only = of_pressure(problem)
    chosen = simplest(only, blocks, fits)
    if "regulator.pilot_lag" in chosen.values():
        pilot = {name: chosen.values()[name] for name in PILOT}
        family = dataclasses.replace(family, plant=family.plant.replace(pilot))
    return family, chosen


def regulator_of(family: MuscleFamily) -> tuple[Free, ...]:
    """Return the free parameters of the regulator and the clock."""
    every = family.base()
    return tuple(f for f in every if f.name.startswith("regulator.") or f.name in (BORE, CLOCK))


def of_pressure(problem: Problem) -> Problem:
    """Return the problem of fitting the pressure alone."""
    alone = problem.measured.copy()
    alone[0] = np.nan
    return dataclasses.replace(problem, measured=alone, violations=no_violations, checks=0)


def lacks(problem: Problem, blocks: Blocks, fit: Fit) -> bool:
    """Return whether a regulator leaves more of the pressure than noise."""
    left = blocks.errors(of_pressure(problem).rows(fit.residual))
    return bool(blocks.means(left)[1] >= FITS)


def gain_of(problem: Problem, blocks: Blocks, before: Fit, after: Fit) -> float:
    """Return the gain of a fit over another one."""
    return blocks.gain(*(blocks.errors(problem.rows(f.residual)) for f in (before, after)))


def slow_tail(
    problem: Problem, family: MuscleFamily, blocks: Blocks, fit: Fit
) -> tuple[MuscleFamily, Fit] | None:
    """Return the plant with a share of the pressure that follows slowly, None if hardly better.

    Air that flows into dead volumes, or an integrating pilot, gives such a tail.
    """
    plant = family.plant
    if any(plant.value(name) != plant.neutral[name] for name in (TAIL, "regulator.ring_flow")):
        return None
    overdamped = {"regulator.ring_damping": TAIL_DAMPING}
    other = dataclasses.replace(family, plant=plant.replace(overdamped))
    column = column_of(fit, fit.z)
    column[R.place("regulator.ring_damping")] = TAIL_DAMPING
    frees = start_at_guess(fit.frees, fit.values())
    share = other.free(TAIL, start=0.05, high=0.5, scale=0.02)
    fits = []
    for hertz in TAIL_FREQUENCIES:
        turns = other.free(TAIL_FREQUENCY, start=hertz, high=TAIL_FASTEST, log=True)
        fits.append(Fit.at_start((*frees, share, turns), column))
    only = of_pressure(problem)
    made = simplest(only, blocks, fits)
    if gain_of(only, blocks, fit, made) < TAIL_GAIN:
        return None
    values = {name: made.values()[name] for name in (TAIL, TAIL_FREQUENCY)}
    return dataclasses.replace(other, plant=other.plant.replace(values)), made


def orifices(
    problem: Problem, family: MuscleFamily, blocks: Blocks, fit: Fit, law: Mapping[str, float]
) -> tuple[MuscleFamily, Fit] | None:
    """Return the plant with flow through orifices and its fit, None if hardly better than a fit.

    The muscle, whose volume is filled, is that of the family or one with the parameters ``law``.
    """
    other = dataclasses.replace(family, plant=orifices_of(family.plant)).finer(FINE_STEP)
    full = family.plant.regulator.max_pressure
    columns = [other.column, column_with(other, law)] if law else [other.column]
    fits = []
    for size, source in product(CONDUCTANCES, (1.05 * full, 1.5 * full)):
        begin = {"regulator.conductance": size, "regulator.source_pressure": source}
        frees = start_at_guess((*regulator_of(other), *delay_of(other), *leak_of(other)), begin)
        fits += [Fit.at_start(frees, column) for column in columns]
    only = dataclasses.replace(of_pressure(problem), simulate=other.simulate, tie=other.tie)
    flow = simplest(only, blocks, promising(only, fits), FLOW_ROUNDS)
    if gain_of(only, blocks, fit, flow) < FLOW_GAIN:
        return None
    uneven = with_slower_exhaust(of_pressure(problem), family, blocks, fit)
    return None if gain_of(only, blocks, uneven, flow) < FLOW_GAIN else (other, flow)


def delay_of(family: MuscleFamily) -> tuple[Free, ...]:
    """Return the dead time unless the base holds it.

    A dead time makes the better of two kinds of regulator look like the worse.
    """
    return unless_in_base(family, "regulator.dead_time", start=DELAY)


def leak_of(family: MuscleFamily) -> tuple[Free, ...]:
    """Return the leak where the valve is shut in some samples, and the base does not hold it.

    The fall of the pressure behind a shut valve says nothing on the kind of regulator.
    """
    if not np.any(family.inputs.command < 0.0):
        return ()
    return unless_in_base(family, "regulator.leak", start=LEAK, scale=LEAK)


def unless_in_base(family: MuscleFamily, name: str, **settings: float) -> tuple[Free, ...]:
    """Return a free parameter unless the base holds it."""
    known = any(free.name == name for free in family.base())
    return () if known else (family.free(name, **settings),)


def with_slower_exhaust(problem: Problem, family: MuscleFamily, blocks: Blocks, fit: Fit) -> Fit:
    """Return the fit of a regulator whose exhaust is slower or faster than its filling.

    Orifices also have an exhaust unlike the filling, which alone does not show them.
    """
    taper = family.free("regulator.exhaust_taper", start=0.3, scale=0.5)
    more, fits = (taper, *delay_of(family)), []
    for ratio in (0.7, 1.5):
        frees = (family.free("regulator.exhaust_ratio", start=ratio, log=True), *more)
        z = np.concatenate([fit.z, [f.inner(f.start) for f in frees]])
        fits.append(restarted(fit, frees=(*fit.frees, *frees), z=z, shared=None))
    evaluate(problem, fits)
    return simplest(problem, blocks, fits)


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
    return fits[chosen]


def can_flow(family: MuscleFamily) -> bool:
    """Return whether flow through orifices may replace the regulator of a family's plant."""
    plant = family.plant
    return (
        plant.air != "flow"
        and not plant.flowless
        and all(
            plant.value(f"regulator.{name}") == plant.neutral[f"regulator.{name}"]
            for name in REPLACED
            if name != "pilot_lag" and f"regulator.{name}" in plant.neutral
        )
    )


def orifices_of(plant: SingleMuscle) -> SingleMuscle:
    """Return a plant with flow through orifices at their starting values, without a pilot."""
    source = max(ORIFICES["regulator.source_pressure"], 1.2 * plant.regulator.max_pressure)
    values = {**ORIFICES, "regulator.source_pressure": source, "regulator.pilot_lag": 0.0}
    return plant.replace_with_substeps({**values, SWITCH: float(AIRS.index("flow"))})


def start_at_guess(frees: tuple[Free, ...], found: dict[str, float]) -> tuple[Free, ...]:
    """Return free parameters that start at the guess, within their bounds."""
    return tuple(
        dataclasses.replace(f, start=f.within(found[f.name])) if f.name in found else f
        for f in frees
    )
