"""Execution of many independent tasks that survives the loss of any worker.

A task is any object that pickles and has a ``key``, the digest of all inputs of its result.
Workers return results and only the caller stores them, so a killed worker leaves no partial file
and a cluster needs no common disk. Stored results are the checkpoint: a resumed run executes only
the missing tasks, with bit-identical results.

When a process of this machine dies (killed, out of memory, a crash), joblib ends its whole pool.
The tasks in execution at that moment are then repeated, each alone, which identifies a task that
kills its process every time. The remaining tasks continue in parallel.
"""

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from sweeps.worker import Act, Done, Task, do, end_with

ATTEMPTS = 3  # attempts at a task whose process dies


def run_processes(act: Act, tasks: Mapping[str, Task], jobs: int) -> Iterator[Done]:
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


@dataclass(frozen=True)
class Cluster:
    """Backend of the computation."""

    jobs: int = 1  # processes; 1 computes in the calling process; ignored by a Dask cluster
    backend: str = "loky"  # "loky", processes of this machine, or "dask", a running cluster
    address: str = ""  # of the Dask scheduler, for example tcp://host:8786

    def __post_init__(self) -> None:
        """Refuse contradictory arguments."""
        if self.backend not in ("loky", "dask"):
            raise ValueError(f"backend = {self.backend!r}; choose 'loky' or 'dask'")
        if self.jobs < 1:
            raise ValueError(f"jobs = {self.jobs} is below 1; give a number of processes")
        if (self.backend == "dask") != bool(self.address):
            raise ValueError(
                f"backend = {self.backend!r} with address = {self.address!r}; a Dask cluster needs "
                "both --backend dask and --address, the address that `dask scheduler` prints"
            )


def run(act: Act, tasks: Iterable[Task], cluster: Cluster) -> Iterator[Done]:
    """Execute tasks with distinct keys; yield their outcomes, errors too, as they complete."""
    named = {task.key: task for task in tasks}
    if cluster.backend == "dask":
        from sweeps import dask_cluster

        return dask_cluster.run(act, named, cluster.address)
    if cluster.jobs == 1:
        return (do(act, task, key) for key, task in named.items())
    return run_processes(act, named, cluster.jobs)
