"""Training seeds side by side: each in a process of its own, on this machine or a Dask cluster.

A training whose policy is there is left alone; one whose process was killed goes on from its
checkpoint. The policies are those that ``python -m agents train`` gives, bit for bit.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from agents.policies.policy_file import POLICY, RECORD, finished, write_atomically
from agents.settings import presets as configs
from agents.settings.presets import Config
from agents.settings.settings import SettingsError
from agents.training import sources
from sweeps import engine
from sweeps.versions import versions_of
from sweeps.worker import LOOK, wanted

ROOT = Path(__file__).resolve().parents[2]
LOG = "log.txt"
ATTEMPTS = 3
"""How often the process of a training may be killed."""
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
        Absolute. The workers of a cluster that see it go on from each other's checkpoints.
    """

    config: Config
    seed: int
    folder: Path

    @property
    def key(self) -> str:
        """Digest of what decides the policy: settings, seed, sources and package versions."""
        code = sources.digests()
        parts = [self.config.as_dict(), self.seed, str(self.folder), versions(), code]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:32]

    def finished(self) -> bool:
        """Return whether the policy is there, with its record.

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


def trainings(
    wanted: Sequence[Config], seeds: Sequence[int], out: Path, name: str
) -> list[Training]:
    """Return every settings with every seed, each in its folder below ``out``.

    Parameters
    ----------
    wanted : sequence of Config
    seeds : sequence of int
    out : Path
    name : str
        Algorithm and variant, like ``ppo-residual``.
    """
    return [
        Training(config, seed, out.resolve() / config.env.replace("/", "-") / f"{name}-seed{seed}")
        for config in wanted
        for seed in seeds
    ]


def versions() -> dict[str, str]:
    """Return what a policy's bits may depend on besides its settings."""
    return versions_of(PACKAGES)


@dataclass
class Report:
    """What a sweep did.

    Attributes
    ----------
    trained, found : list of Path
        Policies that were made now, and that were there already.
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
    """Train what is missing.

    Parameters
    ----------
    trainings : sequence of Training
    cluster : Cluster
    start : callable
        Called with the number of trainings to do; returns what to call after each of them.
    """
    there = {training.key: training.finished() for training in trainings}
    named = {training.key: training for training in trainings}
    report = Report(found=[named[key].folder / POLICY for key in named if there[key]])
    left = [training for key, training in named.items() if not there[key]]
    advance = start(len(left))
    for done in engine.run(train, left, cluster):
        training = named[done.key]
        if done.error is None:
            _keep(training.folder, done.value)
            report.trained.append(training.folder / POLICY)
        else:
            report.missing.append(f"{training.folder}: {done.error}")
        advance()
    return report


def _keep(folder: Path, files: dict[str, bytes]) -> None:
    """Write a policy that was made where this folder is not seen, its record first."""
    if finished(folder / POLICY) is not None:
        return
    folder.mkdir(parents=True, exist_ok=True)
    for name in (RECORD, POLICY):
        write_atomically(folder / name, files[name])


def train(training: Training) -> dict[str, bytes]:
    """Train in a process of its own and return the policy's files; called in workers.

    Raises
    ------
    RuntimeError
        If there is no policy in the end, with the last words of the log.
    """
    training.folder.mkdir(parents=True, exist_ok=True)
    for _ in range(ATTEMPTS):
        code = _process(training)
        if code == 0:
            return {name: (training.folder / name).read_bytes() for name in (POLICY, RECORD)}
        if code > 0:
            break
    else:
        raise RuntimeError(f"its process was killed {ATTEMPTS} times (signal {-code})")
    log = (training.folder / LOG).read_text(encoding="utf-8", errors="replace").splitlines()
    raise RuntimeError(log[-1] if log else f"its process ended with {code}")


def _process(training: Training) -> int:
    """Run the process of a training to its end; it ends, too, when this one does.

    Its standard input stays open as long as somebody waits for the policy.
    """
    task = {"config": training.config.as_dict(), "seed": training.seed}
    line = json.dumps(task | {"folder": str(training.folder)}) + "\n"
    with (training.folder / LOG).open("ab") as log:
        child = subprocess.Popen(
            [sys.executable, "-m", "agents.training.sweep_one"],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=log,
            stderr=log,
        )
    with child:
        try:
            assert child.stdin is not None
            with suppress(BrokenPipeError):  # killed as it began
                child.stdin.write(line.encode())
                child.stdin.flush()
            while (code := _ended(child)) is None:
                if not wanted():
                    raise RuntimeError("nobody waits for it")
        finally:
            child.kill()
    return code


def _ended(child: subprocess.Popen[bytes]) -> int | None:
    try:
        return child.wait(LOOK)
    except subprocess.TimeoutExpired:
        return None
