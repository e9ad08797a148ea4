"""Sensor noise: a white part and a part with a correlation of one second."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

CORRELATION = 1.0  # [s]


def coloured_noise(
    rng: np.random.Generator, count: int, period: float, rms: float, coloured: float
) -> np.ndarray:
    """Return `count` samples of noise.

    Parameters
    ----------
    rng : numpy Generator
    count : int
    period : float [s]
    rms : float, of the sum of both parts
    coloured : float, share of the variance in the correlated part
    """
    keep = np.exp(-period / CORRELATION)
    white = np.sqrt(1.0 - coloured) * rng.standard_normal(count)
    drive = np.sqrt(coloured * (1.0 - keep**2)) * rng.standard_normal(count)
    first = np.sqrt(coloured) * rng.standard_normal()
    slow, _ = lfilter([1.0], [1.0, -keep], drive, zi=np.array([keep * first]))
    return rms * (white + slow)


def quantised(values: np.ndarray, grain: float) -> np.ndarray:
    """Round to whole grains; a grain of 0 leaves the values alone."""
    return values if grain <= 0.0 else grain * np.round(values / grain)
