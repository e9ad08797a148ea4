"""A scheduler and workers as processes of this machine, started as a user starts them."""

import json
import os
import subprocess
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import psutil

from tests.sweeps.processes_of import alive, new_family, start, wait_until


def _state(dask_worker: Any) -> str:
    """Return how a nanny is; Dask gives it as this argument."""
    return str(dask_worker.status.name)


class DaskProcesses:
    """A Dask cluster; ``folder`` gets its files, ``paths`` are what its workers can import."""

    def __init__(self, folder: Path, *paths: Path, workers: int = 2) -> None:
        self.family = new_family()
        self.file = folder / "scheduler.json"
        place = ("--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0")
        self.own = (*place, "--scheduler-file", str(self.file))
        scheduler = ("-m", "distributed.cli.dask_scheduler", "--port", "0", *self.own)
        self.scheduler = start(self.family, *scheduler, paths=paths)
        try:
            wait_until(self._says_where)
        except BaseException:
            self.scheduler.kill()
            self.scheduler.wait()
            raise
        self.address = str(json.loads(self.file.read_text())["address"])
        self.paths, self.folder = paths, folder
        self.nannies: list[subprocess.Popen[bytes]] = []
        self.join(workers)
        try:
            wait_until(lambda: self._settled() == workers)
        except BaseException:
            self.__exit__()
            raise

    def _settled(self) -> int:
        """Return how many workers may be killed: their nannies know that they have begun.

        A worker that dies in the twentieth of a second before that takes its nanny with it, the
        nanny `dask worker`, and that all other workers (distributed 2026.8).
        """
        from distributed import Client

        with Client(self.address, set_as_default=False) as client:
            states = client.run(_state, nanny=True, on_error="ignore")
        return sum(state == "running" for state in states.values())

    def _says_where(self) -> bool:
        """Tell whether the file is whole: it is there, empty, before the scheduler fills it."""
        try:
            json.loads(self.file.read_text())
        except (FileNotFoundError, json.JSONDecodeError):
            return False
        return True

    def join(self, workers: int, threads: int = 1) -> None:
        """Start workers."""
        place = ("--local-directory", str(self.folder), "--nthreads", str(threads))
        command = ("-m", "distributed.cli.dask_worker", *self.own, *place)
        given = (*command, "--nworkers", str(workers))
        self.nannies.append(start(self.family, *given, paths=self.paths))

    def end_workers(self) -> None:
        """End all workers, and what would start them again."""
        workers = self.workers()
        for process in self.nannies:
            process.kill()
            process.wait()
        for process in workers:
            with suppress(psutil.NoSuchProcess):  # a nanny's end may have ended it
                process.kill()

    def workers(self) -> list[psutil.Process]:
        """Return the processes that compute."""
        from distributed import Client

        with Client(self.address, set_as_default=False) as client:
            return [psutil.Process(number) for number in client.run(os.getpid).values()]

    def __enter__(self) -> Self:
        """Return the cluster."""
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        """End all its processes."""
        for process in (*self.nannies, self.scheduler):
            process.kill()
            process.wait()
        for process in alive(self.family):
            with suppress(psutil.NoSuchProcess):
                process.kill()
        wait_until(lambda: not alive(self.family))
