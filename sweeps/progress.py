"""What a sweep says while it runs: a bar on a terminal, now and then a line elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
)
from rich.text import Text

LINE_SECONDS = 60.0

Advance = Callable[[], None]
Start = Callable[[int], Advance]


def left(elapsed: float | None, done: float, total: float | None) -> str:
    """Return the time that is left, at the rate since the beginning: ``about 1:02:03``."""
    if elapsed is None or not done or total is None:
        return "?"
    seconds = round(elapsed / done * (total - done))
    return f"about {seconds // 3600}:{seconds // 60 % 60:02}:{seconds % 60:02}"


class _Left(ProgressColumn):
    """Rich's own column looks at the last half minute, in which a long task advances nothing."""

    def render(self, task: Task) -> Text:
        return Text(left(task.elapsed, task.completed, task.total))


@contextmanager
def progress(title: str, console: Console | None = None) -> Iterator[Start]:
    """Show how many tasks are done and the time left, and hand out what starts the count.

    Parameters
    ----------
    title : str
        What the tasks are, in the plural.
    console : Console, optional
        Standard error by default.
    """
    out = console or Console(stderr=True)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        _Left(),
    )
    with Progress(*columns, console=out, disable=not out.is_terminal) as bar:

        def start(total: int) -> Advance:
            task = bar.add_task(title, total=total)
            return (lambda: bar.advance(task)) if out.is_terminal else _lines(title, total, out)

        yield start


def _lines(title: str, total: int, out: Console) -> Advance:
    """Return what counts, and says so in a line from time to time."""
    began = said = time.monotonic()
    done = 0

    def advance() -> None:
        nonlocal done, said
        done += 1
        now = time.monotonic()
        if now - said >= LINE_SECONDS or done == total:
            said = now
            out.print(f"{title}: {done} of {total}, left: {left(now - began, done, total)}")

    return advance
