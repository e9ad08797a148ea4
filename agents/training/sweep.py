"""Several training seeds in parallel, on this machine or a Dask cluster.

A finished training is kept, and a killed one continues from its checkpoint. The policies are those
of ``python -m agents train``, bit for bit.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from filelock import FileLock

from agents.policies.policy_file import POLICY, RECORD, finished
from agents.settings.presets import Config
from agents.training.record import LOCK, Run
from pam_envs.files import write_bytes
from sweeps import engine

LOG = "log.txt"


def trainings(
    configurations: Sequence[Config],
    seeds: Sequence[int],
    out: Path,
    name: str,
    device: str = "cpu",
) -> list[Run]:
    """Return each configuration with each seed, in folders ``name``-seed below ``out``."""
    return [
        Run(config, seed, folder_of(out.resolve(), config.env, name, seed), device)
        for config in configurations
        for seed in seeds
    ]


def folder_of(root: Path, env: str, name: str, seed: int) -> Path:
    """Return ``<root>/<environment>/<algorithm>[-<variant>]-seed<seed>``."""
    return root / env.replace("/", "-") / f"{name}-seed{seed}"


@dataclass
class Report:
    """Outcome of a sweep: policies trained now and before, and why others are missing."""

    trained: list[Path] = field(default_factory=list)
    found: list[Path] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)


def run(
    trainings: Sequence[Run],
    cluster: engine.Cluster,
    start: Callable[[int], Callable[[], None]] = lambda total: lambda: None,
) -> Report:
    """Run the unfinished trainings; ``start`` takes their number and returns a callback."""
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
    for name in (RECORD, POLICY):
        write_bytes(folder / name, files[name])


def train(run: Run) -> dict[str, bytes]:
    """Start or continue a training and return the policy's files; called in workers.

    A lock makes a second process that trains in the same folder wait and use its policy.
    """
    from rich.console import Console

    from agents.training.train import train_to_the_end

    run.folder.mkdir(parents=True, exist_ok=True)
    with FileLock(run.folder / LOCK), (run.folder / LOG).open("a", encoding="utf-8") as log:
        train_to_the_end(run, Console(file=log, width=100))
        return {name: (run.folder / name).read_bytes() for name in (POLICY, RECORD)}
