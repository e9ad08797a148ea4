"""Rows and rankings of a comparison of predicted with measured figures."""

import math
from dataclasses import dataclass
from typing import Any

from pam_envs.rig.comparison.figures import FIGURES
from pam_envs.rig.comparison.ranks import Rank
from pam_envs.rig.comparison.table import Condition


@dataclass(frozen=True)
class Row:
    """A predicted and measured figure of a controller in a condition.

    Attributes
    ----------
    predicted : float
        Mean of the runs [unit of the metric]; infinite if a run left the range of contractions.
    low, high : float
        Prediction interval of one further run [unit of the metric].
    """

    controller: str
    condition: Condition
    figure: str
    predicted: float
    low: float
    high: float
    measured: float
    knowledge: str
    preview: bool

    @property
    def error(self) -> float:
        """Predicted less measured."""
        return self.predicted - self.measured

    @property
    def relative(self) -> float:
        """Error over the measured figure; NaN if that is 0."""
        return self.error / self.measured if self.measured else float("nan")

    @property
    def within(self) -> bool:
        """Whether the measured figure is in the prediction interval."""
        return self.low <= self.measured <= self.high

    def record(self) -> dict[str, Any]:
        """Return the row for a JSON file."""
        interval = [_finite(self.low), _finite(self.high)]
        return {
            "controller": self.controller,
            "knowledge": self.knowledge,
            "preview": self.preview,
            "load_kg": self.condition.load,
            "reference": self.condition.reference and self.condition.reference.name,
            "figure": self.figure,
            "unit": FIGURES[self.figure].unit,
            "predicted": _finite(self.predicted),
            "interval": interval,
            "measured": self.measured,
            "error": _finite(self.error),
            "relative_error": _finite(self.relative),
            "within_interval": self.within,
        }


@dataclass(frozen=True)
class Ranking:
    """Agreement of the order of the controllers by a figure, in one condition."""

    figure: str
    condition: Condition
    controllers: int
    kendall: Rank
    spearman: Rank

    def record(self) -> dict[str, Any]:
        """Return the ranking for a JSON file."""
        both = {"kendall": self.kendall, "spearman": self.spearman}
        return {
            "figure": self.figure,
            "load_kg": self.condition.load,
            "reference": self.condition.reference and self.condition.reference.name,
            "controllers": self.controllers,
            **{
                name: {
                    "value": _finite(rank.value),
                    "interval": [_finite(rank.low), _finite(rank.high)],
                    "chance": _finite(rank.chance),
                }
                for name, rank in both.items()
            },
        }


def _finite(value: float) -> float | None:
    """Return a number for JSON, None if it is not finite."""
    return float(value) if math.isfinite(value) else None
