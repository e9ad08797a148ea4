"""Recent size of a tracking error, to which a residual's correction is proportional."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.settings.parts import Gauge

Array = NDArray[np.float32]


@dataclass(frozen=True)
class ErrorMean:
    """Recursive mean of absolute errors, in single precision as in the exported policy.

    ``matrix`` maps the signals to the errors, shape (n_errors, n_signals); ``smoothing`` and
    ``averaging`` are the shares by which smoothed errors and their mean follow in a period;
    ``full`` and ``least`` are those of :class:`agents.settings.parts.Gauge`. A state has the
    smoothed errors and their mean, shape (n_env, n_errors + 1), and begins with zeros.
    """

    matrix: Array
    smoothing: np.float32
    averaging: np.float32
    full: np.float32
    least: np.float32

    @property
    def width(self) -> int:
        """Number of entries of a row's state."""
        return len(self.matrix) + 1

    def after(self, state: Array, signals: Array) -> Array:
        """Return the state with the present errors, for signals of shape (n_env, n_signals)."""
        smooth, mean = state[:, :-1], state[:, -1:]
        smooth = smooth + self.smoothing * (signals @ self.matrix.T - smooth)
        mean = mean + self.averaging * (np.abs(smooth).mean(axis=1, keepdims=True) - mean)
        return np.concatenate([smooth, mean], 1)

    def factor(self, state: Array) -> Array:
        """Return the share of the whole correction, shape (n_env, 1)."""
        return np.clip(state[:, -1:] / self.full, self.least, np.float32(1.0))


def error_mean(gauge: Gauge, matrix: ArrayLike, period: float) -> ErrorMean:
    """Return the mean of a gauge for a control period [s]; ``matrix`` maps signals to errors."""

    def share(seconds: float) -> np.float32:
        return np.float32(1.0 - math.exp(-period / seconds) if seconds else 1.0)

    return ErrorMean(
        np.array(matrix, np.float32),
        share(gauge.smooth_seconds),
        share(gauge.mean_seconds),
        np.float32(gauge.full),
        np.float32(gauge.least),
    )
