"""Learning of a correction that repeats with a period (bristow2006, longman2000).

P-type learning over the phase of the reference, on top of a controller that inverts the plant: the
correction at a phase increases by a share of the error at that phase, and is applied one period
later, led by the inverse. A zero-phase filter smooths it over neighbouring phases,

    c_(k+1) = c_k + gain e_k,   e_k = d - P Q c_k    =>    e_(k+1) = (1 - gain P Q) e_k

where ``P`` is what the inverse leaves of the plant (1 if exact) and ``Q`` the filter's gain,
between 0 and 1. The error contracts at every frequency while ``gain P Q`` is between 0 and 2, by
``|1 - gain P|`` a period where the error is smooth over the phase.
"""

from dataclasses import dataclass

import numpy as np

from baselines.core.controller import Rows
from pam_envs.arrays import Array

FILTER = np.array([1.0, 4.0, 6.0, 4.0, 1.0]) / 16.0
"""Weights of neighbouring phases: binomial, so that their gain is nowhere below 0."""


@dataclass(frozen=True)
class PeriodicLearning:
    """P-type learning over a period.

    Attributes
    ----------
    period : float
        Duration of the period [control periods].
    gain : float
        Share of an error that is added to the correction, between 0 and 2.
    largest : float
        Limit of the correction [unit of the reference]: an error that the actuator cannot remove
        does not wind up.
    """

    period: float
    gain: float
    largest: float

    @property
    def bins(self) -> int:
        """Number of phases."""
        return max(1, round(self.period))

    def start(self, rows: int) -> Array:
        """Return no correction, shape (rows, bins)."""
        return np.zeros((rows, self.bins))

    def learn(self, correction: Array, time: Array, error: Array, tracked: Rows) -> Array:
        """Return the correction after errors at times [control periods], all of shape (rows,).

        Rows that are not ``tracked`` keep theirs.
        """
        made, rows = correction.copy(), np.arange(len(correction))
        phase = np.rint(self._phase(time)).astype(np.int64) % self.bins
        moved = made[rows, phase] + np.where(tracked, self.gain * error, 0.0)
        made[rows, phase] = np.clip(moved, -self.largest, self.largest)
        return made

    def read(self, correction: Array, times: Array) -> Array:
        """Return the smoothed correction at times, shape (rows, n_times)."""
        half = len(FILTER) // 2
        smooth = sum(
            weight * np.roll(correction, k - half, axis=1) for k, weight in enumerate(FILTER)
        )
        phase = self._phase(times)
        low = np.floor(phase).astype(np.int64)
        part, rows = phase - low, np.arange(len(correction))[:, None]
        before, after = smooth[rows, low % self.bins], smooth[rows, (low + 1) % self.bins]
        return np.asarray((1.0 - part) * before + part * after)

    def _phase(self, time: Array) -> Array:
        return np.asarray(np.mod(time, self.period) * (self.bins / self.period))
