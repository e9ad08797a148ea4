"""Tables, lists and shares in Markdown for the pages of the diagnosis, and their files."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.runs.store import write_record
from pam_envs.files import write_text


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


def counted(found: Mapping[str, Any]) -> str:
    """Return a share as two numbers."""
    return f"{found['count']} of {found['n']}"


def named_counts(counts: Mapping[str, int]) -> str:
    """Return names with their numbers."""
    return ", ".join(f"`{name}` {n}" for name, n in counts.items()) or "none"


def reached(found: Mapping[str, Any], key: str) -> str:
    """Return a share with its interval or bound, or a quantile."""
    form = {"value": share_text, "upper": bound_text}.get(key)
    return form(found) if form else percent(found, key)


def number(value: float | None, form: str = ".2f") -> str:
    """Return a number, or "-" for None."""
    return "-" if value is None else format(value, form)


def write_page(path: Path, text: str, **numbers: Any) -> list[Path]:
    """Write a page as ``path.md`` and its numbers as ``path.json``, and return both paths."""
    paths = [path.with_suffix(".md"), path.with_suffix(".json")]
    write_text(paths[0], text)
    write_record(paths[1], {"schema": 1, **numbers})
    return paths
