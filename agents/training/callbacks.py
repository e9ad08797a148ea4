"""Callbacks of a training: critic warm-up, evaluations, checkpoints, progress, cancellation."""

import json
import math
import time
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from agents.export.export import facts, plants_of, policy_bytes
from agents.policies.networks import critic_alone
from agents.policies.policy import OnnxPolicy
from agents.settings.presets import Config
from agents.training import checkpoint, snapshot
from agents.training.best import Best
from agents.training.building import warm_up_steps
from agents.training.evaluation import Score, evaluate, value_of
from agents.training.record import Clock, Run
from sweeps.progress import Advance, Start
from sweeps.worker import is_needed

PARTS, PASSES = 16, 10
"""Critic warm-up: number of parts that a batch is split into, and epochs per rollout."""
SMALLEST = 32  # smallest batch of the warm-up


class RolloutCallback(BaseCallback):
    """Callback that acts only between rollouts."""

    def _on_step(self) -> bool:
        return True


class WarmUp(RolloutCallback):
    """Train the critic alone in the first rollouts.

    It depends only on the number of steps, so a resumed training reproduces it.
    """

    def __init__(self, config: Config) -> None:
        super().__init__()
        self.config = config

    def _on_rollout_start(self) -> None:
        usual, until = self.config.chosen, warm_up_steps(self.config)
        if not until:
            return
        alone = self.model.num_timesteps < until
        model: Any = self.model
        critic_alone(model.policy, alone)
        small = min(max(usual.batch_size // PARTS, SMALLEST), usual.batch_size)
        model.batch_size = small if alone else usual.batch_size
        model.n_epochs = PASSES if alone else usual.n_epochs


class Cancellation(RolloutCallback):
    """Stop a training on a Dask cluster after its sweep has ended."""

    def _on_rollout_start(self) -> None:
        if not is_needed():
            raise RuntimeError("the sweep that asked for this training is gone")


class PeriodicCallback(RolloutCallback):
    """Act at the first rollout start after every ``interval`` steps; 0 for never."""

    def __init__(self, interval: int) -> None:
        super().__init__()
        self.interval = interval
        self.due = 0

    def _on_training_start(self) -> None:
        self.due = self._next()

    def _next(self) -> int:
        passed = self.model.num_timesteps // self.interval if self.interval else 0
        return (passed + 1) * self.interval

    def _on_rollout_start(self) -> None:
        if self.interval and self.model.num_timesteps >= self.due:
            self.act()
            self.due = self._next()

    def act(self) -> None:
        """Act now; only between rollouts."""
        raise NotImplementedError


class Evaluations(PeriodicCallback):
    """Evaluate the policy on tuning seeds, for TensorBoard, the card and the choice of the best.

    The first evaluation is before any training: that of a residual is its controller's. ``found``
    are the card's entries, ``best`` is the best policy so far, which is exported at the end.
    """

    def __init__(self, config: Config, found: list[dict[str, Any]], best: Best) -> None:
        super().__init__(config.evaluation.interval if config.evaluation.episodes else 0)
        self.config = config
        self.found = found
        self.best = best

    def _on_training_start(self) -> None:
        super()._on_training_start()
        if self.config.evaluation.episodes and not self.found:
            self.act()

    def act(self) -> None:
        """Evaluate now."""
        score = score_of(self.model, self.config)
        corrects = self.config.residual.controller and self.found
        value = value_of(score, self.config, self.found[0]["travel"] if corrects else None)
        self.best.offer(self.model, value)
        known = value if math.isfinite(value) else None
        self.found.append({**score.as_dict(self.model.num_timesteps), "value": known})
        for name in ("rms", "return", "failures", "travel", "value"):
            if self.found[-1][name] is not None:
                self.logger.record(f"tuning/{name}", self.found[-1][name])

    def last(self) -> None:
        """Evaluate at the end, unless the last evaluation was at this step."""
        if not self.config.evaluation.episodes:
            return
        if not self.found or self.found[-1]["steps"] != self.model.num_timesteps:
            self.act()
            self.logger.dump(self.model.num_timesteps)


def score_of(model: Any, config: Config) -> Score:
    """Return the score, on tuning seeds, of the policy that an export would write now."""
    card = facts(model)
    return evaluate(OnnxPolicy(policy_bytes(model, card), card), config)


class Checkpoints(PeriodicCallback):
    """Write checkpoints, each after the evaluation of the same step, which it then includes."""

    def __init__(self, run: Run, clock: Clock, evaluations: Evaluations) -> None:
        super().__init__(run.config.checkpoint_steps)
        self.path = run.checkpoint
        self.settings = {
            "config": run.config.as_dict(),
            "seed": run.seed,
            "device": run.device,
        }
        self.clock = clock
        self.evaluations = evaluations

    def act(self) -> None:
        """Write the checkpoint now."""
        env = self.model.get_env()
        assert env is not None
        content = {
            "settings": json.dumps({**self.settings, "plants": plants_of(env)}),
            "spent": self.clock.spent(),
            "evaluations": self.evaluations.found,
            "best": vars(self.evaluations.best),
            "snapshot": snapshot.take(self.model),
        }
        checkpoint.save(self.path, content)


class TrainingProgress(RolloutCallback):
    """Report steps, rate and the mean return of the last 100 episodes."""

    def __init__(self, total: int, start: Start) -> None:
        super().__init__()
        self.total, self.start = total, start
        self.first = self.done = 0
        self.began = 0.0

    def _on_training_start(self) -> None:
        self.began = time.perf_counter()
        self.first = self.done = self.model.num_timesteps
        self.advance: Advance = self.start(self.total, self.first)

    def _on_training_end(self) -> None:
        self._on_rollout_start()

    def _on_rollout_start(self) -> None:
        fresh, self.done = self.model.num_timesteps - self.done, self.model.num_timesteps
        rate = (self.done - self.first) / max(time.perf_counter() - self.began, 1e-9)
        returns = [float(episode["r"]) for episode in self.model.ep_info_buffer or ()]
        mean = f", return {np.mean(returns):.1f}" if returns else ""
        self.advance(fresh, f", {rate:,.0f} steps/s{mean}")
