"""Progress on terminals and in files."""

import io

from rich.console import Console

from sweeps import progress as bars
from sweeps.progress import left, progress


def test_remaining_time_assumes_the_mean_rate():
    assert left(60.0, 2, 10) == "about 0:04:00"
    assert left(3600.0, 1, 30) == "about 29:00:00"
    assert left(5.0, 4, 4) == "about 0:00:00"
    assert left(5.0, 0, 4) == left(None, 1, 4) == left(5.0, 1, None) == "?"


def test_terminal_shows_a_bar():
    text = io.StringIO()
    console = Console(file=text, force_terminal=True, width=100)
    with progress("cells", console) as start:
        advance = start(3)
        for _ in range(3):
            advance()
    assert "cells" in text.getvalue() and "3/3" in text.getvalue()
    assert "about 0:00:00" in text.getvalue()


def test_file_gets_one_line_per_minute(monkeypatch):
    now = iter([0.0, 30.0, 70.0, 100.0, 101.0])
    monkeypatch.setattr(bars.time, "monotonic", lambda: next(now))
    text = io.StringIO()
    lines = bars._lines("cells", 4, Console(file=text, width=100))
    for _ in range(4):
        lines()
    assert text.getvalue().splitlines() == [
        "cells: 2 of 4, left: about 0:01:10",
        "cells: 4 of 4, left: about 0:00:00",
    ]
