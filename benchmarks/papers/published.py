"""Published figures compared with ours, each with its tolerance."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

BEFORE = "not in the paper: computed independently by another program"
UNKNOWN = float("nan")
"""Printed value of a figure that the paper does not print."""
NEAR = 0.05
"""Largest difference, over the printed value, of a figure without a tolerance of its own."""


@dataclass(frozen=True)
class Figure:
    """A figure of a paper compared with ours, which is ``None`` if it could not be computed.

    ``published`` is the number that the paper prints, and decides where there is one. ``expected``
    is the result of an independent program from the paper's equations. ``tolerance`` is the largest
    accepted difference, to either side. ``at_least`` and ``at_most`` are targets of this package. A
    ``given`` figure is an input, shown but not judged. ``why`` is the reason of a known difference.
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
    def printed(self) -> float | None:
        """The number that the paper prints, if it does."""
        return None if self.published != self.published else self.published

    @property
    def passed(self) -> bool | None:
        """True if ours is within tolerance and bounds; ``None`` if it has neither."""
        if self.ours is None or self.given:
            return None
        checks = list[bool]()
        if self.tolerance is not None:
            target = self.expected if self.printed is None else self.printed
            assert target is not None, f"{self.name}: a tolerance of nothing"
            checks.append(abs(self.ours - target) <= self.tolerance)
        if self.at_most is not None:
            checks.append(self.ours <= self.at_most)
        if self.at_least is not None:
            checks.append(self.ours >= self.at_least)
        return all(checks) if checks else None

    @property
    def target(self) -> str:
        """The tolerance and the bounds, as the table shows them."""
        if self.given:
            return ""
        words = [] if self.tolerance is None else [f"+-{self.tolerance:.2g}"]
        words += [] if self.at_least is None else [f">= {self.at_least:.4g}"]
        words += [] if self.at_most is None else [f"<= {self.at_most:.4g}"]
        return ", ".join(words)

    @property
    def verdict(self) -> str:
        """Against the paper where it prints a number, else against our target."""
        if self.ours is None:
            return "not computed"
        if self.given:
            return "input"
        if self.printed is not None:
            near = abs(self.ours - self.printed) <= NEAR * abs(self.printed)
            good = near if self.passed is None else self.passed
            return "reproduced" if good else "differs"
        return {True: "target met", False: "target missed", None: "not printed"}[self.passed]

    @property
    def remark(self) -> str:
        """The note, followed by the reason of a miss."""
        reason = self.why if self.passed is False else ""
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
        ("figure", "printed", "recomputed", "target", "ours", "unit", "verdict", "where", "reason")
    ]
    for f in figures:
        known = ["" if value is None else f"{value:.4g}" for value in (f.printed, f.expected)]
        ours = "-" if f.ours is None else f"{f.ours:.4g}"
        lines.append((f.name, *known, f.target, ours, f.unit, f.verdict, f.source, f.remark))
    return aligned(lines)
