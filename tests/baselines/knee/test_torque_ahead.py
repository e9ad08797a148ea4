"""Prediction of the torque reference: against dense algebra, and of filtered noise."""

from itertools import product

import numpy as np

from baselines.knee import anticipation
from baselines.knee.torque_ahead import NOISE, PAST, ROUGHNESS, SLOW, TorqueAhead
from pam_envs.sensing.butterworth import filtered
from tests.baselines.conftest import built, make_env, rms, rollout
from tests.baselines.knee.test_anticipation import tracked

AHEAD = 6
PREDICTOR = TorqueAhead(40)


def windows(signal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return windows of a signal, the newest sample first, and the sample ``AHEAD`` later."""
    ends = np.arange(100, len(signal) - AHEAD)
    return signal[ends[:, None] - np.arange(PAST)], signal[ends + AHEAD]


def predicted(past: np.ndarray) -> np.ndarray:
    return PREDICTOR.predict(past, np.full((len(past), 1), float(AHEAD)))[:, 0]


def test_prediction_is_the_expectation_under_the_bank_of_models():
    times = np.array([[0.0, 0.3, 5.5, 39.0]])
    past = np.random.default_rng(0).normal(0.0, 0.2, (3, PAST))
    lag = np.abs(np.arange(PAST)[:, None] - np.arange(PAST))
    values, fits = [], []
    for covariance, rough in product(PREDICTOR.covariances, ROUGHNESS):
        own = covariance[lag] + (rough * NOISE) ** 2 * np.eye(PAST)
        solved = np.linalg.solve(own, past.T)
        whole = [covariance[k + np.arange(PAST)] @ solved for k in range(41)]
        values.append([np.interp(times[0], np.arange(41), row) for row in np.transpose(whole)])
        fits.append(-0.5 * (past.T * solved).sum(axis=0) - 0.5 * np.linalg.slogdet(own)[1])
    share = np.exp(np.array(fits) - np.max(fits, axis=0))
    share /= share.sum(axis=0)
    expected = (share[..., None] * np.array(values)).sum(axis=0)
    found = PREDICTOR.predict(past, np.repeat(times, 3, axis=0))
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-9)


def test_covariance_is_that_of_filtered_noise():
    noise = np.random.default_rng(1).normal(0.0, NOISE, 200_000)
    signal = filtered(noise)[200:]
    for lag in (0, 5, 10):
        found = np.mean(signal[lag:] * signal[: len(signal) - lag])
        slow = SLOW[0] ** 2 / SLOW[1] ** 2
        fast = PREDICTOR.covariances[0] - slow * np.diff(PREDICTOR.covariances, axis=0)[0] / (
            1.0 - slow
        )
        assert abs(found - fast[lag]) < 0.05 * fast[0]


def test_filtered_noise_is_predicted_better_than_by_its_rate():
    signal = filtered(np.random.default_rng(2).normal(0.0, NOISE, 4000))
    past, later = windows(signal)
    straight = past[:, 0] + AHEAD * (past[:, 0] - past[:, 1])
    assert rms(predicted(past) - later) < 0.5 * rms(straight - later)
    assert rms(predicted(past) - later) < 0.5 * rms(past[:, 0] - later)


def test_jump_of_the_plan_is_not_extrapolated():
    for age in range(1, PAST):
        past = np.where(np.arange(PAST) < age, 1.0, 0.0)[None]
        assert -0.5 < predicted(past)[0] < 1.5


def walk(monkeypatch, **changes) -> float:
    for name, value in changes.items():
        monkeypatch.setattr(anticipation, name, value)
    env = make_env("PAM/KneeWalk-v0", episode_seconds=16.0)
    record = rollout(env, built("knee_anticipating", env))
    return rms((record["output"] - record["reference"])[tracked(record)])


class Held:
    """Distances that stay as they are."""

    def __init__(self, last: int) -> None:
        self.last = last

    def predict(self, distances, times):
        return np.repeat(distances[:, :1], times.shape[1], axis=1)


def test_prediction_lowers_the_error_of_a_walk(monkeypatch):
    with monkeypatch.context() as usual:
        found = walk(usual)
    assert found < 0.9 * walk(monkeypatch, TorqueAhead=Held)


def test_angle_in_stance_lowers_the_error_of_a_walk(monkeypatch):
    with monkeypatch.context() as usual:
        found = walk(usual)
    assert found < walk(monkeypatch, STANCE_NOISE=1e3)
