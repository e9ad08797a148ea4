"""Run many tasks, and lose nothing when a worker is lost.

A task is anything that pickles and has a ``key``, the digest of all that its result depends on.
Workers compute and hand back; only the caller keeps results, so that no half-written file, no
orphan and no cluster without a common disk can do harm. What a caller has kept is its checkpoint:
it asks again for the tasks that are missing, and gets the same bits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

BACKENDS = ("loky", "dask")


class Task(Protocol):
    """Something to do."""

    @property
    def key(self) -> str:
        """Digest of all that the result depends on."""
        ...


Act = Callable[[Any], Any]
"""What is done with a task in a worker: a function of a module that workers can import."""


@dataclass(frozen=True)
class Done:
    """What became of a task.

    Attributes
    ----------
    key : str
    value : object
        What the function returned.
    error : str, optional
        Why there is no value.
    lost : bool
        Whether that is because its workers died.
    """

    key: str
    value: Any = None
    error: str | None = None
    lost: bool = False


@dataclass(frozen=True)
class Cluster:
    """Where to compute.

    Attributes
    ----------
    jobs : int
        Processes of this machine; 1 computes in this one. A Dask cluster has its own number.
    backend : {"loky", "dask"}
        Processes of this machine, or a running Dask cluster.
    address : str
        Of the Dask scheduler, like ``tcp://host:8786``.
    """

    jobs: int = 1
    backend: str = "loky"
    address: str = ""

    def __post_init__(self) -> None:
        """Refuse what cannot be meant."""
        if self.backend not in BACKENDS:
            raise ValueError(
                f"backend = {self.backend!r}; choose {' or '.join(map(repr, BACKENDS))}"
            )
        if self.jobs < 1:
            raise ValueError(f"jobs = {self.jobs} is below 1; give a number of processes")
        if (self.backend == "dask") != bool(self.address):
            raise ValueError(
                f"backend = {self.backend!r} with address = {self.address!r}; a Dask cluster needs "
                "both --backend dask and --address, the address that `dask scheduler` prints"
            )


def run(act: Act, tasks: Iterable[Task], cluster: Cluster) -> Iterator[Done]:
    """Do all tasks and return them as they are done, in any order.

    An exception in ``act`` is that task's error. A task whose worker dies is done again; one
    whose worker dies every time is an error, too.

    Parameters
    ----------
    act : callable
        Does one task.
    tasks : iterable
        With keys of their own.
    cluster : Cluster
    """
    named = {task.key: task for task in tasks}
    if cluster.backend == "dask":
        from sweeps import dask_cluster

        return dask_cluster.run(act, named, cluster.address)
    if cluster.jobs == 1:
        return _here(act, named)
    from sweeps import processes

    return processes.run(act, named, cluster.jobs)


def _here(act: Act, tasks: dict[str, Task]) -> Iterator[Done]:
    from sweeps.worker import do

    for key, task in tasks.items():
        yield do(act, task, key)
