"""Identification of hysteresis models from their own records, and its rank."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pam_envs.hysteresis.everett import symmetry_error
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.hysteresis.preisach import Preisach
from pam_envs.identification.preisach_forc import (
    congruency_error,
    curve_inputs,
    descending_curves,
    fit_preisach,
    preisach_from_curves,
    relay_regressors,
)

Array = NDArray[np.float64]

few = settings(max_examples=40, deadline=None)


# --- first-order curves ---------------------------------------------------------------------------

LEVELS = 9


def random_operator(seed: int, output: float = 0.0, virgin: bool = False) -> Preisach:
    """Return a Preisach operator, of symmetric weights if it starts virgin."""
    rng = np.random.default_rng(seed)
    weights = np.tril(rng.uniform(0.1, 1.0, (LEVELS - 1, LEVELS - 1)))
    if virgin:
        return Preisach.from_weights(weights + weights[::-1, ::-1].T, -1.0, 1.0, start="virgin")
    return Preisach.from_weights(weights, -1.0, 1.0, start_output=output)


@few
@given(st.integers(0, 10**6), st.integers(1, 4), st.floats(-1.0, 1.0))
def test_map_is_recovered_from_first_order_curves(seed, points, output):
    truth = random_operator(seed, output=output)
    x = curve_inputs(-1.0, 1.0, LEVELS, points)
    curves = descending_curves(x, truth.simulate(x)[0])
    assert len(curves) == LEVELS - 1
    fit = preisach_from_curves(curves[::-1], -1.0, 1.0, LEVELS, start_output=output)
    np.testing.assert_allclose(fit.model.everett, truth.everett, atol=1e-11)
    assert fit.clipped < 1e-10


def test_noisy_curves_are_clipped_to_weights_that_are_not_negative():
    truth = Preisach.resembling(PlayOperator((0.25,), (1.0,), 0.2), -1.0, 1.0, LEVELS)
    x = curve_inputs(-1.0, 1.0, LEVELS, 2)
    sigma = 1e-3
    y = truth.simulate(x)[0] + sigma * np.random.default_rng(0).standard_normal(len(x))
    fit = preisach_from_curves(descending_curves(x, y), -1.0, 1.0, LEVELS)
    assert 1e-3 < fit.clipped < 0.05
    assert np.min(fit.model.weights) >= -1e-12
    # clipping half of the noise of 28 cells leaves a bias of their size
    assert np.max(np.abs(fit.model.everett - truth.everett)) < 28 * sigma


# --- any record -----------------------------------------------------------------------------------


@few
@given(st.integers(0, 10**6), st.booleans())
def test_regressors_times_weights_are_the_output(seed, virgin):
    operator = random_operator(seed, virgin=virgin)
    x = np.random.default_rng(seed).uniform(-1.1, 1.1, 30)
    parts = relay_regressors(x, -1.0, 1.0, LEVELS, start=operator.start)
    y, _ = operator.simulate(x)
    np.testing.assert_allclose(np.einsum("tkl,kl->t", parts, operator.weights), y, atol=1e-11)


@pytest.mark.parametrize("start", ["low", "virgin"])
def test_fit_recovers_an_identifiable_model(start):
    truth = random_operator(1, output=0.3, virgin=start == "virgin")
    x = np.random.default_rng(2).uniform(-1.0, 1.0, 1500)
    y, _ = truth.simulate(x)
    fit = fit_preisach(x, y, -1.0, 1.0, LEVELS, start=start, prior_weight=1e-6)
    assert fit.rank == fit.unknowns
    assert np.min(fit.decided[np.tril_indices(LEVELS - 1)]) > 0.999
    np.testing.assert_allclose(fit.model.weights, truth.weights, atol=1e-6)
    assert fit.offset == pytest.approx(truth.start_output, abs=1e-6)
    other = np.random.default_rng(3).uniform(-1.0, 1.0, 50)
    assert np.max(np.abs(fit.model.simulate(other)[0] - truth.simulate(other)[0])) < 1e-5


def test_noise_on_a_random_record_averages_out():
    truth, sigma = random_operator(1), 0.2
    x = np.random.default_rng(2).uniform(-1.0, 1.0, 1500)
    clean = truth.simulate(x)[0]
    y = clean + sigma * np.random.default_rng(4).standard_normal(len(x))
    fit = fit_preisach(x, y, -1.0, 1.0, LEVELS)
    assert np.min(fit.model.weights) >= 0.0
    assert fit.rms == pytest.approx(sigma, rel=0.1)
    fitted = fit.model.simulate(x)[0]
    # 37 unknowns and 1500 samples: sigma sqrt(37 / 1500) is 0.16 sigma
    assert np.sqrt(np.mean((fitted - clean) ** 2)) < 0.25 * sigma


def test_single_loop_leaves_the_remaining_weights_at_the_prior():
    play = PlayOperator((0.25, 0.5), (0.5, 0.3), 0.4)
    truth = Preisach.resembling(play, -1.0, 1.0, LEVELS)
    grid = np.linspace(-1.0, 1.0, 65)
    x = np.concatenate([grid, grid[-2::-1]])
    fit = fit_preisach(x, truth.simulate(x)[0], -1.0, 1.0, LEVELS)
    assert fit.rank < fit.unknowns / 2
    assert np.min(fit.decided[np.tril_indices(LEVELS - 1)]) < 0.5
    # the truth depends on the gap alone, which is the prior: minor loops are predicted
    other = np.random.default_rng(3).uniform(-1.0, 1.0, 200)
    gap = fit.model.simulate(other)[0] - truth.simulate(other)[0]
    assert np.max(np.abs(gap)) < 1e-3
    # and where it depends on the place too, one loop does not say so
    placed = random_operator(5)
    guess = fit_preisach(x, placed.simulate(x)[0], -1.0, 1.0, LEVELS)
    assert guess.rms < 0.05
    gap = guess.model.simulate(other)[0] - placed.simulate(other)[0]
    assert np.max(np.abs(gap)) > 0.2


# --- checks ---------------------------------------------------------------------------------------


def minor_loops(output) -> list[tuple[Array, Array]]:
    """Record the loop between -0.3 and 0.3 in three histories."""
    loop = np.concatenate([np.linspace(-0.3, 0.3, 13), np.linspace(0.3, -0.3, 13)[1:]])
    records = []
    for before in ([1.0], [1.0, -1.0], [0.8, -0.7, 0.6]):
        x = np.array([*before, -0.3, 0.3, *loop])
        records.append((loop, output(x)[-len(loop) :]))
    return records


def test_congruency_error_has_the_expected_size():
    operator = random_operator(7)
    assert congruency_error(minor_loops(lambda x: operator.simulate(x)[0])) < 1e-12
    # a nonlinear output map keeps the hysteresis but not the congruency
    curved = congruency_error(minor_loops(lambda x: operator.simulate(x)[0] ** 2))
    assert curved > 0.1


def test_congruency_error_allows_for_other_samples():
    operator = Preisach.resembling(PlayOperator((0.1,), (1.0,), 0.5), -1.0, 1.0, 21)
    coarse = np.array([-0.3, -0.1, 0.3, 0.1, -0.3])
    fine = np.interp(np.linspace(0, 4, 241), np.arange(5), coarse)
    records = []
    for x in (coarse, fine):
        y = operator.simulate(np.array([1.0, -0.3, 0.3, *x]))[0]
        records.append((x, y[-len(x) :]))
    assert congruency_error(records) < 0.01


def test_symmetry_error_responds_to_noise_and_bias():
    even = Preisach.from_density(lambda a, b: 1.0 + (a + b) ** 2, -1.0, 1.0, LEVELS)
    x = curve_inputs(-1.0, 1.0, LEVELS, 2)
    y = even.simulate(x)[0]
    fit = preisach_from_curves(descending_curves(x, y), -1.0, 1.0, LEVELS)
    assert symmetry_error(fit.model.table) < 1e-12
    bent = preisach_from_curves(descending_curves(x, y + 0.1 * y**2), -1.0, 1.0, LEVELS)
    assert symmetry_error(bent.model.table) > 0.01


UP = [0.0, 1.0]


def curves(x, levels):
    return preisach_from_curves([(x, [1.0, 0.0])], -1.0, 1.0, levels)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fit_preisach(UP, [0.0], -1.0, 1.0), r"shape \(2,\) and y \(1,\)"),
        (lambda: congruency_error([(UP, [np.nan, 1.0])]), r"y\[0\] is nan.*finite"),
        (lambda: curves([1.0, -1.0], 3), r"no curve turns at 0.0.*fit_preisach"),
        (lambda: curves(UP[::-1], 2), r"ends at 0.0.*reach -1.0"),
        (lambda: fit_preisach(UP, UP, -1.0, 1.0, prior_weight=0.0), r"prior_weight is 0.*above 0"),
        (lambda: congruency_error([(UP, UP)]), r"1 loops.*at least 2"),
        (lambda: congruency_error([(UP, UP), ([0.0, 2.0], UP)]), r"loop 1 is between 0.0 and 2.0"),
    ],
)
def test_errors_name_value_bound_and_remedy(make, message):
    with pytest.raises(ValueError, match=message):
        make()
