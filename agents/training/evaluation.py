"""How well a policy tracks on tuning seeds: what it is chosen by, and settings; never a score.

The policy is looked at as it will be shipped: exported, run by onnxruntime, with its controller.
"""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import pam_envs  # noqa: F401  (registers the environments)
from agents.policies import controllers
from agents.policies.policy import OnnxPolicy
from agents.policies.residual import with_controller
from agents.settings import seeds
from agents.settings.presets import Config

Array = NDArray[np.float64]
TRAVEL = "effort/pressure_travel"
MORE_TRAVEL = 1.05
"""Up to this many times as much travel as a controller's, its correction is as good as for free."""


@dataclass(frozen=True)
class Score:
    """Result of an evaluation.

    Attributes
    ----------
    rms : float
        RMS of ``output - reference`` (SI) over all episodes where it is tracked.
    mean_return : float
        Sum of rewards of an episode, mean over episodes.
    failures : int
        Episodes that a limit ended.
    travel : float
        Change of the set-points' pressure in a control period [Pa], mean over the same instants:
        what an error is bought with.
    kinds : tuple of float
        ``rms`` of each kind of row (see :meth:`agents.settings.presets.Config.kinds`).
    """

    rms: float
    mean_return: float
    failures: int
    travel: float = 0.0
    kinds: tuple[float, ...] = ()

    def as_dict(self, steps: int) -> dict[str, Any]:
        """Return the entry of a card, for the policy after ``steps`` control periods."""
        return {
            "steps": steps,
            "rms": _known(self.rms),
            "return": self.mean_return,
            "failures": self.failures,
            "travel": _known(self.travel),
            "kinds": [_known(rms) for rms in self.kinds],
        }


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def value_of(score: Score, config: Config, travel: float | None = None) -> float:
    """Return what is to be small, as ``evaluation.objective`` says; infinite if unknown.

    A number to choose by, no error: every episode that a limit ended adds the whole error again
    (in a return it shows as it is), and a residual that moves the set-point more than its
    controller pays in proportion.

    Parameters
    ----------
    score : Score
    config : Config
    travel : float, optional
        The travel [Pa] of the controller that a residual corrects.
    """
    objective = config.evaluation.objective
    if objective == "return":
        worth = -score.mean_return
    else:
        error = statistics.geometric_mean(score.kinds) if objective == "geometric" else score.rms
        worth = error * (1.0 + score.failures)
    if not math.isfinite(worth):
        return math.inf
    dearer = score.travel / (MORE_TRAVEL * travel) if travel else 1.0
    return worth * dearer if dearer > 1.0 and worth > 0.0 else worth


def evaluate(policy: OnnxPolicy | str, config: Config, episodes: int | None = None) -> Score:
    """Return the score of a policy on the tuning seeds, on the plants that it is trained on.

    Parameters
    ----------
    policy : OnnxPolicy or str
        A trained one, or the name of a classical controller, which is told the nominal plant.
    config : Config
        Whose ``evaluation`` says what is counted.
    episodes : int, optional
        How many, shared out evenly among the kinds of rows (one each at least), which have the
        same seeds; default: as ``evaluation`` says.
    """
    wanted = config.evaluation
    count = wanted.episodes if episodes is None else episodes
    kinds = config.kinds()
    chosen = seeds.tuning(max(count // len(kinds), 1))
    parts = [_Part(policy, config, {**kind, **wanted.env_kwargs}, chosen) for kind in kinds]
    for part in parts:
        part.run()
    counted = sum(part.counted for part in parts)
    squares = sum(part.squares for part in parts)
    return Score(
        rms=math.sqrt(squares / counted) if counted else math.nan,
        mean_return=float(np.mean(np.concatenate([part.returns for part in parts]))),
        failures=sum(part.failures for part in parts),
        kinds=tuple(part.rms for part in parts),
        travel=sum(part.travel for part in parts) / counted if counted else math.nan,
    )


class _Part:
    """The episodes on one kind of plant, as one batch."""

    def __init__(
        self, policy: OnnxPolicy | str, config: Config, kwargs: dict[str, Any], chosen: list[int]
    ) -> None:
        self.env: Any = gym.make_vec(
            config.env, len(chosen), vectorization_mode="vector_entry_point", **kwargs
        )
        base = self.env.unwrapped
        self.policy: Any = (
            controllers.make(policy, base.plant, base.signals, base.action_signals)
            if isinstance(policy, str)
            else with_controller(policy, base.plant)
        )
        self.wanted = config.evaluation
        self.seeds = chosen
        self.returns = np.zeros(len(chosen))
        self.squares = self.travel = 0.0
        self.counted = self.failures = 0

    @property
    def rms(self) -> float:
        """RMS of the error in these episodes."""
        return math.sqrt(self.squares / self.counted) if self.counted else math.nan

    def run(self) -> None:
        """Run every episode to its end."""
        observation, infos = self.env.reset(seed=self.seeds)
        running, state, start = np.ones(len(self.seeds), bool), None, np.ones(len(self.seeds), bool)
        while running.any():
            action, state = self.policy.predict(observation, state, start)
            observation, reward, terminated, truncated, infos = self.env.step(action)
            self.returns += np.where(running, reward, 0.0)
            self.failures += int((running & terminated).sum())
            start = terminated | truncated
            running &= ~start
            self._count(infos, running)
        self.env.close()

    def _count(self, infos: Any, running: NDArray[np.bool_]) -> None:
        """Add the present errors of the rows that go on: the others have begun anew."""
        if "output" not in infos:
            return
        rows = running & (np.asarray(infos["time"]) > self.wanted.settle_seconds)
        for name in self.wanted.gate:
            rows &= np.asarray(infos[name]) > 0.5
        errors: Array = np.asarray(infos["output"]) - np.asarray(infos["reference"])
        self.squares += float(np.sum(np.square(errors[rows])))
        self.travel += float(np.sum(np.asarray(infos[TRAVEL])[rows]))
        self.counted += int(rows.sum())
