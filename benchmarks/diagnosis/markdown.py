"""Tables, lists and shares in Markdown for the pages of the diagnosis."""

from collections.abc import Iterable, Mapping, Sequence
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


def percent(found: Mapping[str, Any], key: str = "value") -> str:
    """Return a share or a quantile in per cent."""
    return "-" if found[key] is None else f"{100.0 * found[key]:.1f} %"


def share_text(found: Mapping[str, Any]) -> str:
    """Return a share with its interval."""
    if not found["n"]:
        return "not run"
    low, high = (100.0 * v for v in found["interval"])
    return f"{percent(found)} [{low:.1f}, {high:.1f}]"


def bound_text(found: Mapping[str, Any]) -> str:
    """Return a share with its upper bound."""
    return f"{percent(found)}, bound {percent(found, 'upper')}" if found["n"] else "not run"


def reached(found: Mapping[str, Any], key: str) -> str:
    """Return a share with its interval or bound, or a quantile."""
    form = {"value": share_text, "upper": bound_text}.get(key)
    return form(found) if form else percent(found, key)


def number(value: float | None, form: str = ".2f") -> str:
    """Return a number, or "-" for None."""
    return "-" if value is None else format(value, form)
