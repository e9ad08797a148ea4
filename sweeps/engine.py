"""Execution of many independent tasks that survives the loss of any worker.

A task is any object that pickles and has a ``key``, the digest of all inputs of its result.
Workers return results and only the caller stores them, so a killed worker leaves no partial file
and a cluster needs no common disk. Stored results are the checkpoint: a resumed run executes only
the missing tasks, with bit-identical results.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from sweeps.worker import Act, Done, Task


@dataclass(frozen=True)
class Cluster:
    """Backend of the computation.

    Attributes
    ----------
    jobs : int
        Processes of this machine; 1 computes in the calling process. Ignored by a Dask cluster.
    backend : {"loky", "dask"}
        Processes of this machine, or a running Dask cluster.
    address : str
        Of the Dask scheduler, for example ``tcp://host:8786``.
    """

    jobs: int = 1
    backend: str = "loky"
    address: str = ""

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
    """Execute all tasks and yield their outcomes in order of completion.

    An exception in ``act`` is the task's error. A task whose worker dies is repeated, and becomes
    an error if its worker dies every time.

    Parameters
    ----------
    act : callable
        Executes one task.
    tasks : iterable
        With distinct keys.
    cluster : Cluster
    """
    named = {task.key: task for task in tasks}
    if cluster.backend == "dask":
        from sweeps import dask_cluster

        return dask_cluster.run(act, named, cluster.address)
    if cluster.jobs == 1:
        from sweeps.worker import do

        return (do(act, task, key) for key, task in named.items())
    from sweeps import processes

    return processes.run(act, named, cluster.jobs)
