"""Progress line on standard error while kernels are compiled."""

import sys
import threading
import time
from typing import Any

PATIENCE = 2.0
"""Seconds of compilation before anything is shown."""


def announce(line: str) -> None:
    """Write one line to standard error."""
    print(f"pam-envs: {line}", file=sys.stderr, flush=True)


class Notice:
    """Message about a compilation that takes longer than ``PATIENCE``.

    A terminal shows the elapsed seconds; elsewhere there is one line at the start.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._over: threading.Event | None = None

    def begin(self, name: str) -> None:
        """Begin a compilation, possibly within another one."""
        self._depth += 1
        if self._depth == 1:
            self._over = threading.Event()
            arguments = (name, self._over)
            threading.Thread(target=_show, args=arguments, daemon=True).start()

    def end(self) -> None:
        """End a compilation."""
        self._depth -= 1
        if self._depth == 0 and self._over is not None:
            self._over.set()


def _show(name: str, over: Any) -> None:
    began = time.monotonic()
    if over.wait(PATIENCE):
        return
    line = f"compiling {name} (once on this machine; ten seconds to some minutes)"
    if not sys.stderr.isatty():
        announce(line)
        return
    while not over.wait(0.5):
        print(f"\rpam-envs: {line}: {time.monotonic() - began:.0f} s", end="", file=sys.stderr)
    print(f"\rpam-envs: compiled {name} in {time.monotonic() - began:.0f} s\033[K", file=sys.stderr)
