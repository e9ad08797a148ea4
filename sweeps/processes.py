"""Tasks on processes of this machine, with joblib's loky backend.

When a process dies (killed, out of memory, a crash), joblib ends its whole pool. The tasks in
execution at that moment are then repeated, each alone, which identifies a task that kills its
process every time. The remaining tasks continue in parallel.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping

from sweeps.worker import Act, Done, Task, do, end_with

ATTEMPTS = 3
"""Attempts at a task whose process dies."""


def run(act: Act, tasks: Mapping[str, Task], jobs: int) -> Iterator[Done]:
    """Execute tasks on ``jobs`` processes."""
    left = dict(tasks)
    while left:
        started: list[str] = []
        for done in _round(act, left, jobs, started):
            left.pop(done.key)
            yield done
        for key in [key for key in started if key in left]:
            yield _alone(act, key, left.pop(key), jobs)


def _alone(act: Act, key: str, task: Task, jobs: int) -> Done:
    for _ in range(ATTEMPTS - 1):
        for done in _round(act, {key: task}, jobs, []):
            return done
    text = f"its worker died {ATTEMPTS} times; run it with --jobs 1 to see why"
    return Done(key, error=text, lost=True)


def _round(act: Act, tasks: Mapping[str, Task], jobs: int, started: list[str]) -> Iterator[Done]:
    """Execute tasks until all are done or a process dies; ``started`` gets their keys."""
    from joblib import Parallel, delayed, parallel_config
    from joblib.externals.loky.process_executor import BrokenProcessPool

    def handed_out() -> Iterator[tuple]:
        for key, task in list(tasks.items()):
            started.append(key)
            yield delayed(do)(act, task, key)

    driver = {"initializer": end_with, "initargs": (os.getpid(),)}
    with parallel_config("loky", inner_max_num_threads=1, **driver):
        # one task at a time per process, so that few are repeated when one dies
        parallel = Parallel(jobs, return_as="generator_unordered", batch_size=1, pre_dispatch=jobs)
        try:
            yield from parallel(handed_out())
        except BrokenProcessPool:
            return
