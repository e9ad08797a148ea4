"""Kill of programs, and their child processes."""

import os
import subprocess
import sys
import time
import uuid
from collections.abc import Callable
from pathlib import Path

import psutil

from sweeps.limits import scaled

ROOT = Path(__file__).resolve().parents[2]
MARK = "PAM_ENVS_TEST_FAMILY"


def environment(family: str, *paths: Path) -> dict[str, str]:
    """Return the environment of a program: all its descendants carry ``family``."""
    found = os.pathsep.join(map(str, (ROOT, *paths)))
    fixed = {"PYTHONPATH": found, "OMP_NUM_THREADS": "1", MARK: family}
    return {**os.environ, **fixed}


def new_family() -> str:
    """Return a name that no other program has."""
    return uuid.uuid4().hex


def start(
    family: str, *arguments: str, paths: tuple[Path, ...] = (), log: str | Path = os.devnull
) -> subprocess.Popen[bytes]:
    """Start Python with arguments."""
    with open(log, "ab") as file:
        return subprocess.Popen(
            [sys.executable, *arguments],
            cwd=ROOT,
            env=environment(family, *paths),
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=file,
        )


def alive(family: str, word: str = "") -> list[psutil.Process]:
    """Return the processes of a family that still run, with ``word`` in their command lines."""
    found = []
    for process in psutil.process_iter():
        try:
            ours = process.environ().get(MARK) == family and word in " ".join(process.cmdline())
            if ours and process.status() != psutil.STATUS_ZOMBIE:
                found.append(process)
        except (psutil.NoSuchProcess, psutil.AccessDenied):  # a zombie, too, is none such
            continue
    return found


def wait_until(true: Callable[[], object], seconds: float = 300.0) -> None:
    """Wait for something to become true; fail where it does not."""
    until = time.monotonic() + scaled(seconds)
    while not true():
        assert time.monotonic() < until, "it did not come about"
        time.sleep(0.01)
