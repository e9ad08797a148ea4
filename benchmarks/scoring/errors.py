"""Error measures of all metrics."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rms(error: Array) -> float:
    """Return the root mean square of an error of any shape, NaN of none."""
    return float(np.sqrt(np.mean(np.square(error)))) if error.size else float("nan")
