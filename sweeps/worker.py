"""What runs in a worker."""

from __future__ import annotations

import os
import sys
import threading
import time
from typing import Any

from sweeps.engine import Act, Done, Task

LOOK = 0.25
"""Seconds between two looks at whether somebody still waits for the result."""

_alone = threading.Lock()


def do(act: Act, task: Task, key: str) -> Done:
    """Do a task; an exception is returned as a sentence.

    A worker that has other sources or packages than the caller, or another kind of processor where
    that is part of a task's key, would give another result. It has another key for the task, and
    gives none.
    """
    try:
        if task.key != key:
            raise ValueError(
                "this worker has other sources, package versions or another processor than the one "
                "that asks; give both the same checkout, packages and kind of processor, start the "
                "workers anew, and the sweep again"
            )
        return Done(key, act(task))
    except Exception as error:
        return Done(key, error=f"{type(error).__name__}: {error}")


def do_in_cluster(act: Act, task: Task, key: str) -> Done:
    """As :func:`do`, one task at a time in a process, whatever number of threads it has.

    Compiled kernels, random numbers and caches of a process are for one thread.
    """
    with _alone:
        if wanted():
            done = do(act, task, key)
            if done.error is None or wanted():
                return done
    from distributed import Reschedule

    raise Reschedule  # should somebody wait after all, Dask gives the task out again


def wanted() -> bool:
    """Return whether somebody waits for what this thread does.

    A Dask worker is told when the caller is gone, and goes on with what it has begun. This lets
    long tasks end.
    """
    distributed = sys.modules.get("distributed")
    if distributed is None:
        return True
    try:
        worker = distributed.get_worker()
        held = worker.state.tasks.get(worker.get_current_task())
    except (ValueError, KeyError, AttributeError):  # no worker, or one of another version
        return True
    return held is not None and held.state not in ("cancelled", "released", "forgotten")


def end_with(driver: int) -> None:
    """Let this process end when the one that started it is gone.

    Called as a process of loky begins: a driver that is killed would leave it behind otherwise.
    """
    threading.Thread(target=_watch, args=(driver,), daemon=True).start()


def _watch(driver: int) -> None:
    while os.getppid() == driver:
        time.sleep(LOOK)
    os._exit(1)


def starter() -> tuple[Any, tuple[int]]:
    """Return what a process of this one has to call first, with its arguments."""
    return end_with, (os.getpid(),)
