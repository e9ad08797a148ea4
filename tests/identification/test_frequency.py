"""Transfer functions from frequency responses: known ones are recovered, fits are stable."""

import numpy as np
import pytest

from pam_envs.identification.frequency import fit_rational

W = 2.0 * np.pi * np.geomspace(0.1, 2.0, 40)
ZEROS = np.array([-9.3, -8.1, -4.2, -3.2])
POLES = np.array([-12.3, -10.5, -7.5, -7.1, -6.7, -4.06 + 0.82j, -4.06 - 0.82j])


def response(w: np.ndarray, zeros: np.ndarray, poles: np.ndarray, gain: float = 0.74) -> np.ndarray:
    s = 1j * np.asarray(w)[..., None]
    scale = gain * np.prod(-poles).real / np.prod(-zeros).real
    return scale * np.prod(s - zeros, axis=-1) / np.prod(s - poles, axis=-1)


def test_known_transfer_function_is_recovered():
    fit = fit_rational(W, response(W, ZEROS, POLES), 7, relative_degree=3)
    assert fit.relative_error < 1e-9
    assert fit.static_gain == pytest.approx(0.74, rel=1e-8)
    np.testing.assert_allclose(np.sort(fit.poles.real), np.sort(POLES.real), atol=1e-3)
    beyond = np.array([0.01, 40.0])
    np.testing.assert_allclose(fit.response(beyond), response(beyond, ZEROS, POLES), rtol=1e-5)


@pytest.mark.parametrize("order", [2, 3, 4, 5])
def test_lower_orders_have_the_given_relative_degree(order):
    fit = fit_rational(W, response(W, ZEROS, POLES), order, relative_degree=2)
    fast = 1e6 * np.array([1.0, 10.0])
    drop = np.abs(fit.response(fast))
    assert drop[0] / drop[1] == pytest.approx(100.0, rel=0.05)


def test_state_space_and_polynomials_are_the_same_system():
    fit = fit_rational(W, response(W, ZEROS, POLES), 4, relative_degree=3)
    a, b, c = fit.state_space()
    top, low = fit.polynomials()
    s = 1j * W
    rational = np.polyval(top, s) / np.polyval(low, s)
    modal = [c @ np.linalg.solve(x * np.eye(4) - a, b) for x in s]
    np.testing.assert_allclose(rational, fit.response(W), rtol=1e-9)
    np.testing.assert_allclose(modal, fit.response(W), rtol=1e-9)


def test_noisy_response_gives_a_stable_fit_no_worse_than_the_noise():
    rng = np.random.default_rng(1)
    noise = 1.0 + 0.02 * (rng.normal(size=W.size) + 1j * rng.normal(size=W.size))
    clean = response(W, ZEROS, POLES)
    fit = fit_rational(W, clean * noise, 3, relative_degree=3)
    assert np.all(fit.poles.real < 0.0)
    assert fit.relative_error < 0.035
    assert np.max(np.abs(fit.response(W) / clean - 1.0)) < 0.05


def test_an_unstable_response_is_fitted_by_a_stable_system():
    unstable = np.array([0.5 + 3.0j, 0.5 - 3.0j])
    fit = fit_rational(W, response(W, np.array([-50.0]), unstable), 2)
    assert np.all(fit.poles.real < 0.0)
    assert fit.relative_error > 0.1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((W, np.ones(3), 2), "two series of one length"),
        ((W[:3], np.ones(3), 5), "order is 5 with 3 frequencies"),
        ((np.array([0.0, 1.0]), np.ones(2), 1), "not above 0"),
        ((W, np.ones(W.size), 2, 3), "relative_degree is 3"),
    ],
)
def test_bad_input_is_refused_by_name(arguments, message):
    with pytest.raises(ValueError, match=message):
        fit_rational(*arguments)
