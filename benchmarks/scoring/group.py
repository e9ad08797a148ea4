"""Group of metrics that a scenario file asks for by name: values, units and table columns."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array

Mask = NDArray[np.bool_]
Column = tuple[str, str, float]  # metric, heading and factor from SI

DEGREES = float(np.degrees(1.0))
EFFORT: tuple[Column, ...] = (
    ("pressure_travel", "pressure travel [bar/s]", 1e-5),
    ("air_use", "air [mg/s]", 1e6),
)
RMS_PERCENT: Column = ("rms_percent", "RMS [% of half-range]", 1.0)
OUT_OF_REACH: Column = ("saturated_time", "out of reach [%]", 100.0)


@dataclass(frozen=True)
class Record:
    """Recorded signals of one episode, (n,) arrays in SI, and the samples that are scored."""

    signals: Mapping[str, Array]
    window: Mask  # samples after settling
    tracked: Mask  # where the output is tracked as well
    period: float  # [s]
    content: Mapping[str, Any]  # of the scenario file

    def rate(self, signal: str) -> float:
        """Return the sum of a signal over the window per second."""
        total = np.sum(np.asarray(self.signals[signal])[self.window])
        return float(total) / (float(self.window.sum()) * self.period)


@dataclass(frozen=True)
class Group:
    """Metrics beside the common ones, less is better for all."""

    name: str  # as in a scenario file: ``metrics: [gait]``
    units: Mapping[str, str]  # SI unit of each metric
    score: Callable[[Record], dict[str, float]]
    # from the columns of the common errors (p95, max, steady, sensed) to all after the headline
    columns: Callable[[tuple[Column, ...]], tuple[Column, ...]]
    needs: tuple[str, ...] = ()  # entries that the scenario file must have
    headline: tuple[Column, ...] = ()  # beside the RMS in the first tables; ranks follow the RMS
    costs: Mapping[str, str] = field(default_factory=dict)  # names of metrics that count as costs
    # from signals to the (n,) array that rests where a steady-state error is scored; default: the
    # reference
    path: Callable[[Mapping[str, Array]], Array] | None = None


def rms(error: Array) -> float:
    """Return the root mean square of an error of any shape, NaN of none."""
    return float(np.sqrt(np.mean(np.square(error)))) if error.size else float("nan")
