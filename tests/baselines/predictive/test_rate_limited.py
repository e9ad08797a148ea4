"""Best rate-limited path against a general solver, and the anticipation that follows from it."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from baselines.predictive.rate_limited import best_path


def test_path_is_the_solution_of_the_bounded_least_squares_problem():
    draws = np.random.default_rng(0)
    reach = np.array([1.0] * 6 + [3.0] * 5)
    n, nodes = 12, len(reach)
    path = np.cumsum(draws.normal(size=(n, nodes)), axis=1) * 4.0
    weight, start = draws.uniform(0.02, 1.0, (n, nodes)), 5.0 * draws.normal(size=n)
    found = best_path(start, path, weight, reach)
    for row in range(n):
        scale = np.sqrt(weight[row])
        rival = lsq_linear(
            scale[:, None] * np.tri(nodes), scale * (path[row] - start[row]), (-reach, reach),
            tol=1e-13, max_iter=500,
        )  # fmt: skip
        off = found[row] - (start[row] + np.cumsum(rival.x))
        assert np.abs(off).max() < 1e-3
    steps = np.abs(np.diff(np.column_stack([start, found]), axis=1))
    assert np.all(steps <= reach + 1e-12)


def test_reachable_path_is_followed_exactly():
    path = np.sin(0.1 * np.arange(1, 31))[None]
    found = best_path([0.0], path, np.ones_like(path), np.full(30, 0.11))
    np.testing.assert_allclose(found, path, atol=1e-12)


def test_step_is_crossed_in_its_middle():
    path = np.where(np.arange(1, 41) < 20, 0.0, 10.0)[None]
    found = best_path([0.0], path, np.ones_like(path), np.ones(40))[0]
    assert found[19] == pytest.approx(5.5) and found[13] == 0.0 and found[25] == 10.0


def test_period_without_weight_is_used_to_get_ready():
    path = np.where(np.arange(1, 41) < 20, 0.0, 10.0)[None]
    weight = np.where(np.arange(1, 41) < 20, 1e-6, 1.0)[None]
    found = best_path([0.0], path, weight, np.ones(40))[0]
    np.testing.assert_allclose(found[19:], 10.0, atol=0.1)
