"""A scheduler and workers as processes of this machine, started as a user starts them."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from types import TracebackType
from typing import Self

import psutil

from tests.sweeps.processes_of import alive, new_family, start, wait_until


class DaskProcesses:
    """A Dask cluster; ``folder`` gets its files, ``paths`` are what its workers can import."""

    def __init__(self, folder: Path, *paths: Path, workers: int = 2) -> None:
        self.family = new_family()
        self.file = folder / "scheduler.json"
        self.own = ("--no-dashboard", "--scheduler-file", str(self.file))
        scheduler = (
            "-m",
            "distributed.cli.dask_scheduler",
            "--host",
            "127.0.0.1",
            "--port",
            "0",
            *self.own,
        )
        self.scheduler = start(self.family, *scheduler, paths=paths)
        try:
            wait_until(self._says_where)
        except BaseException:
            self.scheduler.kill()
            self.scheduler.wait()
            raise
        self.address = str(json.loads(self.file.read_text())["address"])
        self.paths, self.folder = paths, folder
        self.nannies = self.join(workers)

    def _says_where(self) -> bool:
        """Tell whether the file is whole: it is there, empty, before the scheduler fills it."""
        try:
            json.loads(self.file.read_text())
        except (FileNotFoundError, json.JSONDecodeError):
            return False
        return True

    def join(self, workers: int, threads: int = 1) -> subprocess.Popen[bytes]:
        """Start workers."""
        place = ("--local-directory", str(self.folder), "--nthreads", str(threads))
        command = ("-m", "distributed.cli.dask_worker", *self.own, *place)
        return start(self.family, *command, "--nworkers", str(workers), paths=self.paths)

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
        for process in (self.nannies, self.scheduler):
            process.kill()
            process.wait()
        for process in alive(self.family):
            process.kill()
        wait_until(lambda: not alive(self.family))
