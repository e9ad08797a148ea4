"""Progress bar of a diagnosis."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def steps(progress: bool) -> Iterator[Callable[[str], None]]:
    """Provide a function that shows the present stage."""
    if not progress:
        yield lambda text: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, transient=True) as bar:
        task = bar.add_task("reading", total=7)

        def step(text: str) -> None:
            bar.update(task, description=text, advance=1)

        yield step
