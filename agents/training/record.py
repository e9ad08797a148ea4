"""Training run: settings, folder, command that reproduces it, and cost."""

import dataclasses
import hashlib
import json
import os
import platform
import time
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import agents
import baselines
import pam_envs
from agents.policies.policy_file import POLICY, finished
from agents.settings import presets as configs
from agents.settings import seeds
from agents.settings.presets import Config
from agents.settings.schema import SettingsError
from sweeps.files import sources_digest
from sweeps.versions import versions_of

SOURCES = tuple(Path(package.__path__[0]) for package in (agents, baselines, pam_envs))
PACKAGES = (
    *("numpy", "scipy", "numba", "gymnasium"),
    *("torch", "stable_baselines3", "sb3_contrib", "onnx"),
)
CHECKPOINT, LOCK = "checkpoint.pt", "training.lock"
CPU_FILE = Path("/proc/cpuinfo")


@dataclass(frozen=True)
class Run:
    """A training run in an absolute folder; ``seed`` is that of weights, exploration and episodes.

    Workers of a cluster that share the folder continue from each other's checkpoints. ``device``
    holds the networks, "cpu" or "cuda".
    """

    config: Config
    seed: int
    folder: Path
    device: str = "cpu"

    @property
    def checkpoint(self) -> Path:
        """Path of the checkpoint."""
        return self.folder / CHECKPOINT

    @property
    def key(self) -> str:
        """Digest of settings, seed, folder, package versions and code; workers must agree."""
        own = [self.config.as_dict(), self.seed, str(self.folder), self.device]
        parts = [*own, versions_of(PACKAGES), code()]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:32]

    def finished(self) -> bool:
        """Return whether the folder holds the policy and its record; raise for other settings."""
        card = finished(self.folder / POLICY)
        if card is None:
            return False
        if configs.from_mapping(card.get("config")) != self.config or card["seed"] != self.seed:
            raise SettingsError(
                f"{self.folder} holds a policy of other settings; give another --out"
            )
        return True

    def command(self) -> str:
        """Return the command that reproduces the policy, from ``policy.onnx`` without a preset."""
        config = self.config
        words = ["python -m agents train", config.env, "--algo", config.algo]
        words += ["--steps", str(config.steps), "--seed", str(self.seed)]
        variant = self._variant()
        if variant is None:
            words += ["--config", POLICY]
        elif variant:
            words += ["--variant", variant]
        if self.device != "cpu":
            words += ["--device", self.device]
        return " ".join(words)

    def _variant(self) -> str | None:
        """Return the variant of the preset with these settings, None without one."""
        config = self.config
        for env, algo, variant in configs.presets():
            if (env, algo) == (config.env, config.algo):
                preset = configs.preset(env, algo, variant)
                if dataclasses.replace(preset, steps=config.steps, search=config.search) == config:
                    return variant
        return None


@cache
def code() -> str:
    """Return a digest of the Python files that a training runs, as first read by this process."""
    return sources_digest(SOURCES, {".py"})


@dataclass
class Clock:
    """Time spent on a run across interruptions; ``before`` [s] comes from the checkpoint."""

    wall: float = 0.0
    cpu: float = 0.0
    _began: tuple[float, float] = field(
        default_factory=lambda: (time.perf_counter(), time.process_time())
    )

    def spent(self) -> dict[str, float]:
        """Return the total time until now [s], for the checkpoint."""
        wall, cpu = self._began
        return {
            "wall": self.wall + time.perf_counter() - wall,
            "cpu": self.cpu + time.process_time() - cpu,
        }


def hardware(device: str = "cpu") -> str:
    """Return processor and number of cores of this machine in words, and the GPU if it is used."""
    model = platform.processor() or platform.machine()
    try:
        lines = CPU_FILE.read_text(encoding="utf-8").splitlines()
        model = next(li.partition(":")[2].strip() for li in lines if li.startswith("model name"))
    except (OSError, StopIteration):
        pass
    made = f"{model} ({platform.machine()}), {os.cpu_count() or 1} cores, one used"
    if device == "cpu":
        return made
    import torch  # a sweep lists its runs without it

    return f"{made}; {torch.cuda.get_device_name(device)}"


def cost(run: Run, spent: dict[str, float], steps: int) -> dict[str, Any]:
    """Return the entry ``training`` of the record beside a policy.

    ``spent`` is of :meth:`Clock.spent`, ``steps`` are control periods done, in whole rollouts.
    ``tuning_trials`` is None for settings that were chosen by hand and not counted.
    """
    return {
        "steps": steps,
        "seconds": round(spent["wall"], 1),
        "cpu_seconds": round(spent["cpu"], 1),
        "frames_per_second": round(steps / max(spent["wall"], 1e-9)),
        "hardware": hardware(run.device),
        "seed": run.seed,
        "first_env_seed": seeds.first_training(run.seed),
        "tuning_seeds": [seeds.TUNING, max(run.config.evaluation.episodes, 0)],
        "tuning_trials": run.config.search.trials,
        "command": run.command(),
    }
