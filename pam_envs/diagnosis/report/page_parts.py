"""Numbers, tables and lists as HTML, with all text escaped."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from pam_envs.diagnosis.figures.quantities import MINUS

DASH = "\N{EN DASH}"
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: Any) -> str:
    """Return a number with three significant digits, or a dash for None."""
    if value is None:
        return DASH
    if not isinstance(value, float):
        return str(value)
    if value == 0:
        return "0"
    if abs(value) < 1e-3 or abs(value) >= 1e6:
        mantissa, exponent = f"{value:.2e}".split("e")
        text = f"{mantissa}·10{str(int(exponent)).translate(RAISED)}"
    else:
        text = f"{value:.0f}" if abs(value) >= 1000 else f"{value:#.3g}".rstrip(".")
    return text.replace("-", MINUS)


def interval(bounds: Sequence[float | None] | None) -> str:
    """Return "[low, high]", or an empty string."""
    if not bounds or all(b is None for b in bounds):
        return ""
    return f"[{', '.join(number(b) for b in bounds)}]"


def at(report: Any, *keys: str) -> Any:
    """Return a nested value of a report, or None if a part of the path is missing."""
    for key in keys:
        report = (report or {}).get(key)
    return report


def spread(value: Any) -> str:
    """Return the interval of a value, or an empty string."""
    return interval(at(value, "interval"))


def quantity(value: Any) -> str:
    """Return a value with its unit, or a dash."""
    if not value or value.get("value") is None:
        return DASH
    unit = value.get("unit") or ""
    return f"{number(value['value'])} {'' if unit == '1' else unit}".strip()


def words(value: Any) -> str:
    """Return nested values in words."""
    if isinstance(value, Mapping):
        return ", ".join(f"{k} {words(v)}" for k, v in value.items())
    if isinstance(value, (list, tuple)):
        return " ".join(words(v) for v in value)
    if isinstance(value, float):
        return number(value)
    return str(value)


def enumeration(items: Sequence[str]) -> str:
    """Return "a, b and c"."""
    return " and ".join(part for part in (", ".join(items[:-1]), *items[-1:]) if part)


def paragraph(text: str) -> str:
    """Return a paragraph, or an empty string for an empty text."""
    return f"<p>{escape(text)}</p>" if text else ""


def bullets(items: Sequence[str]) -> str:
    """Return a list."""
    return "<ul>" + "".join(f"<li>{escape(i)}</li>" for i in items) + "</ul>"


def table(
    heads: Sequence[str],
    rows: Sequence[Sequence[str]],
    numbers: Sequence[int] = (),
    codes: Sequence[int] = (),
    flags: int | None = None,
) -> str:
    """Return a table of plain text, or an empty string without rows.

    It has no head if all are empty; ``numbers`` and ``codes`` are columns of numbers and of names
    of the code, ``flags`` is one of warnings.
    """
    if not rows:
        return ""

    def kind(column: int) -> str:
        return ' class="number"' if column in numbers else ""

    def cell(column: int, text: str) -> str:
        inner = escape(str(text))
        if column in codes and inner:
            inner = f"<code>{inner}</code>"
        if column == flags and inner:
            inner = f'<span class="flag">{inner}</span>'
        return f"<td{kind(column)}>{inner}</td>"

    head = "".join(f"<th{kind(i)}>{escape(h)}</th>" for i, h in enumerate(heads))
    body = "\n".join(
        "<tr>" + "".join(cell(i, text) for i, text in enumerate(row)) + "</tr>" for row in rows
    )
    top = f"<thead><tr>{head}</tr></thead>\n" if any(heads) else ""
    return f'<div class="scroll"><table>\n{top}<tbody>\n{body}\n</tbody></table></div>'
