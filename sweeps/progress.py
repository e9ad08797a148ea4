"""Progress of long tasks: a bar on a terminal, otherwise one line per minute."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol

from rich import progress as bars
from rich.console import Console
from rich.text import Text

LINE_SECONDS = 60.0


class Advance(Protocol):
    """Count completed tasks and show a note beside the count."""

    def __call__(self, count: int = 1, note: str = "") -> None:
        """Add ``count`` completed tasks."""
        ...


Start = Callable[..., Advance]
"""``start(total, done=0)`` begins the count at ``done`` and returns what advances it."""


def unnoticed(total: int, done: int = 0) -> Advance:
    """Start a count that is not shown."""

    def advance(count: int = 1, note: str = "") -> None:
        return None

    return advance


def left(elapsed: float | None, done: float, total: float | None) -> str:
    """Return the remaining time at the mean rate so far: ``about 1:02:03``."""
    if elapsed is None or not done or total is None:
        return "?"
    seconds = round(elapsed / done * (total - done))
    return f"about {seconds // 3600}:{seconds // 60 % 60:02}:{seconds % 60:02}"


class _Left(bars.ProgressColumn):
    """Remaining time; Rich's own column uses the last 30 s, too few for long tasks."""

    def render(self, task: bars.Task) -> Text:
        before = task.fields["before"]
        total = None if task.total is None else task.total - before
        return Text(left(task.elapsed, task.completed - before, total) + task.fields["note"])


@contextmanager
def progress(title: str, console: Console | None = None) -> Iterator[Start]:
    """Show share done and remaining time of tasks; yield the function that starts the count."""
    out = console or Console(stderr=True)
    columns = (
        bars.TextColumn("{task.description}"),
        bars.BarColumn(),
        bars.MofNCompleteColumn(),
        bars.TimeElapsedColumn(),
        bars.TextColumn("left"),
        _Left(),
    )
    with bars.Progress(*columns, console=out, disable=not out.is_terminal) as bar:

        def start(total: int, done: int = 0) -> Advance:
            if not out.is_terminal:
                return _lines(title, total, out, done)
            task = bar.add_task(title, total=total, completed=done, before=done, note="")

            def advance(count: int = 1, note: str = "") -> None:
                bar.update(task, advance=count, note=note)

            return advance

        yield start


def _lines(title: str, total: int, out: Console, done: int = 0) -> Advance:
    """Return a counter that prints a line from time to time and at the end."""
    began = said = time.monotonic()
    before = done

    def advance(count: int = 1, note: str = "") -> None:
        nonlocal done, said
        done += count
        now = time.monotonic()
        if now - said >= LINE_SECONDS or done == total:
            said = now
            rest = left(now - began, done - before, total - before)
            out.print(f"{title}: {done:,} of {total:,}, left: {rest}{note}")

    return advance
