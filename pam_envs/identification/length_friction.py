"""Identification of a muscle with friction driven by length from quasi-static cycles.

Static law, stiffnesses of the friction elements and the dependence of their slip forces on pressure
and load are fitted together by least squares on the mean contractions and on the three published
loop widths (:mod:`~pam_envs.identification.contraction_cycles`). The elements' stiffnesses are
those of relays: one value for Maxwell-slip, one for each cell of strain for Preisach. What the
readings do not determine follows from a prior: elements of equal slip force, and stiffnesses that
change little from element to element and from cell to cell.
"""

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from pam_envs.arrays import Array
from pam_envs.constants import GRAVITY
from pam_envs.hysteresis.slip import PreisachSlip, SlipModel, StraightSlip
from pam_envs.plants.single_muscle.hysteresis import Hysteresis
from pam_envs.plants.single_muscle.plant import SingleMuscle

THRESHOLDS = np.array([0.002, 0.004, 0.008, 0.014, 0.022, 0.035])
"""Strains at which the elements slip, at the limit 1; the readings are about 1 % apart."""
SPAN = (-0.06, 0.18)  # range of strain of the cells
CELLS = {StraightSlip.kind: 1, PreisachSlip.kind: 8}  # cells of the stiffnesses over strain
PRIOR_WEIGHT = 0.3
"""Penalty [mm] on neighbouring elements, or cells, that differ by a factor of 2.7."""
NAMES = ("area", "braid_force", "braid_strain", "stiffness", "hardening", "area_taper")
_START = (8.3e-4, 95.0, 0.0155, 2200.0, 4000.0, 0.5, 0.2e-5, -0.05)
_LOW = (1e-4, 1.0, 0.006, 100.0, -2e4, 0.0, -1e-6, -0.15)
_HIGH = (5e-3, 2e3, 0.2, 2e4, 1e6, 6.0, 3e-5, 0.3)
_SCALE = (6e-4, 100.0, 0.02, 1e3, 1e4, 1.0, 1e-6, 0.05)
_FORCE = 4.0  # slip force of an element [N] from which the fit starts
_BISECTIONS, _STEP = 40, 0.06


@dataclass(frozen=True)
class Columns:
    """Parameter sets side by side: ``law`` (q, 8) and element stiffnesses (q, n, cells) [N]."""

    law: Array
    stiffnesses: Array

    @classmethod
    def of(cls, vectors: Array, cells: int) -> "Columns":
        """Return the sets of vectors of the fit, shape (q, 8 + n cells)."""
        made = np.exp(vectors[:, len(_START) :]).reshape(len(vectors), len(THRESHOLDS), cells)
        return cls(vectors[:, : len(_START)], made)


def slow_contractions(columns: Columns, pressures: Array, loads: Array) -> Array:
    """Return the contractions over rest length along slow changes of pressure.

    Shapes: pressures (T,) [Pa], loads (m,) [kg]; the result is (q, m, T), from rest under the load
    without pressure, where the elements exert no force.
    """
    area, force, strain, k1, k3, taper, per_pressure, per_load = columns.law.T[:, :, None]
    cells = columns.stiffnesses.shape[2]
    cell = (SPAN[1] - SPAN[0]) / cells
    steps = np.cumsum(columns.stiffnesses * cell, axis=2)
    curves = np.concatenate([np.zeros((*steps.shape[:2], 1)), steps], axis=2)
    sets, kinds = np.arange(len(curves))[:, None, None], np.arange(curves.shape[1])

    def excess(p: float, e: Array) -> Array:
        passive = force * (1.0 - np.exp(-e / strain)) + k1 * e + k3 * e**3
        return np.asarray(area * (1.0 - taper * e) * p - passive - loads * GRAVITY)

    def spring(x: Array) -> Array:
        u = (x - SPAN[0]) / cell
        i = np.clip(u.astype(int), 0, cells - 1)
        first = curves[sets, kinds, i]
        return np.asarray(first + (u - i) * (curves[sets, kinds, i + 1] - first))

    def rest(p: float, sliders: Array | None, limit: Array, low: Array, high: Array) -> Array:
        for _ in range(_BISECTIONS):
            e = 0.5 * (low + high)
            friction = 0.0
            if sliders is not None:
                x = np.broadcast_to(e[..., None], sliders.shape)
                held = np.clip(sliders, x - limit, x + limit)
                friction = np.sum(spring(x) - spring(held), axis=2)
            up = excess(p, e) > friction
            low, high = np.where(up, e, low), np.where(up, high, e)
        return np.asarray(0.5 * (low + high))

    shape = (len(curves), len(loads))
    start = rest(0.0, None, np.zeros(1), np.full(shape, -0.3), np.full(shape, 0.6))
    sliders, now = np.repeat(start[..., None], len(THRESHOLDS), axis=2), start
    found = np.empty((*shape, len(pressures)))
    for t, p in enumerate(pressures.tolist()):
        limit = np.maximum(0.0, 1.0 + per_pressure * p + per_load * loads)[..., None] * THRESHOLDS
        now = rest(p, sliders, limit, now - _STEP, now + _STEP)
        sliders = np.clip(sliders, now[..., None] - limit, now[..., None] + limit)
        found[..., t] = now - start
    return found


