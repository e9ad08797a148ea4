"""Formatting of the board's numbers and tables."""

from collections.abc import Sequence

import numpy as np

from benchmarks.scoring.statistics import Interval

Table = tuple[list[str], list[list[str]]]  # heading and lines
WIDTH = 150  # largest number of characters of a table's line; a wider table is split
LEFT = {
    *("controller", "environment", "track", "knows", "verdict", "kind", "state", "episodes"),
    *("best learned", "oracle", "unit", "first here", "tuning", "hardware"),
    *("best classical", "paper's controller", "best without preview", "best with preview"),
    *("best other", "result", "matched"),
}
"""Columns of words, aligned to the left."""


def number(value: float | None) -> str:
    """Return a number with three significant digits, or a dash."""
    if value is None or not np.isfinite(value):
        return "-"
    if value == 0.0:
        return "0"
    digits = int(np.floor(np.log10(abs(value))))
    return f"{value:.{max(0, 2 - digits)}f}" if digits >= -3 else f"{value:.2g}"


def bounded(interval: Interval | None, factor: float = 1.0) -> str:
    """Return a number with its interval behind it, without one that is unknown, or a dash."""
    if interval is None or not np.isfinite(interval.value):
        return "-"
    if not np.isfinite(interval.low):
        return number(factor * interval.value)
    bounds = f"[{number(factor * interval.low)}, {number(factor * interval.high)}]"
    return f"{number(factor * interval.value)} {bounds}"


def signed(interval: Interval | None, factor: float = 1.0) -> str:
    """Return a difference with its sign and interval, or a dash."""
    if interval is None or not np.isfinite(interval.value):
        return "-"
    numbers = [number(factor * x) for x in (interval.value, interval.low, interval.high)]
    value, low, high = (x if x.startswith("-") or x == "0" else f"+{x}" for x in numbers)
    return f"{value} [{low}, {high}]"


def chance(interval: Interval | None) -> str:
    """Return a probability with its interval, or a dash."""
    if interval is None:
        return "-"
    return f"{interval.value:.2f} [{interval.low:.2f}, {interval.high:.2f}]"


def percent(interval: Interval) -> str:
    """Return a share with its interval in percent, signs and all."""
    value, low, high = map(_percent, (interval.value, interval.low, interval.high))
    if not np.isfinite([interval.low, interval.high]).all():
        return f"{value} %"
    return f"{value} % [{low}, {high}]"


def reduction_words(interval: Interval) -> str:
    """Return a relative reduction in words, a negative one as an increase.

    For example "lower by 5 % [2, 8]" or "higher by 18 % [-5, 42]".
    """
    sign, word = (-1.0, "higher") if interval.value < 0.0 else (1.0, "lower")
    low, high = sorted((sign * interval.low + 0.0, sign * interval.high + 0.0))
    return f"{word} by {percent(Interval(sign * interval.value, low, high)).replace('+', '')}"


def _percent(share: float) -> str:
    size = 100.0 * share
    return f"{size:+.0f}" if abs(size) >= 9.95 else f"{size:+.2g}"


def duration(seconds: float | None) -> str:
    """Return a time in hours, minutes or seconds, or a dash."""
    if seconds is None or not np.isfinite(seconds):
        return "-"
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * size:
            return f"{number(seconds / size)} {unit}"
    return f"{number(seconds)} s"


def millions(count: float | None) -> str:
    """Return a large number in millions, or a dash."""
    return "-" if count is None else f"{count / 1e6:.3g} M"


def table(heading: Sequence[str], lines: Sequence[Sequence[str]], words: bool = False) -> list[str]:
    """Return the lines of a Markdown table; columns of words to the left, with ``words`` all."""
    rule = [":--" if words or name in LEFT else "--:" for name in heading]
    return [_line(heading), _line(rule), *(_line(line) for line in lines)]


def tables(heading: Sequence[str], lines: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a table, split by columns into as many as fit :data:`WIDTH`.

    Each part repeats the columns up to the controller's (at least the first).
    """
    fixed = heading.index("controller") + 1 if "controller" in heading else 1
    widths = [
        3 + max(len(part) for cell in column for part in cell.split("<br>"))
        for column in zip(heading, *lines, strict=True)
    ]
    parts: list[list[int]] = [[]]
    for k in range(fixed, len(heading)):
        used = sum(widths[:fixed]) + sum(widths[i] for i in parts[-1])
        if parts[-1] and used + widths[k] >= WIDTH:
            parts.append([])
        parts[-1].append(k)
    made: list[str] = []
    for part in parts:
        chosen = [*range(fixed), *part]
        made += [""] * bool(made)
        made += table([heading[k] for k in chosen], [[line[k] for k in chosen] for line in lines])
    return made


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def folded(title: str, lines: Sequence[str]) -> list[str]:
    """Return lines that are folded until a reader opens them."""
    return ["<details>", f"<summary>{title}</summary>", "", *lines, "", "</details>", ""]
