"""Rates measured in one process, in interleaved rounds, and their table.

A rate is the median over rounds, a ratio the median of the ratios within each round, so that a
busy machine slows both sides equally. Times are CPU seconds of the process unless *wall* is stated.
"""

import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

from benchmarks.papers.published import aligned
from benchmarks.runs import provenance

Chunk = Callable[[], int]  # does some work and returns its number of environment steps


class Missing(Exception):
    """A missing requirement of a measurement; the message names it."""


@dataclass(frozen=True)
class Measurement:
    """One measured figure."""

    group: str
    name: str
    value: float | None  # None if it could not be measured; note says why
    unit: str = "x"
    floor: float | None = None  # required
    aim: float | None = None  # desired
    better: Literal["more", "less"] = "more"
    note: str = ""

    def _reaches(self, target: float | None) -> bool | None:
        if self.value is None or target is None:
            return None
        return self.value >= target if self.better == "more" else self.value <= target

    @property
    def passed(self) -> bool | None:
        """True if the floor is reached; ``None`` without a floor or a value."""
        return self._reaches(self.floor)

    @property
    def verdict(self) -> str:
        """Verdict in one word for the table."""
        if self.value is None:
            return "not measured"
        if self.passed is None:
            return ""
        if not self.passed:
            return "MISSED"
        return "aim" if self._reaches(self.aim) else "pass"


def interleaved(
    subjects: Mapping[str, Chunk], rounds: int, clock: Callable[[], float] = time.process_time
) -> dict[str, list[float]]:
    """Return the rate of each subject in each round [steps/s], after a call to warm up."""
    for chunk in subjects.values():
        chunk()
    rates: dict[str, list[float]] = {name: [] for name in subjects}
    for _ in range(rounds):
        for name, chunk in subjects.items():
            begin = clock()
            steps = chunk()
            rates[name].append(steps / max(clock() - begin, 1e-9))
    return rates


def median(rates: Sequence[float]) -> float:
    """Return the median."""
    return float(statistics.median(rates))


def ratio(above: Sequence[float], below: Sequence[float] | None) -> float | None:
    """Return the median of the ratios within each round; None if one side was not measured."""
    return None if below is None else median([a / b for a, b in zip(above, below, strict=True)])


def _shown(value: float | None) -> str:
    if value is None:
        return "-"
    if abs(value) >= 1e6:
        return f"{value / 1e6:.3g} M"
    if abs(value) >= 1e4:
        return f"{value / 1e3:.3g} k"
    return f"{value:.3g}"


def table(results: Sequence[Measurement]) -> str:
    """Return the figures as aligned text: target, measured, pass."""
    heading = ("group", "what", "floor", "aim", "measured", "unit", "", "note")
    lines: list[tuple[str, ...]] = [heading]
    for r in results:
        floor = f"{'>=' if r.better == 'more' else '<='} {_shown(r.floor)}" if r.floor else ""
        measured = (_shown(r.aim) if r.aim else "", _shown(r.value), r.unit)
        lines.append((r.group, r.name, floor, *measured, r.verdict, r.note))
    return aligned(lines)


def record(results: Sequence[Measurement]) -> dict[str, Any]:
    """Return the figures as plain data, with packages, commit, machine and date."""
    return {
        "schema": 1,
        "measurements": [
            {**asdict(result), "passed": result.passed, "verdict": result.verdict}
            for result in results
        ],
        "made_with": {"packages": provenance.packages(), "commit": provenance.commit()},
        "volatile": provenance.occasion(),
    }
