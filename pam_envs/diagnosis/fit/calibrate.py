"""Calibration of the plant's base parameters, so that wrong values are not taken for effects."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from scipy.ndimage import uniform_filter1d

from pam_envs.arrays import Array
from pam_envs.diagnosis.cause import Cause, Form
from pam_envs.diagnosis.fit.balance import Balance
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import Candidate, fit_base
from pam_envs.diagnosis.fit.least_squares import (
    LANES,
    Free,
    Problem,
    column_of,
)
from pam_envs.diagnosis.fit.regulator_kind import (
    FINE_STEP,
    Selection,
    column_with,
    start_at_guess,
)
from pam_envs.diagnosis.fit.single_muscle import (
    LAG,
    STAGES,
    START,
    MuscleFamily,
    spanning,
    states_of,
)
from pam_envs.hysteresis.maxwell_slip import PlayOperator

FAST = 0.04  # lag [s] below which the replay takes finer steps, as with orifices
FINEST_STEP = 0.0051
"""Longest step [s] of a replay with a fast regulator of second order."""
ROUNDS = 10
DAMPING = "mass.damping"
SMOOTH = 0.1  # window [s] over which measured pressures are averaged


@dataclasses.dataclass(frozen=True)
class Calibration:
    """Base of a plant, fitted to a recording."""

    family: MuscleFamily
    problem: Problem
    base: Candidate
    guesses: Sequence[Mapping[str, float]]  # starting values, of the base and its differences
    shown: Mapping[str, Form]  # effects of the valve that the pressure clearly shows, by cause
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
    shapes: Array,
    limit: Cause,
    causes: Sequence[Cause],
) -> Calibration:
    """Fit the base of a plant.

    The regulator is fitted first, to the pressure alone, in several orders; then the static map
    and the friction by a regression of the force balance; then all parameters by simulation, from
    that guess and from the given plant. ``measured`` (channels, T) is NaN where there is no
    reading, ``noise`` is its RMS (channels,), ``shapes`` those of :class:`Problem`, ``limit`` the
    cause of a rate limit. Of the other ``causes``, those that act on the pressure are tried in the
    selection of the regulator.
    """
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
        shapes,
        family.violations,
        family.checks,
    )
    column, shown = family.column, dict[str, Form]()
    found: dict[str, float] = {}
    plays = family.plant.hysteresis.model.kind == PlayOperator.kind
    moved = np.isfinite(measured[0]).any() and plays
    if np.isfinite(measured[1]).any():

        def law_of(regulated: MuscleFamily) -> Mapping[str, float]:
            """Return parameters of the static law, fitted with the recorded pressure."""
            smooth = smoothed(pressure, time)
            balance = Balance.of(regulated, measured[0], smooth, noise[0]) if moved else None
            return balance.flexible() if balance is not None else {}

        selection = Selection(problem, family, blocks, limit, causes, law_of)
        family, fit, shown = selection.selected()
        found |= fit.values()
        if family.plant.air == "regulator" and found[LAG] < FAST:
            family = family.finer(FINEST_STEP if STAGES & set(found) else FINE_STEP)
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
    return Calibration(family, problem, best, guesses, shown, begins=(START,), others=others)


def with_one_friction(balance: Balance, found: dict[str, float]) -> list[dict[str, float]]:
    """Return starting values with friction of one kind alone, beside those already found."""
    return [found | other for other in balance.others()]


def smoothed(pressure: Array, time: Array) -> Array:
    """Return measured pressures (T,) without the fast part of their noise."""
    window = max(1, round(SMOOTH / float(time[1] - time[0])))
    return np.asarray(uniform_filter1d(pressure, window))


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
