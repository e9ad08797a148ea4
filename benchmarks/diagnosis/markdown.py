"""Tables and lists in Markdown for the pages of the diagnosis."""

from collections.abc import Iterable, Sequence
from typing import Any


def table(head: Sequence[str], rows: Iterable[Sequence[Any]], numbers: bool = False) -> str:
    """Return a table; with ``numbers`` all columns except the first are right-aligned."""
    rules = [":--", *["--:"] * (len(head) - 1)] if numbers else ["---"] * len(head)
    lines = [head, rules, *rows]
    for line in lines:
        if len(line) != len(head):
            raise ValueError(f"a row of {len(line)} cells in a table of {len(head)} columns")
    return "".join(f"| {' | '.join(map(str, line))} |\n" for line in lines)


def bullets(lines: Iterable[str]) -> str:
    """Return a list."""
    return "".join(f"- {line}\n" for line in lines)
