"""What happens now and then in a training: the critic's lead, evaluations, checkpoints."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from stable_baselines3.common.callbacks import BaseCallback

from agents.export.export import facts, plants_of, policy_bytes
from agents.policies.networks import critic_alone
from agents.policies.policy import OnnxPolicy
from agents.settings.presets import Config
from agents.training import checkpoint, snapshot, sources
from agents.training.best import Best
from agents.training.building import warm_up_steps
from agents.training.evaluation import Score, evaluate, value_of
from agents.training.record import Clock

PARTS, PASSES = 16, 10
"""The critic's lead: into so many smaller batches a batch is cut, and so often each is used."""
SMALLEST = 32


class WarmUp(BaseCallback):
    """Lets the critic alone learn in a training's first rollouts, thoroughly.

    What it does follows from the number of steps alone, so that a resumed training does the same.
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

    def _on_step(self) -> bool:
        return True


class Now(BaseCallback):
    """Acts at the first rollout's start after every ``interval`` steps; 0 for never."""

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

    def _on_step(self) -> bool:
        return True

    def act(self) -> None:
        """Do it now; only between rollouts."""
        raise NotImplementedError


class Evaluations(Now):
    """Evaluates the policy on tuning seeds, as TensorBoard and the card then show.

    Also before any training: a residual's first entry is its controller's.

    Attributes
    ----------
    found : list of dict
        Entries of the card so far.
    best : Best
        The best of them, which is shipped.
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
        """Evaluate at the end, unless that was just done."""
        if not self.config.evaluation.episodes:
            return
        if not self.found or self.found[-1]["steps"] != self.model.num_timesteps:
            self.act()
            self.logger.dump(self.model.num_timesteps)


def score_of(model: Any, config: Config) -> Score:
    """Return how well the model would track on tuning seeds if it were exported now."""
    card = facts(model)
    return evaluate(OnnxPolicy(policy_bytes(model, card), card), config)


class Checkpoints(Now):
    """Writes checkpoints.

    Parameters
    ----------
    path : Path
    config : Config
    seed : int
    clock : Clock
    evaluations : Evaluations
        Made before a checkpoint of the same step is written.
    """

    def __init__(
        self, path: Path, config: Config, seed: int, clock: Clock, evaluations: Evaluations
    ) -> None:
        super().__init__(config.checkpoint_steps)
        self.path = path
        self.settings = {"config": config.as_dict(), "seed": seed}
        self.clock = clock
        self.evaluations = evaluations

    def act(self) -> None:
        """Write the checkpoint now."""
        env = self.model.get_env()
        assert env is not None
        trained_with = {"plants": plants_of(env), "sources": sources.digests()}
        content = {
            "settings": json.dumps({**self.settings, **trained_with}),
            "spent": self.clock.spent(),
            "evaluations": self.evaluations.found,
            "best": vars(self.evaluations.best),
            "snapshot": snapshot.take(self.model),
        }
        checkpoint.save(self.path, content)
