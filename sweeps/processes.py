"""Tasks on processes of this machine, with joblib's loky.

When a process dies (killed, out of memory, a crash), joblib ends its whole pool. The tasks that
were being done then are done again, each alone: those that are innocent succeed, and one that
kills its process every time is known by name. The others go on together.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from sweeps.engine import Act, Done, Task
from sweeps.worker import do, starter

ATTEMPTS = 3
"""How often a process may die of one task."""


def run(act: Act, tasks: Mapping[str, Task], jobs: int) -> Iterator[Done]:
    """Do tasks on ``jobs`` processes."""
    left = dict(tasks)
    while left:
        begun: list[str] = []
        for done in _round(act, left, jobs, begun):
            left.pop(done.key)
            yield done
        for key in [key for key in begun if key in left]:
            yield _alone(act, key, left.pop(key), jobs)


def _alone(act: Act, key: str, task: Task, jobs: int) -> Done:
    for _ in range(ATTEMPTS - 1):
        for done in _round(act, {key: task}, jobs, []):
            return done
    text = f"its worker died {ATTEMPTS} times; run it with --jobs 1 to see why"
    return Done(key, error=text, lost=True)


def _round(act: Act, tasks: Mapping[str, Task], jobs: int, begun: list[str]) -> Iterator[Done]:
    """Do tasks until all are done or a process dies; ``begun`` gets those that were handed out."""
    from joblib import Parallel, delayed, parallel_config
    from joblib.externals.loky.process_executor import BrokenProcessPool

    def handed_out() -> Iterator[tuple]:
        for key, task in list(tasks.items()):
            begun.append(key)
            yield delayed(do)(act, task, key)

    start, arguments = starter()
    with parallel_config("loky", inner_max_num_threads=1, initializer=start, initargs=arguments):
        # one task at a time for each process, so that few are in doubt when one dies
        parallel = Parallel(jobs, return_as="generator_unordered", batch_size=1, pre_dispatch=jobs)
        try:
            yield from parallel(handed_out())
        except BrokenProcessPool:
            return
