"""Progress of a training: steps, rate, mean return and the remaining time."""

from __future__ import annotations

import time

import numpy as np

from agents.training.callbacks import RolloutCallback
from sweeps.progress import Advance, Start


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
