"""Simulation-error least squares: optimum, bounds, priors, shared Jacobians, intervals."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.intervals import spans
from pam_envs.diagnosis.fit.least_squares import (
    FEW_DAMPINGS,
    WORST,
    Fit,
    Free,
    Problem,
    bounded_step,
    differentiate,
    evaluate,
    improve,
    share,
)

Array = NDArray[np.float64]

TIME = np.arange(3000) * 0.02
PLACES = {"gain": 0, "lag": 1, "slope": 2, "bias": 3}
GAIN = Free("gain", 0, 0.0, 10.0, 0.1, start=1.0)
LAG = Free("lag", 1, 0.01, 100.0, 1.0, log=True, start=3.0)
SLOPE = Free("slope", 2, -1.0, 1.0, 0.1)
BIAS = Free("bias", 3, -1.0, 1.0, 0.1)
TRUTH = np.array([2.0, 0.8, 0.03, 0.0])
NOISE = np.array([0.05, 0.2])


def simulate(columns: Array) -> Array:
    """Return two outputs that decay and drift, shape (2, T, n)."""
    gain, lag, slope, bias = columns.T[:, None, :]
    time = TIME[:, None]
    wave = gain * np.exp(-(time % 10.0) / lag) + slope * time
    return np.stack([wave + bias, 3.0 * wave])


def problem_of(noise: Array, train: NDArray[np.bool_] | None = None) -> Problem:
    measured = simulate(TRUTH[None])[:, :, 0] + noise
    seen = np.ones(len(TIME), bool) if train is None else train
    return Problem(simulate, measured, NOISE, seen, TIME)


def drawn(seed: int, correlation: float = 0.0) -> Array:
    """Return noise of the declared RMS, white or first-order autoregressive."""
    white = np.random.default_rng(seed).standard_normal((2, len(TIME)))
    made = white.copy()
    for k in range(1, len(TIME)):
        made[:, k] = correlation * made[:, k - 1] + np.sqrt(1 - correlation**2) * white[:, k]
    return made * NOISE[:, None]


def fitted(problem: Problem, *frees: Free, rounds: int = 30) -> Fit:
    column = np.array([1.0, 3.0, 0.0, 0.0])
    fit = Fit.at_start(frees, column)
    evaluate(problem, [fit])
    improve(problem, [fit], rounds, 1e-9)
    return fit


def test_noise_free_fit_recovers_parameters():
    fit = fitted(problem_of(np.zeros((2, len(TIME)))), GAIN, LAG, SLOPE)
    found = fit.values()
    assert [found["gain"], found["lag"], found["slope"]] == pytest.approx(TRUTH[:3], rel=1e-4)
    assert fit.cost < 1e-4


def test_fit_stops_at_bound():
    narrow = replace(GAIN, high=1.5, start=1.0)
    fit = fitted(problem_of(drawn(1)), narrow, LAG, SLOPE)
    assert fit.values()["gain"] == 1.5
    free = fitted(problem_of(drawn(1)), GAIN, LAG, SLOPE)
    assert fit.cost > free.cost


def test_prior_determines_unidentified_parameter():
    train = np.zeros(len(TIME), bool)
    train[:40] = True  # the drift has not begun
    prior = replace(SLOPE, start=0.1, prior=1e-4)
    fit = fitted(problem_of(drawn(2), train), GAIN, LAG, prior)
    assert fit.values()["slope"] == pytest.approx(0.1, abs=1e-3)
    free = fitted(problem_of(drawn(2), train), GAIN, LAG, replace(prior, prior=np.inf))
    assert abs(free.values()["slope"] - 0.1) > 5e-3


def test_held_out_samples_do_not_change_fit():
    train = TIME < 40.0
    noise = drawn(3)
    one = fitted(problem_of(noise, train), GAIN, LAG, SLOPE)
    noise[:, ~train] += 5.0
    other = fitted(problem_of(noise, train), GAIN, LAG, SLOPE)
    assert one.values() == other.values()
    assert one.cost == other.cost
    assert np.abs(one.residual - other.residual).max() > 10.0


def test_missing_readings_are_ignored():
    problem = problem_of(drawn(4))
    measured = problem.measured.copy()
    measured[0, 500:900] = np.nan
    fit = fitted(replace(problem, measured=measured), GAIN, LAG, SLOPE)
    assert (problem.rows(fit.residual)[0, 500:900] == 0.0).all()
    assert fit.values()["gain"] == pytest.approx(2.0, abs=0.02)


def test_diverged_simulation_is_never_selected():
    def breaks(columns: Array) -> Array:
        outputs = simulate(columns)
        outputs[:, :, columns[:, 0] > 1.5] = np.nan
        return outputs

    fit = fitted(replace(problem_of(drawn(5)), simulate=breaks), GAIN, LAG, SLOPE)
    assert 1.0 < fit.values()["gain"] <= 1.5
    assert np.abs(fit.residual).max() < WORST


def test_shared_jacobian_reaches_the_same_optimum():
    problem = problem_of(drawn(6) + np.array([[0.4], [0.0]]))
    base = fitted(problem, GAIN, LAG, SLOPE)
    differentiate(problem, [base])
    shared = share(problem, base)
    z = np.append(base.z, 0.0)
    both = [
        Fit((GAIN, LAG, SLOPE, BIAS), z.copy(), base.column, shared=with_it)
        for with_it in (shared, None)
    ]
    evaluate(problem, both)
    improve(problem, both, 30, 1e-9)
    assert both[0].values()["bias"] == pytest.approx(0.4, abs=0.01)
    assert both[0].cost == pytest.approx(both[1].cost, rel=1e-6)


def test_cause_takes_its_size_where_the_shared_slopes_mislead_the_base():
    problem = problem_of(drawn(8) + np.array([[0.02], [0.0]]))
    base = fitted(problem, GAIN, LAG, SLOPE)
    differentiate(problem, [base])
    shared = share(problem, base)
    start = np.append(base.z, BIAS.inner(1.0))
    start[0] -= 0.5 / GAIN.scale
    misled = replace(shared, slopes=-shared.slopes)
    fit = Fit((GAIN, LAG, SLOPE, BIAS), start.copy(), base.column, shared=misled)
    evaluate(problem, [fit])
    improve(problem, [fit], 1, 1e-4, FEW_DAMPINGS)
    assert (fit.z[:3] == start[:3]).all()
    assert fit.values()["bias"] == pytest.approx(0.05, abs=0.01)  # with a part of the gain


@pytest.mark.parametrize("seed", range(20))
def test_bounded_step_equals_bounded_least_squares(seed):
    rng = np.random.default_rng(seed)
    slopes, target = rng.standard_normal((40, 6)), rng.standard_normal(40)
    low, high = -0.1 * rng.random(6), 0.1 * rng.random(6)
    step = bounded_step(slopes.T @ slopes, -slopes.T @ target, 0.0, low, high)
    best = lsq_linear(slopes, target, (low, high), tol=1e-12)
    assert (step >= low - 1e-12).all()
    assert (step <= high + 1e-12).all()
    cost = float(np.sum((slopes @ step - target) ** 2))
    assert cost <= 2.0 * best.cost * 1.02  # an active set that never lets go: near, not exact
    assert cost < float(np.sum(target**2))


@pytest.mark.parametrize("correlation", [0.0, 0.9])
def test_confidence_intervals_have_nominal_coverage(correlation):
    hits = np.zeros(3)
    draws = 60
    for seed in range(draws):
        problem = problem_of(drawn(100 + seed, correlation))
        blocks = Blocks.make(TIME, problem.measured)
        problem = replace(problem, train=blocks.train)
        fit = fitted(problem, GAIN, LAG, SLOPE)
        differentiate(problem, [fit])
        for k, (name, true) in enumerate(zip(("gain", "lag", "slope"), TRUTH, strict=False)):
            low, high = spans(problem, blocks, fit)[name]["interval"]
            hits[k] += low <= true <= high
    assert (hits / draws >= 0.83).all()  # nominally 95 %; 60 draws give 83 % once in 10,000
    width = np.diff(spans(problem, blocks, fit)["gain"]["interval"])[0]
    assert 0.001 < width < 0.2


def test_hardly_determined_parameter_does_not_shorten_boxed_steps_of_others():
    time = TIME[:, None]

    def hardly(columns: Array) -> Array:
        gain, faint = columns.T[:, None, :]
        wave = gain * np.sin(time) + 1e-7 * faint * np.cos(7.0 * time)
        return np.stack([wave, 3.0 * wave])

    measured = hardly(np.array([[2.0, 1e6]]))[:, :, 0]
    problem = Problem(hardly, measured, NOISE, np.ones(len(TIME), bool), TIME)
    faint = Free("faint", 1, -1e9, 1e9, 0.1)
    one, boxed = (Fit.at_start((GAIN, faint), np.array([1.0, 0.0])) for _ in range(2))
    evaluate(problem, [one, boxed])
    improve(problem, [one], 1, 1e-9)
    improve(problem, [boxed], 1, 1e-9, boxed=True)
    assert abs(one.values()["gain"] - 1.0) < 0.01
    assert abs(boxed.values()["gain"] - 2.0) < 0.01
    assert boxed.cost < one.cost


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e30])
def test_no_shape_explains_a_diverged_simulation(value):
    measured = np.zeros((1, len(TIME)))
    shapes = np.ones((1, len(TIME)))

    def simulate(columns: Array) -> Array:
        return np.full((1, len(TIME), len(columns)), value)

    train = np.ones(len(TIME), bool)
    problem = Problem(simulate, measured, NOISE[:1], train, TIME, shapes=shapes)
    assert (problem.residuals(np.zeros((2, 1))) == WORST).all()
