"""Published figures compared with ours, each with its tolerance.

``figures.yaml`` declares the figures of each paper: name, unit, place, printed value or claim,
tolerance, and remarks. Groups compute our values.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import yaml

from pam_envs.plants.core.plant import Plant

BEFORE = "not in the paper: computed independently by another program"
UNKNOWN = float("nan")
"""Printed value of a figure that the paper does not print."""
NEAR = 0.05
"""Largest difference, over the printed value, of a figure without a tolerance of its own."""
VERDICTS = ("reproduced", "differs", "not modelled", "not checkable")


@dataclass(frozen=True)
class Figure:
    """A value or statement of a paper compared with ours.

    ``published`` is the number that the paper prints, and decides where there is one. ``expected``
    is the result of an independent program from the paper's own data and equations. ``claim`` are
    the paper's words where it makes a statement, with ``at_least`` and ``at_most`` as its meaning;
    without a claim these are targets of this package. ``tolerance`` is the largest accepted
    difference, to either side. ``source`` is the paper and, after a comma, its places in the
    inventory, with semicolons between them. A ``given`` figure is an input, shown but not judged.
    ``why`` is the reason of a known difference. Without ``ours``, ``absent`` is the verdict and
    ``note`` its reason.
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
    claim: str = ""
    absent: str = "not checkable"

    @property
    def places(self) -> tuple[str, ...]:
        """Places of the paper, as the inventory has them."""
        return tuple(self.source.partition(", ")[2].split("; "))

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
        value = self.expected if self.printed is None else self.printed
        if value is not None:
            band = NEAR * abs(value) if self.tolerance is None else self.tolerance
            bounded = self.at_least is not None or self.at_most is not None
            if self.tolerance is not None or not bounded:
                checks.append(abs(self.ours - value) <= band)
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
    def comparable(self) -> bool:
        """True if the paper prints or implies something to compare ours with."""
        known = self.printed is not None or self.expected is not None or bool(self.claim)
        return known and not self.given

    @property
    def verdict(self) -> str:
        """One of ``VERDICTS``."""
        if self.ours is None:
            return self.absent
        if not self.comparable or self.passed is None:
            return "not checkable"
        return "reproduced" if self.passed else "differs"

    @property
    def remark(self) -> str:
        """The reason of the verdict, the note, and the reason of a miss."""
        first = ""
        if self.ours is not None and self.verdict == "not checkable":
            first = "an input, not a result" if self.given else "the paper gives no value"
        reason = self.why if self.passed is False else ""
        return "; ".join(text for text in (first, self.note, reason) if text)

    @property
    def unexplained(self) -> bool:
        """True if ours misses its target, or has no verdict of agreement, without a reason."""
        silent = self.passed is False and not self.why
        return silent or (self.verdict != "reproduced" and not self.remark)

    def record(self) -> dict[str, Any]:
        """Return the figure as plain data."""
        return {**asdict(self), "passed": self.passed, "verdict": self.verdict}


Values = Iterator[tuple[Any, ...]]
"""Name of each declared figure, our value and, optionally, what completes the declaration: values
of ``{}`` in its texts, and entries of :class:`Figure`."""
Group = Callable[[], Values]
"""Computes some figures of a paper; its docstring is their title."""


@cache
def declared() -> dict[str, dict[str, Mapping[str, Any]]]:
    """Return the declarations of ``figures.yaml`` by paper and name."""
    text = Path(__file__).with_name("figures.yaml").read_text(encoding="utf-8")
    return dict(yaml.safe_load(text))


def compared(paper: str, group: Group) -> Iterator[Figure]:
    """Yield the figures of a group; ``share`` of a declaration is a tolerance over the value."""
    for name, ours, *more in group():
        facts = {"independent": BEFORE, **(more[0] if more else {})}
        known = {**declared()[paper][name], **{k: v for k, v in facts.items() if k in _FIELDS}}
        made: dict[str, Any] = {
            key: v.format(**facts) if isinstance(v, str) else v for key, v in known.items()
        }
        if (share := made.pop("share", None)) is not None:
            made["tolerance"] = share * abs(made["expected"])
        made["source"] = f"{paper}, {made['source']}"
        yield Figure(name.format(**facts), ours, **made)


_FIELDS = {*Figure.__dataclass_fields__} - {"name", "ours"}

P = TypeVar("P", bound=Plant)


def as_published(plant: P) -> P:
    """Return the plant with regulators that have neither dead time nor limited rate.

    The hysteresis of a plant of this folder is named where the plant is built: ``"maxwell_slip"``,
    driven by pressure, or none.
    """
    if plant.hysteresis.drive != "pressure":  # type: ignore[attr-defined]
        raise ValueError(f"the hysteresis of this {plant.family} is not driven by pressure")
    return plant.with_lag_alone()


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
        printed, recomputed, ours = (
            "" if value is None else f"{value:.4g}" for value in (f.printed, f.expected, f.ours)
        )
        printed = printed or (f'"{f.claim}"' if f.claim else "")
        known = (printed, recomputed, f.target, ours or "-")
        lines.append((f.name, *known, f.unit, f.verdict, f.source, f.remark))
    return aligned(lines)
