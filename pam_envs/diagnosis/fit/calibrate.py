"""Calibration of the plant's base parameters, so that wrong values are not taken for effects."""

import dataclasses

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.optimize import lsq_linear

from pam_envs.arrays import Array
from pam_envs.constants import GRAVITY
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import Candidate, fit_base
from pam_envs.diagnosis.fit.least_squares import Fit, Free, Problem, column_of, evaluate, improve
from pam_envs.diagnosis.fit.single_muscle import MuscleFamily
from pam_envs.hysteresis.maxwell_slip import PlayOperator

PRESSURE = ("regulator.gain", "regulator.time_constant")
FAST = 0.04  # lag [s] below which the replay takes finer steps
FINE_STEP = 0.0101
GUESS_ROUNDS, ROUNDS = 6, 12
FAR = 8.0  # cost per reading above which a fit may be in a local optimum
SLOW = 0.008  # speed [m/s] below which a sample is an equilibrium of forces
MOST = 4000  # largest number of samples


def calibrate(
    family: MuscleFamily, measured: Array, noise: Array, blocks: Blocks, time: Array
) -> tuple[MuscleFamily, Problem, Candidate]:
    """Return the family, the problem and the fitted base.

    The regulator is fitted first, to the pressure alone; then the static map and the friction by a
    regression of the force balance; then all parameters by simulation. If that fit is far from the
    readings, a second one starts from the given plant, and the better of the two is kept.
    ``measured`` (channels, T) is NaN where there is no reading, ``noise`` is its RMS (channels,).
    """
    problem = Problem(family.simulate, measured, noise, blocks.train, time, family.tie)
    frees, column = family.base(), family.column
    found: dict[str, float] = {}
    if np.isfinite(measured[1]).any():
        fit = _regulator(problem, family)
        found |= fit.values()
        column = column_of(fit, fit.z)
        if found["regulator.time_constant"] < FAST:
            family = family.finer(FINE_STEP)
            problem = dataclasses.replace(problem, simulate=family.simulate)
    tried = [frees]
    plays = family.plant.hysteresis.model.kind == PlayOperator.kind
    if np.isfinite(measured[0]).any() and plays:
        law = balance(family, measured[0], family.simulate(column[None])[1, :, 0])
        guess = start_at_guess(frees, found | law)
        tried = [guess, frees] if law else [guess]
    best = fit_base(problem, blocks, column, tried[0], ROUNDS)
    for start in tried[1:]:
        if best.fit.cost < FAR * problem.seen:
            break
        other = fit_base(problem, blocks, column, start, ROUNDS)
        best = min(best, other, key=lambda c: c.fit.cost)
    return family, problem, best


def _regulator(problem: Problem, family: MuscleFamily) -> Fit:
    """Return the fit of the regulator's gain and lag to the pressure."""
    frees = tuple(f for f in family.base() if f.name in PRESSURE)
    alone = problem.measured.copy()
    alone[0] = np.nan
    only = dataclasses.replace(problem, measured=alone)
    fit = Fit.at_start(frees, family.column)
    evaluate(only, [fit])
    improve(only, [fit], GUESS_ROUNDS, 1e-4)
    return fit


def balance(family: MuscleFamily, contraction: Array, pressure: Array) -> dict[str, float]:
    """Return coefficients of the static law and play weights; none with too few slow samples.

    In slow motion the load equals the force law, which is linear in its coefficients for given play
    outputs. The result only starts a fit, since its regressors contain noise. ``contraction`` (T,)
    are readings [m], NaN where there is none, ``pressure`` (T,) is simulated [Pa].
    """
    plant, load, period = family.plant, family.inputs.load, family.inputs.period
    usable = np.isfinite(contraction)
    below = plant._absolute(np.zeros(1), load[:1])[0] if load[0] > 0 else 0.0
    contraction = contraction + float(below)  # relative to the unloaded rest length
    window = max(3, round(0.1 / period))
    smooth = uniform_filter1d(np.nan_to_num(contraction), window)
    pace = np.abs(np.gradient(smooth, period))
    rows = np.flatnonzero(usable & (uniform_filter1d(pace, window) < SLOW))
    if len(rows) < 200:
        return {}
    rows = rows[:: max(1, len(rows) // MOST)]
    e, p = smooth[rows] / plant.muscle.rest_length, pressure[rows]
    thresholds: tuple[float, ...] = plant.hysteresis.model.thresholds  # type: ignore[attr-defined]
    plays = [PlayOperator((size,), (1.0,), 0.0).simulate(pressure)[0] for size in thresholds]
    gaps = (pressure - np.reshape(plays, (len(thresholds), len(pressure))))[:, rows]
    force = load[rows] * GRAVITY
    bend = -np.expm1(-e / plant.muscle.braid_strain)
    passive = [-bend, -e, -(e**2), -(e**3), -(e**4)]
    taper = np.zeros(len(rows))
    found: dict[str, float] = {}
    for _ in range(3):
        columns = np.array([p, -e * p, -(e**2) * p, *passive, *(-gaps * (1.0 - taper))]).T
        scale = np.linalg.norm(columns, axis=0) + 1e-12
        low = np.full(columns.shape[1], -np.inf)
        low[[0, 3]] = 0.0
        low[8:] = 0.0
        solved = lsq_linear(columns / scale, force, (low, np.full(len(low), np.inf)))
        c = solved.x / scale
        area = max(c[0], 1e-6)
        taper = np.clip((c[1] * e + c[2] * e**2) / area, -1.0, 0.95)
        found = {
            "muscle.area": area,
            "muscle.area_taper": c[1] / area,
            "muscle.area_curve": c[2] / area,
            "muscle.braid_force": max(c[3], 1e-3),
            "muscle.stiffness": c[4],
            "muscle.softening": c[5],
            "muscle.hardening": c[6],
            "muscle.stiffening": c[7],
        }
        found |= {f"hysteresis.weight[{k}]": w / area for k, w in enumerate(c[8:])}
    return found


def start_at_guess(frees: tuple[Free, ...], found: dict[str, float]) -> tuple[Free, ...]:
    """Return free parameters that start at the guess, within their bounds."""
    made = []
    for free in frees:
        if free.name not in found:
            made.append(free)
            continue
        low = max(free.low, 1e-9) if free.log else free.low
        start = float(np.clip(found[free.name], low, free.high))
        made.append(dataclasses.replace(free, start=start))
    return tuple(made)