def fit_length_friction(
    pressures: Array, loads: Array, contractions: Array, widest: NDArray[np.int64], kind: str,
    width_weight: float, shares: Array | None = None,
) -> SingleMuscle:  # fmt: skip
    """Return the muscle with friction driven by length that fits mean cycles.

    Pressures (T,) [Pa], loads (m,) [kg], contractions (m, T) [m]; ``widest`` (m,) are the samples
    after the highest pressure at which the loop of each load is widest. ``kind`` is that of the
    operator, one of ``CELLS``; ``width_weight`` the weight of a loop width over that of a reading;
    ``shares`` (n,) are prior shares of the elements in the slip force, equal by default.
    """
    base, cells = SingleMuscle(), CELLS[kind]
    length, turn, rows = base.muscle.rest_length, int(np.argmax(pressures)), np.arange(len(loads))
    prior = np.log(THRESHOLDS / (1.0 if shares is None else np.maximum(shares, 1e-3)))
    start = np.array([*_START, *np.repeat(np.log(_FORCE / THRESHOLDS), cells)])
    n = len(start)
    low = np.array([*_LOW, *[0.0] * (n - len(_LOW))])
    high = np.array([*_HIGH, *[12.0] * (n - len(_HIGH))])
    scale = np.array([*_SCALE, *[1.0] * (n - len(_SCALE))])

    def widths(x: Array) -> Array:
        return np.asarray(x[..., rows, turn + 1 + widest] - x[..., rows, turn - 1 - widest])

    def residuals(vectors: Array) -> Array:
        columns = Columns.of(vectors, cells)
        made = 1e3 * length * slow_contractions(columns, pressures, loads)
        missed = made - 1e3 * contractions
        logs = vectors[:, len(_START) :].reshape(len(vectors), len(THRESHOLDS), cells)
        parts = (
            missed[:, :, 1:],
            width_weight * widths(missed),
            PRIOR_WEIGHT * np.diff(logs, axis=2),
            PRIOR_WEIGHT * np.diff(logs + prior[:, None], axis=1),
        )
        return np.concatenate([part.reshape(len(vectors), -1) for part in parts], axis=1)

    def jacobian(vector: Array) -> Array:
        steps = np.diag(1e-4 * scale)
        made = residuals(np.concatenate([vector + steps, vector - steps]))
        return np.asarray(((made[:n] - made[n:]) / (2e-4 * scale[:, None])).T)

    def errors(vector: Array) -> Array:
        return residuals(vector[None])[0]  # type: ignore[no-any-return]

    found = least_squares(
        errors,
        start,
        jac=jacobian,  # type: ignore[arg-type]
        bounds=(low, high),
        x_scale=scale,
        max_nfev=60,
    )
    return _plant(base, found.x, kind)


def _plant(base: SingleMuscle, vector: Array, kind: str) -> SingleMuscle:
    made = Columns.of(vector[None], CELLS[kind])
    law = dict(zip(NAMES, map(float, made.law[0]), strict=False))
    stiffnesses = made.stiffnesses[0]
    total = float(stiffnesses.sum(axis=0).max())  # so that no cell has a share above 1
    shares, thresholds = stiffnesses / total, tuple(THRESHOLDS.tolist())
    operator: SlipModel
    if kind == PreisachSlip.kind:
        operator = PreisachSlip(*SPAN, thresholds, tuple(map(tuple, shares.tolist())))
    else:
        operator = StraightSlip(thresholds, tuple(shares[:, 0].tolist()))
    held = Hysteresis(
        operator=operator,
        friction=total,
        limit_per_pressure=float(vector[6]),
        limit_per_load=float(vector[7]),
    )
    muscle = dataclasses.replace(base.muscle, **law)
    return dataclasses.replace(base, muscle=muscle, hysteresis=held)
