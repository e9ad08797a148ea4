"""Several training seeds in parallel, on this machine or a Dask cluster.

A finished training is kept, and a killed one continues from its checkpoint. The policies are those
of ``python -m agents train``, bit for bit.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from filelock import FileLock

from agents.policies.policy_file import POLICY, RECORD, finished, write_atomically
from agents.settings import presets as configs
from agents.settings.presets import Config
from agents.settings.schema import SettingsError
from sweeps import engine
from sweeps.versions import versions_of

ROOT = Path(__file__).resolve().parents[2]
LOG, LOCK = "log.txt", "training.lock"
SOURCES = ("agents", "baselines", "pam_envs")
PACKAGES = (
    *("numpy", "scipy", "numba", "gymnasium"),
    *("torch", "stable_baselines3", "sb3_contrib", "onnx"),
)


@dataclass(frozen=True)
class Training:
    """One training seed.

    Attributes
    ----------
    config : Config
    seed : int
    folder : Path
        Absolute. Workers of a cluster that share it continue from each other's checkpoints.
    """

    config: Config
    seed: int
    folder: Path

    @property
    def key(self) -> str:
        """Digest of settings, seed, folder, package versions and code.

        A worker with other code or packages computes another key and refuses the training.
        """
        parts = [self.config.as_dict(), self.seed, str(self.folder), versions_of(PACKAGES), code()]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:32]

    def finished(self) -> bool:
        """Return whether the folder holds the policy and its record.

        Raises
        ------
        SettingsError
            If the folder holds a policy of other settings.
        """
        card = finished(self.folder / POLICY)
        if card is None:
            return False
        if configs.from_mapping(card.get("config")) != self.config or card["seed"] != self.seed:
            raise SettingsError(
                f"{self.folder} holds a policy of other settings; give another --out"
            )
        return True


@cache
def code() -> str:
    """Return a digest of the Python files that a training runs, as first read by this process."""
    state = hashlib.sha256()
    for path in sorted(path for name in SOURCES for path in (ROOT / name).rglob("*.py")):
        state.update(path.relative_to(ROOT).as_posix().encode())
        state.update(path.read_bytes())
    return state.hexdigest()[:16]


def trainings(
    configurations: Sequence[Config], seeds: Sequence[int], out: Path, name: str
) -> list[Training]:
    """Return each configuration with each seed, in folders below ``out``.

    Parameters
    ----------
    configurations : sequence of Config
    seeds : sequence of int
    out : Path
    name : str
        Algorithm and variant, for example ``ppo-residual``.
    """
    return [
        Training(config, seed, out.resolve() / config.env.replace("/", "-") / f"{name}-seed{seed}")
        for config in configurations
        for seed in seeds
    ]


@dataclass
class Report:
    """Outcome of a sweep.

    Attributes
    ----------
    trained, found : list of Path
        Policies that were trained now, and before.
    missing : list of str
        Trainings without a policy, with the reason.
    """

    trained: list[Path] = field(default_factory=list)
    found: list[Path] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)


def run(
    trainings: Sequence[Training],
    cluster: engine.Cluster,
    start: Callable[[int], Callable[[], None]] = lambda total: lambda: None,
) -> Report:
    """Run the trainings that are not finished.

    Parameters
    ----------
    trainings : sequence of Training
    cluster : Cluster
    start : callable
        Called with the number of trainings; returns the function to call after each of them.
    """
    named = {training.key: training for training in trainings}
    left = {key: training for key, training in named.items() if not training.finished()}
    report = Report(found=[named[key].folder / POLICY for key in named if key not in left])
    advance = start(len(left))
    for done in engine.run(train, left.values(), cluster):
        folder = named[done.key].folder
        if done.error is None:
            _keep(folder, done.value)
            report.trained.append(folder / POLICY)
        else:
            report.missing.append(f"{folder}: {done.error}")
        advance()
    return report


def _keep(folder: Path, files: dict[str, bytes]) -> None:
    """Write the files of a worker that does not share this folder, the record first."""
    if finished(folder / POLICY) is not None:
        return
    folder.mkdir(parents=True, exist_ok=True)
    for name in (RECORD, POLICY):
        write_atomically(folder / name, files[name])


def train(training: Training) -> dict[str, bytes]:
    """Start or continue a training and return the policy's files; called in workers.

    A lock makes a second process that trains in the same folder wait and use its policy.
    """
    from rich.console import Console

    from agents.training.train import Run, train_to_the_end

    folder = training.folder
    folder.mkdir(parents=True, exist_ok=True)
    with FileLock(folder / LOCK), (folder / LOG).open("a", encoding="utf-8") as log:
        run = Run(training.config, training.seed, folder)
        train_to_the_end(run, Console(file=log, width=100))
        return {name: (folder / name).read_bytes() for name in (POLICY, RECORD)}
