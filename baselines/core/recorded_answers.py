"""Recorded actions of a controller for fixed observations, which identify it by behaviour."""

import base64
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]


@dataclass(frozen=True)
class RecordedAnswers:
    """Observations of one episode and the actions that a controller returned for them.

    Attributes
    ----------
    observations : array of float32, shape (steps, n_signals)
        Observations as returned by the environment, from -1 to 1.
    answers : array of float32, shape (steps, n_actions)
        Actions of the controller as returned by ``predict``, from -1 to 1.
    """

    observations: Array
    answers: Array

    @classmethod
    def of(cls, controller: Any, observations: Array) -> "RecordedAnswers":
        """Return a controller's actions for observations in order from an episode's start."""
        return cls(observations, answers(controller, observations))

    @property
    def travel(self) -> float:
        """Sum of the absolute changes of the actions."""
        return float(np.abs(np.diff(self.answers, axis=0)).sum())

    def deviation(self, controller: Any) -> float:
        """Return the largest deviation of a controller's actions; infinite if not comparable."""
        now = answers(controller, self.observations)
        if now.shape != self.answers.shape or not np.isfinite(now).all():
            return math.inf
        return float(np.abs(now - self.answers).max())

    def as_dict(self) -> dict[str, str]:
        """Return both arrays as base64 text of little-endian float32, for JSON."""
        return {name: _text(getattr(self, name)) for name in ("observations", "answers")}

    @classmethod
    def from_dict(
        cls, record: Mapping[str, Any], n_signals: int, n_actions: int
    ) -> "RecordedAnswers":
        """Return the record that :meth:`as_dict` wrote."""
        made = cls(_array(record["observations"], n_signals), _array(record["answers"], n_actions))
        if not 0 < len(made.observations) == len(made.answers):
            raise ValueError("the record needs as many answers as observations")
        return made


def answers(controller: Any, observations: Array) -> Array:
    """Return a controller's actions, (steps, ..., n_actions), for observations in order.

    The observations have the shape (steps, n_signals), or (steps, n_env, n_signals) for rows.
    """
    made, state = [], None
    for step, observation in enumerate(observations):
        action, state = controller.predict(observation, state, step == 0)
        made.append(np.asarray(action, np.float32))
    return np.array(made)


def _text(values: Array) -> str:
    return base64.b64encode(values.astype("<f4").tobytes()).decode()


def _array(text: str, width: int) -> Array:
    return np.frombuffer(base64.b64decode(text, validate=True), "<f4").reshape(-1, width)
