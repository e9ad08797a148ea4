"""Rank correlation of predicted and measured figures, with an interval that holds for few pairs.

The interval inverts a test of a Gaussian copula with correlation r, of which Kendall's tau is
2/pi asin(r) and Spearman's rho 6/pi asin(r/2) (kruskal1958). A value of r is in the interval if
the observed coefficient is in neither tail of its sampling distribution, which is simulated. So
three pairs in the same order give no interval of width zero, as a bootstrap would.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from pam_envs.arrays import Array

FEWEST = 3
"""Smallest number of pairs."""
LEVEL = 0.95
DRAWS, SEED = 4000, 19_580_401
GRID = np.sin(np.linspace(-0.5 * np.pi, 0.5 * np.pi, 101))
"""Correlations of the copula, uniform in Kendall's tau."""


@dataclass(frozen=True)
class Rank:
    """A rank correlation.

    Attributes
    ----------
    value, low, high : float
        Coefficient [1] and its interval; NaN if one of the sides is constant.
    chance : float
        Probability [1] that a random order agrees at least as well.
    """

    value: float
    low: float
    high: float
    chance: float


def kendall(x: ArrayLike, y: ArrayLike) -> Array:
    """Return Kendall's tau-b over the last axis, shape (..., n) to (...)."""
    a, b = np.asarray(x, float), np.asarray(y, float)
    i, j = np.triu_indices(a.shape[-1], 1)
    signs = [(v[..., i] > v[..., j]).astype(float) - (v[..., i] < v[..., j]) for v in (a, b)]
    untied = [np.abs(sign).sum(axis=-1) for sign in signs]
    with np.errstate(invalid="ignore"):
        return np.asarray((signs[0] * signs[1]).sum(axis=-1) / np.sqrt(untied[0] * untied[1]))


def spearman(x: ArrayLike, y: ArrayLike) -> Array:
    """Return Spearman's rho over the last axis, shape (..., n) to (...)."""
    ranks = [stats.rankdata(np.asarray(v, float), axis=-1) for v in (x, y)]
    a, b = (rank - rank.mean(axis=-1, keepdims=True) for rank in ranks)
    with np.errstate(invalid="ignore"):
        return np.asarray((a * b).sum(-1) / np.sqrt((a * a).sum(-1) * (b * b).sum(-1)))


def _tau(correlation: Array) -> Array:
    return np.asarray(2.0 / np.pi * np.arcsin(correlation))


def _rho(correlation: Array) -> Array:
    return np.asarray(6.0 / np.pi * np.arcsin(0.5 * correlation))


_COEFFICIENTS: dict[str, tuple[Callable[..., Array], Callable[[Array], Array]]] = {
    "kendall": (kendall, _tau),
    "spearman": (spearman, _rho),
}


@lru_cache(maxsize=16)
def _sampled(kind: str, n: int) -> Array:
    """Return the coefficient of samples of ``n`` pairs at each correlation, (grid, draws)."""
    statistic = _COEFFICIENTS[kind][0]
    x, noise = np.random.default_rng(SEED).standard_normal((2, DRAWS, n))
    return np.array([statistic(x, r * x + np.sqrt(1.0 - r * r) * noise) for r in GRID])


def correlation(kind: str, predicted: ArrayLike, measured: ArrayLike) -> Rank:
    """Return a rank correlation, "kendall" or "spearman", of at least ``FEWEST`` pairs."""
    statistic, population = _COEFFICIENTS[kind]
    value, n = float(statistic(predicted, measured)), np.size(predicted)
    if n < FEWEST or not np.isfinite(value):
        return Rank(*[float("nan")] * 4)
    drawn, tail, slack = _sampled(kind, n), 0.5 * (1.0 - LEVEL), 1e-9
    above, below = (drawn >= value - slack).mean(1), (drawn <= value + slack).mean(1)
    inside = population(GRID[(above > tail) & (below > tail)])
    chance = float(above[len(GRID) // 2])
    return Rank(value, float(inside.min()), float(inside.max()), chance)
