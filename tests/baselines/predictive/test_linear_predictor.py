"""Linear predictive control: the linear-quadratic regulator without limits, optimal with them."""

import numpy as np
import pytest
from scipy.optimize import minimize

from baselines.predictive.linear import linear_predictor

A = np.array([[0.8, 0.1, 0.0], [0.0, 0.7, 0.2], [0.0, 0.0, 0.5]])
B, C, WEIGHT = np.array([0.0, 0.1, 0.6]), np.array([1.0, 0.2, 0.0]), 0.3


def regulator() -> np.ndarray:
    """Return the gain on state and last input of the infinite horizon, by python-control."""
    control = pytest.importorskip("control")
    whole = np.block([[A, B[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]])
    change = np.append(B, 1.0)[:, None]
    output = np.append(C, 0.0)[None]
    q = (output @ whole).T @ (output @ whole)
    r = WEIGHT + (output @ change).T @ (output @ change)
    return control.dlqr(whole, change, q, r, (output @ whole).T @ (output @ change))[0][0]


@pytest.mark.parametrize("horizon", [1, 4, 15])
def test_first_input_is_that_of_the_linear_quadratic_regulator(horizon):
    draws = np.random.default_rng(1)
    state, last, goal = draws.normal(size=(5, 3)), draws.normal(size=5), draws.normal(size=5)
    found = linear_predictor(A, B, C, WEIGHT, horizon).inputs(
        state, last, np.repeat(goal[:, None], horizon, axis=1), -1e9, 1e9
    )
    rest = np.linalg.solve(np.eye(3) - A, B)
    rest = np.append(rest, 1.0) / (C @ rest)
    whole = np.column_stack([state, last]) - goal[:, None] * rest
    np.testing.assert_allclose(found[:, 0], last - whole @ regulator(), rtol=1e-9, atol=1e-11)


def test_limited_inputs_minimise_the_cost():
    predictor, draws = linear_predictor(A, B, C, WEIGHT, 8), np.random.default_rng(2)
    state, last, goals = draws.normal(size=(1, 3)), np.zeros(1), 3.0 * draws.normal(size=(1, 8))
    found = predictor.inputs(state, last, goals, -0.4, 0.5)[0]
    assert np.any(found == -0.4) or np.any(found == 0.5)
    force = predictor.by_state @ state[0] - predictor.by_reference @ goals[0]

    def cost(u: np.ndarray) -> float:
        return float(0.5 * u @ predictor.curve @ u + u @ force)

    rival = minimize(cost, np.zeros(8), bounds=[(-0.4, 0.5)] * 8, tol=1e-12)
    assert cost(found) <= rival.fun + 1e-5 * abs(rival.fun)
