"""Prediction of the torque reference of a gait from its distances from the plan.

The reference is a share of the torque from shoe and lean, low-passed at 5 Hz
(:mod:`pam_envs.sensing.butterworth`). The low-pass delays what differs from the plan (noise of the
sensors, another load or lean) by 0.16 s, so that inputs already received largely determine the
distances of the next 0.1 s. If the input is the sum of white noise and a first-order Markov
process, both Gaussian, the distances are a Gaussian process, and the expectation of future ones is
linear in the last ones (wiener1949).

How smooth the distances are depends on how exact the plan is. A bank of models with different
spreads of the slow input and of the error of the plan is weighted by the likelihoods of the last
distances (magill1965).
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from pam_envs.arrays import Array
from pam_envs.kernels.arithmetic import decay
from pam_envs.kernels.build import entry
from pam_envs.sensing.butterworth import filtered

PAST = 16
"""Distances that are used, one a control period."""
NOISE = 0.28
"""Standard deviation of the noise of a sample before the low-pass [N m]: a fifth of 2 mm of the
centre of pressure under 700 N."""
SLOW = (0.3, 3.0)
"""Standard deviations of the slow input over that of the noise."""
KEPT = 300.0
"""Time constant of the slow input [control periods]."""
ROUGHNESS = (0.002, 0.02, 0.2, 2.0)
"""Standard deviations of the error of the plan, which has not passed the low-pass, over that of the
noise."""
RESPONSE = 200
"""Samples of the low-pass's impulse response."""


@dataclass(frozen=True)
class TorqueAhead:
    """Prediction up to ``last`` control periods ahead."""

    last: int

    @cached_property
    def covariances(self) -> Array:
        """Covariances [N2 m2] of the distances by lag, shape (n_slow, last + PAST)."""
        impulse = np.zeros(RESPONSE)
        impulse[1] = 1.0
        response = filtered(impulse)
        spread = np.correlate(response, response, "full")
        lags, apart = np.arange(self.last + PAST), np.arange(1 - RESPONSE, RESPONSE)
        fast = spread[RESPONSE - 1 + lags]
        decays = np.exp(-np.abs(lags[:, None] + apart) / KEPT)
        slow = np.add.reduce(decays * spread, axis=1)
        return np.asarray(NOISE**2 * (fast + np.array(SLOW)[:, None] ** 2 * slow))

    @cached_property
    def _models(self) -> tuple[Array, Array, Array]:
        past, ahead = np.arange(PAST), np.arange(self.last + 1)
        weights, whitening, least = [], [], []
        for covariance, rough in product(self.covariances, ROUGHNESS):
            own = covariance[np.abs(past[:, None] - past)] + (rough * NOISE) ** 2 * np.eye(PAST)
            root = np.linalg.cholesky(own)
            weights.append(np.linalg.solve(own, covariance[ahead[:, None] + past].T).T)
            whitening.append(np.linalg.inv(root))
            least.append(np.log(np.diag(root)).sum())
        return np.array(weights), np.array(whitening), np.array(least)

    def predict(self, distances: Array, times: Array) -> Array:
        """Return the distances [N m] at times [control periods], (n_env, n_times).

        ``distances``, shape (n_env, PAST), are the last ones [N m], the newest first.
        """
        found = np.empty_like(times)
        given = np.ascontiguousarray(distances), np.ascontiguousarray(times)
        predict_rows(*given, *self._models, np.empty(len(SLOW) * len(ROUGHNESS)), found)
        return found


@entry
def predict_rows(
    distances: Array, times: Array, weights: Array, whitening: Array, least: Array, cost: Array,
    found: Array,
) -> None:  # fmt: skip
    """Write the expected distances; ``cost``, shape (n_models,), is scratch."""
    models, past, last = len(least), distances.shape[1], weights.shape[1] - 1
    for i in range(len(distances)):
        lowest = np.inf
        for m in range(models):
            cost[m] = least[m]
            for r in range(past):
                white = 0.0
                for k in range(r + 1):
                    white += whitening[m, r, k] * distances[i, k]
                cost[m] += 0.5 * white * white
            lowest = min(lowest, cost[m])
        total = 0.0
        for m in range(models):
            cost[m] = decay(cost[m] - lowest)
            total += cost[m]
        for j in range(times.shape[1]):
            whole = min(int(times[i, j]), last - 1)
            part = times[i, j] - whole
            found[i, j] = 0.0
            for m in range(models):
                low, high = 0.0, 0.0
                for k in range(past):
                    low += weights[m, whole, k] * distances[i, k]
                    high += weights[m, whole + 1, k] * distances[i, k]
                found[i, j] += cost[m] / total * (low + part * (high - low))
