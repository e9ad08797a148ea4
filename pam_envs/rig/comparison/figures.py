"""Closed-loop figures of a run, as a rig can measure them: from readings of its sensors."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pam_envs.arrays import Array

MM, BAR = 1e3, 1e-5
"""Units of the figures from SI."""
SHORTEST_HOLD = 2.0
"""Shortest hold, over the time at its end that counts as settled."""
RESTS = 1e-12
"""Largest change [m] of a reference that rests."""


@dataclass(frozen=True)
class Run:
    """Recorded signals of a run, one value per control period.

    Attributes
    ----------
    reference, reading : ndarray, shape (n,)
        Reference and sensed contraction [m].
    travel : ndarray, shape (n,)
        Size of the change of the pressure in each control period [Pa].
    period : float
        Control period [s].
    settled : float
        Time at the end of each hold that counts as settled [s].
    """

    reference: Array
    reading: Array
    travel: Array
    period: float
    settled: float

    @property
    def error(self) -> Array:
        """Reading less reference [mm], shape (n,)."""
        return MM * (self.reading - self.reference)


def settled_parts(reference: Array, period: float, settled: float) -> list[slice]:
    """Return the settled part of each hold of a reference [m], shape (n,)."""
    last, least = round(settled / period), round(SHORTEST_HOLD * settled / period)
    edges = np.flatnonzero(np.abs(np.diff(reference)) > RESTS) + 1
    begins, ends = [0, *edges.tolist()], [*edges.tolist(), len(reference)]
    return [slice(e - last, e) for b, e in zip(begins, ends, strict=True) if e - b >= least]


def _settled_bias(run: Run) -> float:
    parts = settled_parts(run.reference, run.period, run.settled)
    return float(np.mean([abs(run.error[part].mean()) for part in parts]))


@dataclass(frozen=True)
class Figure:
    """A closed-loop figure; less is better."""

    text: str
    unit: str
    of: Callable[[Run], float]


FIGURES: dict[str, Figure] = {
    "rms_mm": Figure(
        "root mean square of the error", "mm", lambda run: float(np.sqrt((run.error**2).mean()))
    ),
    "mae_mm": Figure("mean absolute error", "mm", lambda run: float(np.abs(run.error).mean())),
    "p95_mm": Figure(
        "95th percentile of the absolute error",
        "mm",
        lambda run: float(np.percentile(np.abs(run.error), 95.0)),
    ),
    "max_mm": Figure("largest absolute error", "mm", lambda run: float(np.abs(run.error).max())),
    "bias_mm": Figure(
        "mean over holds of the absolute mean error in the settled part", "mm", _settled_bias
    ),
    "travel_bar_s": Figure(
        "travel of the pressure per second",
        "bar/s",
        lambda run: float(BAR * run.travel.mean() / run.period),
    ),
}
"""Figures by the names of the table's columns."""
