"""Eighth-order Butterworth low-pass of 5 Hz at 100 Hz, as second-order sections.

yeh2010, section 5.2, filters the assistive torque with it to obtain the reference. It delays slow
signals by 163 ms.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.kernels.build import entry, kernel

PERIOD = 0.01
"""Sampling period [s] that the coefficients are for."""
SECTIONS = (
    (-1.4597062543768673, 0.5348259849616107),
    (-1.5132907658389045, 0.5911680745682053),
    (-1.6234056976410005, 0.7069497656826822),
    (-1.7939618452517712, 0.8862831120070135),
)
"""Denominators ``1 + a1 / z + a2 / z^2`` (bilinear transform); every numerator is that of a
double zero at half the sampling frequency, with gain 1 at rest."""
ROWS = 2 * len(SECTIONS)
"""Rows of state."""


@kernel
def section(
    x: float, first: float, second: float, a1: float, a2: float
) -> tuple[float, float, float]:
    """Return the output of one section and its new state (transposed direct form II)."""
    b = 0.25 * (1.0 + a1 + a2)
    y = b * x + first
    return y, 2.0 * b * x - a1 * y + second, b * x - a2 * y


@kernel
def butterworth(rows: Any, base: int, lane: int, x: float) -> float:
    """Return the filtered signal of one lane, whose state starts at row ``base``."""
    for i in range(4):
        a1, a2 = SECTIONS[i]
        first, second = rows[base + 2 * i][lane], rows[base + 2 * i + 1][lane]
        x, rows[base + 2 * i][lane], rows[base + 2 * i + 1][lane] = section(
            x, first, second, a1, a2
        )
    return x


@kernel
def settle(rows: Any, base: int, lane: int, x: float) -> None:
    """Put the filter of one lane in the steady state of a constant ``x``."""
    for i in range(4):
        a1, a2 = SECTIONS[i]
        b = 0.25 * (1.0 + a1 + a2)
        rows[base + 2 * i][lane] = (1.0 - b) * x
        rows[base + 2 * i + 1][lane] = (b - a2) * x


@entry
def _filter(values: Any, state: Any, out: Any) -> None:
    """Run the filter over a record."""
    for t in range(len(values)):
        out[t] = butterworth(state, 0, 0, values[t])


def filtered(signal: ArrayLike) -> NDArray[np.float64]:
    """Return a signal sampled at 100 Hz, shape (T,), filtered from rest at its first value."""
    values = np.array(signal, dtype=float)
    if values.ndim != 1 or not len(values):
        raise ValueError(f"signal has shape {values.shape}; give one record, shape (T,)")
    state, out = np.zeros((ROWS, 1)), np.empty_like(values)
    settle(state, 0, 0, values[0])
    _filter(values, state, out)
    return out
