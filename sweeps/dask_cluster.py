"""Tasks on a running Dask cluster.

Dask is spoken to directly. Its joblib backend waits for ever where a task has no result: its
worker died too often, or cannot import what it is given (joblib 1.6).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping

from dask.distributed import Client, as_completed
from distributed.scheduler import KilledWorker

from sweeps.engine import Act, Done, Task
from sweeps.worker import do_in_cluster

SECONDS = 10.0
"""How long the scheduler has for its first answer."""


def run(act: Act, tasks: Mapping[str, Task], address: str) -> Iterator[Done]:
    """Do tasks on the workers of the scheduler at ``address``.

    Dask gives the tasks of a lost worker to others, and gives a task up when several workers have
    died with it. Where that are more than one, a task may only have been beside the one that did
    it: each is tried again, alone.

    Raises
    ------
    ValueError
        If no scheduler answers, or it goes away.
    """
    with _client(address) as client:
        if not client.nthreads():
            print(f"no worker is at {address} yet; waiting for one", file=sys.stderr)
        given_up = []
        for done in _round(client, act, tasks):
            if done.lost:
                given_up.append(done)
            else:
                yield done
        if len(given_up) == 1:
            yield given_up.pop()
        for done in given_up:
            yield from _round(client, act, {done.key: tasks[done.key]})


def _client(address: str) -> Client:
    try:
        return Client(address, timeout=SECONDS, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ValueError(
            f"no Dask scheduler answers at {address!r} ({error}); start one with `dask scheduler`, "
            "and workers in a checkout with `dask worker ADDRESS --nworkers 2 --nthreads 1`"
        ) from error


def _round(client: Client, act: Act, tasks: Mapping[str, Task]) -> Iterator[Done]:
    """Return what became of tasks, as they are done."""
    keys = {
        client.submit(do_in_cluster, act, task, key, pure=False): key for key, task in tasks.items()
    }
    finished = as_completed(list(keys), client.loop, with_results=True, raise_errors=False)
    for future, result in finished:
        key = keys.pop(future)
        if future.status == "finished":
            yield result
        elif future.status == "error":
            error = result[1]
            yield Done(key, error=_sentence(error), lost=isinstance(error, KilledWorker))
        else:
            raise ValueError(
                "the Dask scheduler went away; what was done is kept: start again when it is back"
            )


def _sentence(error: BaseException) -> str:
    if isinstance(error, KilledWorker):
        return "its worker died again and again; run it with --jobs 1 to see why"
    causes = [error]
    while (cause := causes[-1].__cause__) is not None:
        causes.append(cause)
    text = "; ".join(f"{type(cause).__name__}: {cause}" for cause in causes)
    if any(isinstance(cause, ImportError) for cause in causes):
        text += "; start `dask worker` in the checkout, with its packages (PYTHONPATH=.)"
    return text
