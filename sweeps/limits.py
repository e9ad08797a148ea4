"""Time limits that grow with the load of the machine.

A limit detects a hang. On a busy or slow machine the same work takes longer without hanging.
"""

import os
import time

REFERENCE = 0.012
"""Seconds of :func:`_work` on the machine for which limits are given, alone on a core."""
LASTS = 20.0
_measured: list[float] = []
"""Time of the last measurement, and the factor that it gave."""


def scaled(seconds: float) -> float:
    """Return a time limit for this machine and its present load: never less than ``seconds``."""
    return seconds * slowness()


def slowness() -> float:
    """Return by which factor work takes longer here and now than on the reference, at least 1.

    The larger of the time of a piece of work, measured anew after ``LASTS`` seconds, and of the
    processes per core that run or wait for one.
    """
    begin = time.perf_counter()
    if not _measured or begin - _measured[0] > LASTS:
        _work()
        _measured[:] = begin, (time.perf_counter() - begin) / REFERENCE
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    return max(1.0, _measured[1], load / (os.cpu_count() or 1))


def _work() -> int:
    return sum(number * number % 7 for number in range(200_000))
