"""Evaluation of a policy on tuning seeds, the criterion for policies and settings.

The policy runs as it will be exported: in onnxruntime, with its controller.
"""

import math
import statistics
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import pam_envs  # noqa: F401  (registers the environments)
from agents.policies.policy import OnnxPolicy
from agents.policies.residual import with_controller
from agents.settings import seeds
from agents.settings.presets import Config
from agents.vec_envs.batch import nominal_plant
from baselines.core.catalogue import make_controller

TRAVEL = "effort/pressure_travel"
MORE_TRAVEL = 1.05  # largest ratio of a policy's travel to its controller's without a penalty


@dataclass(frozen=True)
class Score:
    """Result of an evaluation."""

    rms: float  # of output - reference (SI) over the evaluated instants of all episodes
    mean_return: float  # sum of rewards of an episode, mean over episodes
    failures: int  # episodes that a limit ended
    # change of the pressure setpoints in a control period [Pa], mean over these instants
    travel: float = 0.0
    kinds: tuple[float, ...] = ()  # RMS of each kind of row (agents.settings.presets.Config.kinds)

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
    """Return the criterion of ``evaluation.objective``: less is better, infinite if unknown.

    Each episode ended by a limit adds the whole error again (a return already includes it), and a
    residual with more travel [Pa] than its controller's ``travel`` is penalised in proportion.
    """
    objective = config.evaluation.objective
    if objective == "return":
        worth = -score.mean_return
    else:
        error = statistics.geometric_mean(score.kinds) if objective == "geometric" else score.rms
        worth = error * (1.0 + score.failures)
    if not math.isfinite(worth):
        return math.inf
    excess = score.travel / (MORE_TRAVEL * travel) if travel else 1.0
    return worth * excess if excess > 1.0 and worth > 0.0 else worth


def evaluate(policy: OnnxPolicy | str, config: Config, episodes: int | None = None) -> Score:
    """Return the score of a policy on tuning seeds, on the plants of its training.

    ``policy`` may be the name of a classical controller, built from the nominal plant. The
    episodes, by default those of ``config.evaluation``, are split evenly among the kinds of rows
    (at least one each), which have the same seeds.
    """
    count = config.evaluation.episodes if episodes is None else episodes
    kinds = config.kinds()
    chosen = seeds.tuning(max(count // len(kinds), 1))
    parts = [
        _Part(policy, config, {**kind, **config.evaluation.env_kwargs}, model, chosen)
        for kind, model in zip(kinds, config.models(), strict=True)
    ]
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
    """The episodes of one kind of rows, as one batch, with sums over the evaluated instants.

    The controller is built from the nominal plant of ``model``, or of the rows.
    """

    def __init__(
        self,
        policy: OnnxPolicy | str,
        config: Config,
        kwargs: dict[str, Any],
        model: dict[str, Any],
        chosen: list[int],
    ) -> None:
        env: Any = gym.make_vec(
            config.env, len(chosen), vectorization_mode="vector_entry_point", **kwargs
        )
        base: Any = env.unwrapped
        plant = nominal_plant(config.env, model) if model else base.plant
        controller: Any = (
            make_controller(policy, plant, base.signals, base.action_signals)
            if isinstance(policy, str)
            else with_controller(policy, plant)
        )
        self.evaluation = config.evaluation
        self.returns = np.zeros(len(chosen))
        self.squares = self.travel = 0.0
        self.counted = self.failures = 0
        observation, infos = env.reset(seed=chosen)
        running, state, start = np.ones(len(chosen), bool), None, np.ones(len(chosen), bool)
        while running.any():
            action, state = controller.predict(observation, state, start)
            observation, reward, terminated, truncated, infos = env.step(action)
            self.returns += np.where(running, reward, 0.0)
            self.failures += int((running & terminated).sum())
            start = terminated | truncated
            running &= ~start
            self._count(infos, running)
        env.close()

    @property
    def rms(self) -> float:
        """RMS of the error in these episodes."""
        return math.sqrt(self.squares / self.counted) if self.counted else math.nan

    def _count(self, infos: Any, running: NDArray[np.bool_]) -> None:
        """Add the present errors of the rows whose first episode is still running."""
        if "output" not in infos:
            return
        rows = running & (np.asarray(infos["time"]) > self.evaluation.settle_seconds)
        for name in self.evaluation.gate:
            rows &= np.asarray(infos[name]) > 0.5
        errors = np.asarray(infos["output"]) - np.asarray(infos["reference"])
        self.squares += float(np.sum(np.square(errors[rows])))
        self.travel += float(np.sum(np.asarray(infos[TRAVEL])[rows]))
        self.counted += int(rows.sum())
