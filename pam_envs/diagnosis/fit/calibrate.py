"""Calibration of the plant's base parameters, so that wrong values are not taken for effects."""

import dataclasses
from collections.abc import Sequence
from itertools import product

import numpy as np

from pam_envs.arrays import Array
from pam_envs.diagnosis.cause import Form
from pam_envs.diagnosis.fit.balance import Balance
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import Candidate, fit_base, frees_for
from pam_envs.diagnosis.fit.least_squares import (
    FEW_DAMPINGS,
    Fit,
    Free,
    Problem,
    column_of,
    evaluate,
    improve,
)
from pam_envs.diagnosis.fit.single_muscle import (
    CLOCK,
    LAG,
    ORIFICES,
    PILOT,
    MuscleFamily,
    spanning,
    states_of,
)
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.pneumatics.flow import REPLACED

FAST = 0.04  # lag [s] below which the replay takes finer steps
FINE_STEP = 0.0101
GUESS_ROUNDS, ROUNDS = 6, 10


@dataclasses.dataclass(frozen=True)
class Calibration:
    """Base of a plant, fitted to a recording."""

    family: MuscleFamily
    problem: Problem
    base: Candidate
    guess: dict[str, float]  # starting values by parameter, of the base and its differences
    rate: Form | None  # form of the limited rate that the pressure needs


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
    if np.isfinite(measured[1]).any():
        family, fit = regulator(problem, family, blocks, rates)
        found |= fit.values()
        rate = next((r for r in rates if all(t.name in found for t in r.terms)), None)
        if family.plant.air == "regulator" and found[LAG] < FAST:
            family = family.finer(FINE_STEP)
        problem = replayed_by(family, problem)
        column = column_of(fit, fit.z)
    frees = family.base()
    tried: list[tuple[Free, ...]] = [frees]
    law: dict[str, float] = {}
    wide: dict[str, float] = {}
    plays = family.plant.hysteresis.model.kind == PlayOperator.kind
    if np.isfinite(measured[0]).any() and plays:
        pressure = family.simulate(column[None])[1, :, 0]
        slow = Balance.of(family, measured[0], pressure, noise[0])
        if slow is not None:
            law, wide = slow.solve(), slow.flexible()
            plant = family.plant.replace({"muscle.braid_strain": slow.braid})
            family = dataclasses.replace(family, plant=plant)
            problem = replayed_by(family, problem)
        guess = start_at_guess(frees, found | law)
        tried = [guess, frees] if law else [guess]
    plain = family.column
    best = fit_base(problem, blocks, plain, tried, ROUNDS)
    return Calibration(family, problem, best, found | law | wide, rate)


def replayed_by(family: MuscleFamily, problem: Problem) -> Problem:
    """Return a problem whose columns are those of a family."""
    return dataclasses.replace(
        problem, simulate=family.simulate, tie=family.tie, violations=family.violations
    )


ORDER_GAIN = 0.05
"""Gain on held-out pressures that a regulator of higher order needs."""
FITS, FLOW_GAIN = 1.5, 0.2
"""Mean square of the pressure's residual over its noise below which no flow is tried, and the gain
that it needs."""
CONDUCTANCES = (1e-10, 8e-10)
"""Conductances [m3/(s Pa)] at which a fit starts."""


def regulator(
    problem: Problem, family: MuscleFamily, blocks: Blocks, rates: Sequence[Form]
) -> tuple[MuscleFamily, Fit]:
    """Return the plant with the regulator that the pressure needs, and its fit to the pressure.

    First order or with a pilot stage, either with or without a limit of its rate (``rates``); or,
    if it is clearly better, with flow through the orifices of a valve.
    """
    alone = problem.measured.copy()
    alone[0] = np.nan
    lag = tuple(f for f in family.base() if f.name.startswith("regulator.") or f.name == CLOCK)
    known = {f.name for f in lag}
    second = (*lag, *(family.free(name, start=start) for name, start in PILOT.items()))
    flows = family.plant.air == "flow"
    orders = [lag] if flows or known & set(PILOT) else [lag, second]
    limits: list[tuple[Free, ...]] = [()]
    for form in rates:
        if not flows and not any(t.name in known for t in form.terms):
            limits += [frees_for(family, form, values) for values in form.starts]
    fits = [Fit.at_start((*order, *limit), family.column) for order in orders for limit in limits]
    only = dataclasses.replace(problem, measured=alone)
    chosen = simplest(only, blocks, fits)
    if "regulator.pilot_lag" in chosen.values():
        pilot = {name: chosen.values()[name] for name in PILOT}
        family = dataclasses.replace(family, plant=family.plant.replace(pilot))
    before = blocks.errors(only.rows(chosen.residual))
    if flows or not can_flow(family) or blocks.means(before)[1] < FITS:
        return family, chosen
    other = dataclasses.replace(family, plant=orifices_of(family.plant))
    full = family.plant.regulator.max_pressure
    named = [f for f in other.base() if f.name.startswith("regulator.") or f.name == CLOCK]
    starts = [
        tuple(dataclasses.replace(f, start=begin.get(f.name, f.start)) for f in named)
        for begin in (
            {"regulator.conductance": size, "regulator.source_pressure": source}
            for size, source in product(CONDUCTANCES, (1.05 * full, 1.5 * full))
        )
    ]
    only = dataclasses.replace(only, simulate=other.simulate, tie=other.tie)
    flow = simplest(only, blocks, [Fit.at_start(frees, other.column) for frees in starts], 12)
    if blocks.gain(before, blocks.errors(only.rows(flow.residual))) < FLOW_GAIN:
        return family, chosen
    return other, flow


def simplest(problem: Problem, blocks: Blocks, fits: list[Fit], rounds: int = GUESS_ROUNDS) -> Fit:
    """Return the best of some fits; one with more parameters needs a gain."""
    evaluate(problem, fits)
    improve(problem, fits, rounds, 1e-4, FEW_DAMPINGS)
    errors = [blocks.errors(problem.rows(fit.residual)) for fit in fits]
    chosen = 0
    for k in range(1, len(fits)):
        more = len(fits[k].frees) > len(fits[chosen].frees)
        if blocks.gain(errors[chosen], errors[k]) > (ORDER_GAIN if more else 0.0):
            chosen = k
    return fits[chosen]


def can_flow(family: MuscleFamily) -> bool:
    """Return whether the plant of a family may have flow through orifices."""
    plant = family.plant
    return not plant.flowless and all(
        plant.value(f"regulator.{name}") == plant.neutral[f"regulator.{name}"]
        for name in REPLACED
        if name != "pilot_lag" and f"regulator.{name}" in plant.neutral
    )


def orifices_of(plant: SingleMuscle) -> SingleMuscle:
    """Return a plant with flow through orifices at their starting values, without a pilot."""
    source = max(ORIFICES["regulator.source_pressure"], 1.2 * plant.regulator.max_pressure)
    values = {**ORIFICES, "regulator.source_pressure": source, "regulator.pilot_lag": 0.0}
    return plant.replace(values).with_air("flow")


def start_at_guess(frees: tuple[Free, ...], found: dict[str, float]) -> tuple[Free, ...]:
    """Return free parameters that start at the guess, within their bounds."""
    return tuple(
        dataclasses.replace(f, start=f.within(found[f.name])) if f.name in found else f
        for f in frees
    )
