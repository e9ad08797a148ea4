"""Regression of the force balance: starting values of static law, map, friction and strands.

In slow motion the load equals the force law, which is linear in its coefficients for given play
outputs. Errors of force are weighed by the compliance, so that the regression minimises errors of
contraction. The result only starts a fit, since the regressors contain noise.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.polynomial.chebyshev import chebval
from scipy.ndimage import uniform_filter1d
from scipy.optimize import lsq_linear

from pam_envs.arrays import Array, Indices
from pam_envs.constants import GRAVITY
from pam_envs.diagnosis.fit.single_muscle import MuscleFamily
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.muscle.effective_area import MAP_SIZES
from pam_envs.muscle.effects import BREAKS, MAP_TERMS

SLOW = 0.008  # speed [m/s] below which a sample is an equilibrium of forces
FEWEST, MOST = 200, 4000  # least and largest number of samples
ROUNDS = 3
LEAST_STIFF = 100.0  # least stiffness over strain [N] of a weight
BREAK_AWAYS, GROWTHS = (0.01, 0.03, 0.09), (0.0, 4e-6, 1.5e-5)
"""Tried strains at which the last strand breaks away, and growths with pressure [1/Pa]."""
STRAND_GAIN = 0.03
"""Relative decrease of the squared error that strands need."""
MAP_PRIOR = 20.0
"""Standard deviation of a term of the map [N]."""
LAW = (
    "muscle.area",
    "muscle.area_taper",
    "muscle.area_curve",
    "muscle.braid_force",
    "muscle.stiffness",
    "muscle.softening",
    "muscle.hardening",
    "muscle.stiffening",
)


@dataclass(frozen=True)
class Balance:
    """Slow samples of a recording."""

    family: MuscleFamily
    rows: Indices  # (n,)
    strain: Array  # (n,)
    pressure: Array  # (n,) [Pa]
    force: Array  # (n,): weight of the load [N]
    gaps: Array  # (plays, n): pressure less play output [Pa]
    path: Array  # (T,): strain, smoothed
    drive: Array  # (T,): pressure [Pa]
    noise: float  # of the contraction [m]

    @classmethod
    def of(
        cls, family: MuscleFamily, contraction: Array, pressure: Array, noise: float
    ) -> "Balance | None":
        """Return the slow samples; None if they are too few.

        ``contraction`` (T,) are readings [m], NaN where there is none, ``pressure`` (T,) is
        simulated [Pa].
        """
        plant, load, period = family.plant, family.inputs.load, family.inputs.period
        usable = np.isfinite(contraction)
        below = plant._absolute(np.zeros(1), load[:1])[0] if load[0] > 0 else 0.0
        contraction = contraction + float(below)  # relative to the unloaded rest length
        window = max(3, round(0.1 / period))
        known = np.interp(np.arange(len(load)), np.flatnonzero(usable), contraction[usable])
        smooth = uniform_filter1d(known, window)
        pace = np.abs(np.gradient(smooth, period))
        rows = np.flatnonzero(usable & (uniform_filter1d(pace, window) < SLOW))
        if len(rows) < FEWEST:
            return None
        rows = rows[:: max(1, len(rows) // MOST)]
        thresholds: tuple[float, ...] = plant.hysteresis.model.thresholds  # type: ignore[attr-defined]
        plays = [PlayOperator((size,), (1.0,), 0.0).simulate(pressure)[0] for size in thresholds]
        gaps = (pressure - np.reshape(plays, (len(thresholds), len(pressure))))[:, rows]
        path = smooth / plant.muscle.rest_length
        force = load[rows] * GRAVITY
        return cls(family, rows, path[rows], pressure[rows], force, gaps, path, pressure, noise)

    def solve(self) -> dict[str, float]:
        """Return coefficients of the static law and play weights."""
        return self._solved(False, None)[0]

    def flexible(self) -> dict[str, float]:
        """Return coefficients with the map, and with strands if they reduce the error."""
        best, least = self._solved(True, None)
        least *= 1.0 - STRAND_GAIN
        for away, growth in product(BREAK_AWAYS, GROWTHS):
            found, error = self._solved(True, self.slips(away, growth))
            if error < least:
                best, least = found, error
                best |= {"muscle.strand_break": away, "muscle.strand_per_pressure": growth}
        return best

    def slips(self, away: float, growth: float) -> Array:
        """Return the strands' forces over their slip forces without pressure, (strands, n)."""
        spans = np.outer(BREAKS, away * (1.0 + growth * self.drive))
        slip = np.full(len(BREAKS), self.path[0])
        made: Array = np.empty((len(self.path), len(BREAKS)))
        for k, (strain, span) in enumerate(zip(self.path, spans.T, strict=True)):
            gap = np.minimum(np.maximum(strain - slip, -span), span)
            slip = strain - gap
            made[k, :] = gap
        return np.asarray(made[self.rows].T / (np.array(BREAKS)[:, None] * away))

    def _solved(self, maps: bool, strands: Array | None) -> tuple[dict[str, float], float]:
        """Return the coefficients, and the squared error of the contraction over the noise."""
        law, e, p = self.family.plant.muscle, self.strain, self.pressure
        bend = -np.expm1(-e / law.braid_strain)
        passive = [-bend, -e, -(e**2), -(e**3), -(e**4)]
        more = list(self._terms()) if maps else []
        rubs = [] if strands is None else list(-strands)
        n, plays = len(LAW), len(self.gaps)
        low = np.full(n + plays + len(more) + len(rubs), -np.inf)
        low[[0, 3]] = 0.0
        low[n : n + plays] = 0.0
        low[n + plays + len(more) :] = 0.0
        taper, stiff = np.zeros(len(e)), np.full(len(e), 20.0 * LEAST_STIFF)
        spread = np.full(len(low), np.inf)
        spread[n + plays : n + plays + len(more)] = MAP_PRIOR
        c, error = np.zeros(len(low)), np.inf
        for _ in range(ROUNDS):
            columns = np.array(
                [p, -e * p, -(e**2) * p, *passive, *(-self.gaps * (1.0 - taper)), *more, *rubs]
            ).T
            weight = law.rest_length / (stiff * self.noise)
            matrix = np.vstack([columns * weight[:, None], np.diag(1.0 / spread)])
            target = np.append(self.force * weight, np.zeros(len(low)))
            scale = np.linalg.norm(matrix, axis=0) + 1e-12
            whole = np.column_stack([matrix / scale, target])
            upper = np.asarray(np.linalg.qr(whole, mode="r"))
            solved = lsq_linear(
                upper[:, :-1], upper[:, -1], (low, np.full(len(low), np.inf)), method="bvls"
            )
            c, error = solved.x / scale, 2.0 * float(solved.cost)
            area = max(c[0], 1e-6)
            taper = np.clip((c[1] * e + c[2] * e**2) / area, -1.0, 0.95)
            slope = (c[1] + 2.0 * c[2] * e) * p + c[3] / law.braid_strain * (1.0 - bend)
            slope += c[4] + 2.0 * c[5] * e + 3.0 * c[6] * e**2 + 4.0 * c[7] * e**3
            stiff = np.maximum(slope, LEAST_STIFF)
        return self._named(c, maps, strands is not None), error

    def _named(self, c: Array, maps: bool, strands: bool) -> dict[str, float]:
        """Return coefficients by parameter."""
        area, n, plays = max(c[0], 1e-6), len(LAW), len(self.gaps)
        found = dict(zip(LAW, map(float, c), strict=False))
        found |= {
            "muscle.area": area,
            "muscle.area_taper": float(c[1]) / area,
            "muscle.area_curve": float(c[2]) / area,
            "muscle.braid_force": max(float(c[3]), 1e-3),
        }
        found |= {f"hysteresis.weight[{k}]": float(c[n + k]) / area for k in range(plays)}
        at = n + plays
        if maps:
            sizes = zip(MAP_SIZES, c[at : at + len(MAP_SIZES)], strict=True)
            found |= {f"muscle.{name}": float(size) for name, size in sizes}
            at += len(MAP_SIZES)
        if strands:
            found |= {f"muscle.strand_{k + 1}": float(v) for k, v in enumerate(c[at:])}
        return found

    def _terms(self) -> Array:
        """Return the terms of the map, (terms, n)."""
        law, eye = self.family.plant.muscle, np.eye(6)
        u = np.clip(2.0 * self.pressure / law.map_pressure - 1.0, -1.0, 1.0)
        s = np.clip(2.0 * self.strain / law.map_strain - 1.0, -1.0, 1.0)
        return np.array([chebval(u, eye[i]) * chebval(s, eye[j]) for i, j in MAP_TERMS])
