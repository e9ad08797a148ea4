"""Tasks on a running Dask cluster.

This uses Dask's own client. Its joblib backend waits forever for a task whose worker died too often
or cannot import the task's code (joblib 1.6).
"""

import sys
from asyncio import CancelledError
from collections.abc import Iterator, Mapping
from contextlib import suppress
from queue import Empty, SimpleQueue

from dask.distributed import Client, Future
from distributed.scheduler import KilledWorker

from sweeps.limits import scaled
from sweeps.worker import Act, Done, Task, do_in_cluster

SECONDS = 10.0  # timeout of the first connection

LOOK = 5.0  # seconds without a result after which the number of workers is checked


def run(act: Act, tasks: Mapping[str, Task], address: str) -> Iterator[Done]:
    """Execute tasks on the workers of the scheduler at ``address``.

    Dask assigns the tasks of a lost worker to others, and abandons a task after several workers
    died while executing it. Each of several abandoned tasks is repeated alone, since only one of
    them may be the cause. A ValueError says that no scheduler answers, or that it is lost.
    """
    with _client(address) as client:
        workers = _Workers(client, address)
        workers.check()
        given_up = []
        for done in _round(client, act, tasks, workers):
            if done.lost:
                given_up.append(done)
            else:
                yield done
        if len(given_up) == 1:
            yield given_up.pop()
        for done in given_up:
            yield from _round(client, act, {done.key: tasks[done.key]}, workers)


def _client(address: str) -> Client:
    try:
        return Client(address, timeout=scaled(SECONDS), set_as_default=False)
    except (OSError, ValueError) as error:
        raise ValueError(
            f"no Dask scheduler answers at {address!r} ({error}); start it and its workers by the "
            "commands of docs/sweeps.md, which listen on the loopback"
        ) from error


class _Workers:
    """Report once that the cluster has no worker, since Dask waits without a message."""

    def __init__(self, client: Client, address: str) -> None:
        self.client, self.address, self.reported = client, address, False

    def check(self) -> None:
        with suppress(OSError):  # the futures report a lost scheduler
            alone = not self.client.nthreads()
            if alone and not self.reported:
                print(
                    f"no worker is at {self.address}; waiting for one: `dask worker "
                    f"{self.address}` in a checkout adds one (Ctrl-C ends this; finished results "
                    "are kept)",
                    file=sys.stderr,
                )
            self.reported = alone


def _round(
    client: Client, act: Act, tasks: Mapping[str, Task], workers: _Workers
) -> Iterator[Done]:
    """Yield the outcomes of tasks in order of completion.

    Each task is awaited until its value arrives: if a worker dies after the task's end, the value
    is lost and the task is repeated. ``as_completed`` loses a task that then fails, and one whose
    value is in transit when the scheduler ends (distributed 2026.8).
    """
    found: SimpleQueue[Done | None] = SimpleQueue()

    async def follow(key: str, future: Future) -> None:
        try:
            found.put(await future)
        except (Exception, CancelledError) as error:
            done = Done(key, error=_sentence(error), lost=isinstance(error, KilledWorker))
            found.put(done if future.status == "error" else None)

    loop = client.loop
    assert loop is not None  # the client is connected
    for key, task in tasks.items():
        loop.add_callback(follow, key, client.submit(do_in_cluster, act, task, key, pure=False))
    for _ in tasks:
        done = _next(found, workers)
        if done is None:
            raise ValueError(
                "the Dask scheduler went away; what was done is kept: start again when it is back"
            )
        yield done


def _next(found: SimpleQueue[Done | None], workers: _Workers) -> Done | None:
    while True:
        try:
            done = found.get(timeout=LOOK)
        except Empty:
            workers.check()
        else:
            workers.reported = False
            return done


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
