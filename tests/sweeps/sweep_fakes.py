"""Tasks that succeed, fail or kill their workers."""

import os
import signal
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from sweeps.limits import scaled
from sweeps.worker import is_needed


@dataclass(frozen=True)
class Number:
    """A number to be squared.

    ``kind`` says what happens on the way; ``folder`` is where it leaves a mark that it began.
    """

    number: int
    kind: str = ""
    folder: str = ""

    @property
    def key(self) -> str:
        """Name of the task; ``foreign`` ones have another in every process."""
        return f"{self.number}{os.getpid() if self.kind == 'foreign' else ''}"

    @property
    def mark(self) -> Path:
        """File with a line for each time that the task was begun."""
        return Path(self.folder) / f"begun_{self.number}"

    def begins(self) -> int:
        """Return how often the task was begun."""
        return len(self.mark.read_text().split()) if self.mark.exists() else 0


def square(task: Number) -> int:
    """Return the square, unless something comes between."""
    with task.mark.open("a") as file:
        file.write(f"{os.getpid()}\n")
    if task.kind == "deadly" or (task.kind == "deadly once" and task.begins() == 1):
        os.kill(os.getpid(), signal.SIGKILL)
    if task.kind == "dies with its value" and task.begins() == 1:
        threading.Timer(0.02, os.kill, (os.getpid(), signal.SIGKILL)).start()
    if task.kind == "wrong":
        raise ValueError(f"{task.number} has no square")
    if task.kind == "slow":
        time.sleep(0.3)
    if task.kind == "endless":
        until = time.monotonic() + scaled(60.0)
        while is_needed() and time.monotonic() < until:
            time.sleep(0.05)
        (Path(task.folder) / f"ended_{task.number}").write_text("")
    return task.number**2
