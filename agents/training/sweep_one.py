"""One training of a sweep: ``python -m agents.training.sweep_one``, started by the sweep.

The first line of standard input says what to train. The input stays open as long as somebody
wants the policy: at its end, this process ends at once, whatever it is doing.
"""

from __future__ import annotations

import json
import os
import sys
import threading
from pathlib import Path
from typing import Any

LOCK = "training.lock"


def _end_with_input() -> None:
    os.read(sys.stdin.fileno(), 1)
    os._exit(3)


def main() -> int:
    """Train what standard input says, and return the exit status."""
    task = json.loads(_first_line())
    threading.Thread(target=_end_with_input, daemon=True).start()
    try:
        train(task)
    except ValueError as error:  # settings and checkpoints say what to do
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


def _first_line() -> bytes:
    """Return the first line and leave the rest, so that its end is noticed."""
    line = b""
    while not line.endswith(b"\n"):
        byte = os.read(sys.stdin.fileno(), 1)
        if not byte:
            os._exit(3)
        line += byte
    return line


def train(task: dict[str, Any]) -> None:
    """Train a task: settings, seed and folder.

    Only one process at a time works in a folder. Another one that is started for it waits, and
    finds the policy there.
    """
    from filelock import FileLock
    from rich.console import Console

    from agents.settings import presets as configs
    from agents.training.train import Run, train_to_the_end

    folder = Path(task["folder"])
    with FileLock(folder / LOCK):
        run = Run(configs.from_mapping(task["config"]), task["seed"], folder)
        train_to_the_end(run, Console(stderr=True, width=100))


if __name__ == "__main__":
    sys.exit(main())
