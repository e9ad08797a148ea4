"""Published figures beside ours, each with its tolerance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

BEFORE = "not in the paper: computed independently by another program"
UNKNOWN = float("nan")
"""Published value of a figure that the paper does not print."""
NEAR = 0.05
"""Share of the expected value within which most figures of the joint are judged."""


@dataclass(frozen=True)
class Figure:
    """One published figure beside ours.

    Attributes
    ----------
    name, source, unit : str
    published : float
        What the paper prints; NaN where it prints nothing.
    ours : float or None
        ``None`` if it cannot be computed; ``note`` says why.
    tolerance : float or None
        Largest absolute difference from ``expected``, or from ``published`` where nothing else is
        expected; ``None`` if it is not judged so.
    note : str
    expected : float, optional
        Computed from the paper's own equations by an independent program.
    at_most, at_least : float, optional
        Bounds on ours.
    given : bool
        Whether ours is an input, which is shown and never judged.
    why : str
        Reason of a known miss.
    """

    name: str
    source: str
    unit: str
    published: float
    ours: float | None
    tolerance: float | None
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


Group = Callable[[], list[Figure]]
"""Computes some figures of a paper; its docstring is their title."""


def note(*words: str) -> str:
    """Return the note of a figure: calibrated or predicted, with which preset, in which norm."""
    return "; ".join(words)


def near(
    name: str,
    where: str,
    unit: str,
    expected: float,
    ours: float,
    share: float | None = NEAR,
    note: str = BEFORE,
    why: str = "",
) -> Figure:
    """Return a figure judged within a share of the expected value; reported if that is None."""
    tolerance = None if share is None else share * abs(expected)
    return Figure(name, where, unit, UNKNOWN, ours, tolerance, note, expected, why=why)


def table(figures: Sequence[Figure]) -> str:
    """Return the figures as aligned text."""
    lines = [("figure", "published", "expected", "ours", "unit", "judged by", "", "note")]
    for figure in figures:
        known = figure.published == figure.published
        lines.append(
            (
                figure.name,
                f"{figure.published:.4g}" if known else "",
                "" if figure.expected is None else f"{figure.expected:.4g}",
                "-" if figure.ours is None else f"{figure.ours:.4g}",
                figure.unit,
                figure.judged_by,
                figure.verdict,
                figure.remark,
            )
        )
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    )
