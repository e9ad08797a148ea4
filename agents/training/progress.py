"""What a training says while it runs: a bar on a terminal, now and then a line elsewhere."""

from __future__ import annotations

import time

import numpy as np
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from stable_baselines3.common.callbacks import BaseCallback

LINE_SECONDS = 20.0


class TrainingProgress(BaseCallback):
    """Shows steps, rate, mean return of the last 100 episodes and the time left."""

    def __init__(self, total: int, console: Console) -> None:
        super().__init__()
        self.total = total
        self.console = console
        self.bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[news]}"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=console,
            refresh_per_second=4,
            disable=not console.is_terminal,
        )
        self.task = TaskID(0)
        self.first = 0
        self.began = self.said = 0.0

    def _on_training_start(self) -> None:
        self.began = self.said = time.perf_counter()
        self.first = self.model.num_timesteps
        self.task = self.bar.add_task("training", total=self.total, completed=self.first, news="")
        self.bar.start()

    def _on_rollout_start(self) -> None:
        done = self.model.num_timesteps
        now = time.perf_counter()
        self.bar.update(self.task, completed=done, news=self.news())
        if self.bar.disable and now - self.said > LINE_SECONDS:
            self.said = now
            self.console.print(f"{done:,} of {self.total:,} steps, {self.news()}")

    def _on_step(self) -> bool:
        return True

    def _on_training_end(self) -> None:
        self.bar.update(self.task, completed=self.model.num_timesteps, news=self.news())
        self.bar.stop()

    def news(self) -> str:
        """Return rate and mean return in words."""
        rate = (self.model.num_timesteps - self.first) / max(time.perf_counter() - self.began, 1e-9)
        returns = [float(episode["r"]) for episode in self.model.ep_info_buffer or ()]
        earned = f", return {np.mean(returns):.1f}" if returns else ""
        return f"{rate:,.0f} steps/s{earned}"
