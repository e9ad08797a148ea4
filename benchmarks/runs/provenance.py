"""What a result was made with: packages, sources, commit; and where and when."""

from __future__ import annotations

import datetime
import platform
import socket
import subprocess
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from benchmarks.identity.hashing import SOURCES, sources_digest
from sweeps.versions import versions_of

HERE = Path(__file__).resolve().parents[1]
ROOT = HERE.parent
CODE = (
    *("pam_envs", "sweeps", "baselines", "agents", "benchmarks"),
    *(f":(exclude)benchmarks/{name}" for name in ("results", "site", "rounds.json")),
    ":(exclude)benchmarks/LEADERBOARD.md",
)
"""What makes results, as git names it: all but what a run writes."""
PACKAGES = ("numpy", "scipy", "numba", "gymnasium", "onnxruntime")
METRICS = tuple(("scoring/elbow.py", "scoring/joint.py", "scoring/knee.py", "scoring/metrics.py"))
SCORING = (
    "identity/hashing.py",
    "runs/cells.py",
    "runs/controllers.py",
    "scoring/errors.py",
    "runs/rollout.py",
    "scenarios/scenario.py",
    "identity/artefacts.py",
    "runs/knowledge.py",
    "scenarios/scenario_env.py",
    "identity/source_code.py",
    "runs/traces.py",
    "identity/trainings.py",
    *METRICS,
)
"""Pages of this package that the record of a score depends on."""
NAMED = 5
"""Files that a sentence names at most."""


@lru_cache(maxsize=1)
def packages() -> dict[str, str]:
    """Return the versions of Python and of the packages that a score may depend on."""
    return versions_of(PACKAGES)


@lru_cache(maxsize=8)
def sources(package: str, code_only: bool = False) -> dict[str, str]:
    """Return digests of the code and data that a score of a controller depends on.

    Parameters
    ----------
    package : str
        The controller's own package.
    code_only : bool
        Leave the package's data out: policies, whose own files are named one by one.
    """
    kinds = {".py"} if code_only else SOURCES
    return {
        "pam_envs": sources_digest([ROOT / "pam_envs"]),
        package: sources_digest([ROOT / package], kinds),
        "benchmarks": sources_digest([HERE / name for name in SCORING]),
    }


@lru_cache(maxsize=1)
def cpu() -> str:
    """Return the kind of processor that numerical libraries choose their code by."""
    import llvmlite.binding

    return str(llvmlite.binding.get_host_cpu_name())


@lru_cache(maxsize=1)
def commit() -> str:
    """Return the checkout's commit, with ``+`` where code differs, or ``"unknown"``."""
    try:
        return git("rev-parse", "HEAD") + ("+" if changed() else "")
    except (OSError, subprocess.SubprocessError):
        return "unknown"


def changed(folder: Path = ROOT) -> list[str]:
    """Return the files of code and scenarios that are not as in the last commit.

    Raises
    ------
    OSError, subprocess.SubprocessError
        If the folder is not a git checkout, or there is no git.
    """
    said = git("status", "--porcelain", "--untracked-files=all", "--", *CODE, folder=folder)
    return [line[2:].strip() for line in said.splitlines()]


def listed(names: Sequence[str]) -> str:
    """Return the first of some files' names, and how many more there are."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more


def git(*arguments: str, folder: Path = ROOT) -> str:
    """Return what git says in a folder."""
    return git_bytes(*arguments, folder=folder).decode().strip()


def git_bytes(*arguments: str, folder: Path = ROOT) -> bytes:
    """Return what git says in a folder, as it is."""
    command = ["git", "-C", str(folder), *arguments]
    return subprocess.run(command, check=True, capture_output=True, timeout=20).stdout


def occasion() -> dict[str, str]:
    """Return where and when: never compared, never hashed."""
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    return {"date": now, "host": socket.gethostname(), "machine": platform.machine()}
