"""Published figures compared with ours, each with its tolerance."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

BEFORE = "not in the paper: computed independently by another program"
UNKNOWN = float("nan")
"""Published value of a figure that the paper does not print."""


@dataclass(frozen=True)
class Figure:
    """A published figure compared with ours, which is ``None`` if it could not be computed.

    ``published`` is the paper's number, ``expected`` the result of an independent program from its
    equations. ``tolerance`` is the largest accepted difference from ``expected``, or from
    ``published`` without it. A ``given`` figure is an input, shown but not judged. ``why`` is the
    reason of a known miss.
    """

    name: str
    ours: float | None
    unit: str = ""
    source: str = ""
    published: float = UNKNOWN
    tolerance: float | None = None
    note: str = ""
    expected: float | None = None
    at_most: float | None = None
    at_least: float | None = None
    given: bool = False
    why: str = ""

    @property
    def passed(self) -> bool | None:
        """True if ours is within tolerance and bounds; ``None`` if it is not judged."""
        if self.ours is None or self.given:
            return None
        checks = list[bool]()
        if self.tolerance is not None:
            target = self.published if self.expected is None else self.expected
            checks.append(abs(self.ours - target) <= self.tolerance)
        if self.at_most is not None:
            checks.append(self.ours <= self.at_most)
        if self.at_least is not None:
            checks.append(self.ours >= self.at_least)
        return all(checks) if checks else None

    @property
    def judged_by(self) -> str:
        """The tolerance and the bounds, as the table shows them."""
        if self.given:
            return ""
        words = [] if self.tolerance is None else [f"+-{self.tolerance:.2g}"]
        words += [] if self.at_least is None else [f">= {self.at_least:.4g}"]
        words += [] if self.at_most is None else [f"<= {self.at_most:.4g}"]
        return ", ".join(words)

    @property
    def verdict(self) -> str:
        """Verdict of the table."""
        if self.ours is None:
            return "not computed"
        if self.given:
            return "input"
        missed = "MISSED" if self.tolerance is None or self.why else "FAIL"
        return {True: "pass", False: missed, None: "reported"}[self.passed]

    @property
    def remark(self) -> str:
        """The note, followed by the reason of a miss."""
        reason = f"does not reproduce: {self.why}" if self.passed is False and self.why else ""
        return "; ".join(text for text in (self.note, reason) if text)

    def record(self) -> dict[str, Any]:
        """Return the figure as plain data."""
        return {**asdict(self), "passed": self.passed}


Group = Callable[[], Iterable[Figure]]
"""Computes some figures of a paper; its docstring is their title."""


def note(*words: str) -> str:
    """Return the note of a figure: calibrated or predicted, with which preset, in which norm."""
    return "; ".join(words)


def aligned(lines: Sequence[Sequence[str]]) -> str:
    """Return the lines of a table with aligned columns."""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    )


def table(figures: Sequence[Figure]) -> str:
    """Return the figures as aligned text."""
    lines: list[tuple[str, ...]] = [
        ("figure", "published", "expected", "ours", "unit", "judged by", "", "note")
    ]
    for f in figures:
        values = (None if f.published != f.published else f.published, f.expected)
        known = ["" if value is None else f"{value:.4g}" for value in values]
        ours = "-" if f.ours is None else f"{f.ours:.4g}"
        lines.append((f.name, *known, ours, f.unit, f.judged_by, f.verdict, f.remark))
    return aligned(lines)
