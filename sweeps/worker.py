"""Tasks, their outcomes, and their execution in a worker process."""

import os
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol


class Task(Protocol):
    """A unit of work."""

    @property
    def key(self) -> str:
        """Digest of all inputs of the result."""
        ...


Act = Callable[[Any], Any]
"""Executes a task in a worker: a function of a module that workers can import."""


@dataclass(frozen=True)
class Done:
    """Outcome of a task."""

    key: str
    value: Any = None  # return value of the function
    error: str | None = None  # reason for a missing value
    lost: bool = False  # whether the reason is that its workers died


LOOK = 0.25  # seconds between two checks that the driver is alive

_one_at_a_time = threading.Lock()


def do(act: Act, task: Task, key: str) -> Done:
    """Execute a task; an exception becomes the error of the result.

    A worker whose sources or packages differ from the caller's, or whose type of processor differs
    if the key depends on it, computes a different key for the task and refuses it.
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
    """Execute like :func:`do`, but one task at a time in a process with any number of threads.

    Compiled kernels, random numbers and caches of a process are not thread-safe.
    """
    with _one_at_a_time:
        if is_needed():
            done = do(act, task, key)
            if done.error is None or is_needed():
                return done
    from distributed import Reschedule

    raise Reschedule  # if the result is needed after all, Dask assigns the task again


def is_needed() -> bool:
    """Return whether the result of this thread's task is still needed.

    A Dask worker continues a task after its caller has ended. Long tasks call this and stop.
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
    """End this process when its driver has ended; loky calls this when it starts a process."""
    threading.Thread(target=_watch, args=(driver,), daemon=True).start()


def _watch(driver: int) -> None:
    while os.getppid() == driver:
        time.sleep(LOOK)
    os._exit(1)
