"""Cost of a training: time, machine and the number of settings tried before it."""

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
    """Time spent on a run, over all interruptions.

    Attributes
    ----------
    wall, cpu : float
        Spent before [s], from the checkpoint.
    """

    wall: float = 0.0
    cpu: float = 0.0
    _began: tuple[float, float] = field(
        default_factory=lambda: (time.perf_counter(), time.process_time())
    )

    def spent(self) -> dict[str, float]:
        """Return the time until now [s], as a checkpoint keeps it."""
        wall, cpu = self._began
        return {
            "wall": self.wall + time.perf_counter() - wall,
            "cpu": self.cpu + time.process_time() - cpu,
        }


def hardware() -> str:
    """Return processor and number of cores of this machine in words."""
    model = platform.processor() or platform.machine()
    try:
        lines = CPU_FILE.read_text(encoding="utf-8").splitlines()
        model = next(li.partition(":")[2].strip() for li in lines if li.startswith("model name"))
    except (OSError, StopIteration):
        pass
    return f"{model} ({platform.machine()}), {os.cpu_count() or 1} cores, one used"


def cost(
    config: Config, seed: int, command: str, spent: dict[str, float], steps: int
) -> dict[str, Any]:
    """Return the entry ``training`` of the record beside a policy.

    ``tuning_trials`` is None for settings that were chosen by hand and not counted.

    Parameters
    ----------
    config : Config
    seed : int
        Training seed.
    command : str
        Repeats this training.
    spent : mapping
        Of :meth:`Clock.spent`.
    steps : int
        Control periods done, in whole rollouts.
    """
    return {
        "steps": steps,
        "seconds": round(spent["wall"], 1),
        "cpu_seconds": round(spent["cpu"], 1),
        "frames_per_second": round(steps / max(spent["wall"], 1e-9)),
        "hardware": hardware(),
        "seed": seed,
        "first_env_seed": seeds.first_training(seed),
        "tuning_seeds": [seeds.TUNING, max(config.evaluation.episodes, 0)],
        "tuning_trials": config.search.trials,
        "command": command,
    }
