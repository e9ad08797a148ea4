"""Rank correlations and their intervals, for few and for many pairs."""

import math

import numpy as np
import pytest
from scipy import stats

from pam_envs.rig.comparison import ranks

LADDER = {3: np.arange(3.0), 8: np.arange(8.0)}


def test_coefficients_are_those_of_scipy_with_and_without_ties() -> None:
    rng = np.random.default_rng(0)
    for x, y in (rng.normal(size=(2, 9)), rng.integers(0, 4, (2, 9))):
        assert ranks.kendall(x, y) == pytest.approx(stats.kendalltau(x, y).statistic)
        assert ranks.spearman(x, y) == pytest.approx(stats.spearmanr(x, y).statistic)


@pytest.mark.parametrize("kind", ["kendall", "spearman"])
def test_few_pairs_in_the_same_order_are_no_evidence(kind: str) -> None:
    few, many = (ranks.correlation(kind, x, x) for x in LADDER.values())
    assert few.value == many.value == few.high == many.high == 1.0
    assert few.low < 0.0 < many.low
    assert few.chance == pytest.approx(1.0 / math.factorial(3), abs=0.02)
    assert many.chance < 0.001


@pytest.mark.parametrize("kind", ["kendall", "spearman"])
def test_reversed_order_has_the_mirrored_interval(kind: str) -> None:
    x = np.array([3.0, 1.0, 2.0, 5.0, 4.0, 6.0])
    same, opposite = (ranks.correlation(kind, x, side * np.arange(6.0)) for side in (1.0, -1.0))
    assert opposite.value == pytest.approx(-same.value)
    assert (opposite.low, opposite.high) == pytest.approx((-same.high, -same.low), abs=0.06)
    assert same.low < same.value < same.high


def test_interval_holds_the_correlation_of_the_population() -> None:
    rng, correlation, held = np.random.default_rng(1), 0.8, 0
    for _ in range(40):
        x, noise = rng.normal(size=(2, 6))
        y = correlation * x + math.sqrt(1.0 - correlation**2) * noise
        found = ranks.correlation("kendall", x, y)
        held += found.low <= 2.0 / math.pi * math.asin(correlation) <= found.high
    assert held >= 35  # of 40 at 95 %: fewer have a probability of 0.3 %


def test_constant_figures_have_no_order() -> None:
    assert math.isnan(ranks.correlation("kendall", np.ones(4), np.arange(4.0)).value)
    assert math.isnan(ranks.correlation("spearman", np.arange(2.0), np.arange(2.0)).value)


def test_failed_prediction_ranks_last() -> None:
    found = ranks.correlation("kendall", [1.0, 2.0, math.inf], [1.0, 2.0, 3.0])
    assert found.value == 1.0
