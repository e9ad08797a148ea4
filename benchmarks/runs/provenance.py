"""Provenance of a result: packages, commit, processor, place and time."""

import datetime
import platform
import socket
import subprocess
from functools import lru_cache
from pathlib import Path

from benchmarks.identity.hashing import digest
from sweeps.files import SOURCES, sources_digest
from sweeps.limits import scaled
from sweeps.versions import versions_of

HERE = Path(__file__).resolve().parents[1]
ROOT = HERE.parent
CODE = (
    *("pam_envs", "sweeps", "baselines", "agents", "benchmarks"),
    *(f":(exclude)benchmarks/{name}" for name in ("results", "leaderboard", "site", "rounds.json")),
    ":(exclude)benchmarks/LEADERBOARD.md",
)
"""Paths that affect results, without those written by a run."""
PACKAGES = ("numpy", "scipy", "numba", "gymnasium", "onnxruntime")
RUNNING = ("identity", "runs", "scenarios", "scoring")
"""Folders of this package that compute scores."""


@lru_cache(maxsize=1)
def packages() -> dict[str, str]:
    """Return the versions of Python and of the packages that a score may depend on."""
    return versions_of(PACKAGES)


@lru_cache(maxsize=1)
def sources() -> str:
    """Return a digest of all code and data that compute scores.

    It names the cells of this machine's checkpoint, never a result: a cell is computed again after
    any change of code, even one that the fixed inputs do not reveal.
    """
    folders = [ROOT / "pam_envs", ROOT / "baselines", *(HERE / name for name in RUNNING)]
    return digest([sources_digest(folders), sources_digest([ROOT / "agents"], SOURCES & {".py"})])


@lru_cache(maxsize=1)
def cpu() -> str:
    """Return the type of processor, by which numerical libraries select their code."""
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
    """Return the files of code and scenarios that differ from the last commit of a checkout."""
    said = git("status", "--porcelain", "--untracked-files=all", "--", *CODE, folder=folder)
    return [line[2:].strip() for line in said.splitlines()]


def git(*arguments: str, folder: Path = ROOT) -> str:
    """Return the output of git in a folder."""
    command = ["git", "-C", str(folder), *arguments]
    done = subprocess.run(command, check=True, capture_output=True, timeout=scaled(20.0))
    return done.stdout.decode().strip()


def occasion() -> dict[str, str]:
    """Return place and time: never compared, never hashed."""
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    return {"date": now, "host": socket.gethostname(), "machine": platform.machine()}
