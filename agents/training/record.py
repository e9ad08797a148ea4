"""What a training cost: time, machine, and the search before it, in words and numbers."""

from __future__ import annotations

import os
import platform
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from agents.settings import seeds
from agents.settings.presets import Config

CPU_FILE = Path("/proc/cpuinfo")


@dataclass
class Clock:
    """Time spent on a run, over all its interruptions.

    Attributes
    ----------
    wall, cpu : float
        Spent before [s], as the checkpoint says.
    """

    wall: float = 0.0
    cpu: float = 0.0
    _began: tuple[float, float] = field(
        default_factory=lambda: (time.perf_counter(), time.process_time())
    )

    def spent(self) -> dict[str, float]:
        """Return the time until now, as a checkpoint keeps it."""
        wall, cpu = self._began
        return {
            "wall": self.wall + time.perf_counter() - wall,
            "cpu": self.cpu + time.process_time() - cpu,
        }


def hardware() -> str:
    """Return the machine in words: processor and number of cores; no name, no place."""
    model = platform.processor() or platform.machine()
    try:
        lines = CPU_FILE.read_text(encoding="utf-8").splitlines()
        model = next(li.partition(":")[2].strip() for li in lines if li.startswith("model name"))
    except (OSError, StopIteration):
        pass
    cores = os.cpu_count() or 1
    return f"{model} ({platform.machine()}), {cores} cores, one used"


def training(
    config: Config,
    seed: int,
    command: str,
    spent: dict[str, float],
    steps: int | None = None,
) -> dict[str, Any]:
    """Return what stands under ``training`` in the file beside a policy.

    ``tuning_trials`` is None for settings that were chosen by hand, which nobody counted.

    Parameters
    ----------
    config : Config
    seed : int
        Training seed.
    command : str
        That starts this training again.
    spent : mapping
        Of :meth:`Clock.spent`.
    steps : int, optional
        That were done, whole rollouts; default: those that were asked for.
    """
    done = config.steps if steps is None else steps
    return {
        "steps": done,
        "seconds": round(spent["wall"], 1),
        "cpu_seconds": round(spent["cpu"], 1),
        "frames_per_second": round(done / max(spent["wall"], 1e-9)),
        "hardware": hardware(),
        "seed": seed,
        "first_env_seed": seeds.first_training(seed),
        "tuning_seeds": [seeds.TUNING, max(config.evaluation.episodes, 0)],
        "tuning_trials": config.search.trials,
        "command": command,
    }
