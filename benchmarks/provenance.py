"""What a result was made with: packages, sources, commit; and where and when."""

from __future__ import annotations

import datetime
import importlib.metadata
import platform
import socket
import subprocess
from functools import lru_cache
from pathlib import Path

from benchmarks.canonical import SOURCES, sources_digest

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("numpy", "scipy", "numba", "gymnasium", "onnxruntime")
SCORING = (
    "canonical.py",
    "cells.py",
    "controllers.py",
    "errors.py",
    "metrics.py",
    "metrics_elbow.py",
    "metrics_joint.py",
    "metrics_knee.py",
    "rollout.py",
    "artefacts.py",
    "knowledge.py",
    "making.py",
    "source_code.py",
    "traces.py",
)
"""Pages of this package that the record of a score depends on."""


@lru_cache(maxsize=1)
def packages() -> dict[str, str]:
    """Return the versions of Python and of the packages that a score may depend on."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found[name] = "absent"
    return found


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
    here = Path(__file__).parent
    kinds = {".py"} if code_only else SOURCES
    return {
        "pam_envs": sources_digest([ROOT / "pam_envs"]),
        package: sources_digest([ROOT / package], kinds),
        "benchmarks": sources_digest([here / name for name in SCORING]),
    }


@lru_cache(maxsize=1)
def cpu() -> str:
    """Return the kind of processor that numerical libraries choose their code by."""
    import llvmlite.binding

    return str(llvmlite.binding.get_host_cpu_name())


@lru_cache(maxsize=1)
def commit() -> str:
    """Return the checkout's commit, with ``+`` where files differ, or ``"unknown"``."""
    try:
        head = _git("rev-parse", "HEAD")
        # results are what a run writes: they do not make the checkout another one
        changed = _git("status", "--porcelain", "--", "pam_envs", "baselines", "agents")
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return head + ("+" if changed else "")


def _git(*arguments: str) -> str:
    command = ["git", "-C", str(ROOT), *arguments]
    done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=20)
    return done.stdout.strip()


def occasion() -> dict[str, str]:
    """Return where and when: never compared, never hashed."""
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    return {"date": now, "host": socket.gethostname(), "machine": platform.machine()}
