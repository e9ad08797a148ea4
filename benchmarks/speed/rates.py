"""Rates measured side by side: what is compared runs in one process, in interleaved rounds.

A rate is the median over rounds, a ratio the median of the ratios within each round, so that a
busy machine slows both sides alike. Times are CPU seconds of the process, except where *wall* is
said.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

from benchmarks.runs import provenance

Chunk = Callable[[], int]
"""Does some work and returns how many environment steps it was."""

Start = Callable[[int], Callable[[], None]]


class Missing(Exception):
    """What a measurement needs is not there; the message says what."""


@dataclass(frozen=True)
class Measurement:
    """One measured figure beside its target.

    Attributes
    ----------
    group, name, unit : str
    value : float or None
        ``None`` if it could not be measured; ``note`` says why.
    floor, aim : float or None
        What must be reached, and what is aimed at.
    better : {"more", "less"}
    note : str
    """

    group: str
    name: str
    value: float | None
    unit: str = "x"
    floor: float | None = None
    aim: float | None = None
    better: Literal["more", "less"] = "more"
    note: str = ""

    def _reaches(self, target: float | None) -> bool | None:
        if self.value is None or target is None:
            return None
        return self.value >= target if self.better == "more" else self.value <= target

    @property
    def passed(self) -> bool | None:
        """Whether the floor is reached; ``None`` without a floor or a value."""
        return self._reaches(self.floor)

    @property
    def verdict(self) -> str:
        """One word for the table."""
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
    """Return the rate of each subject in each round [steps/s].

    Parameters
    ----------
    subjects : mapping of callable
        Each is called once to warm up and then once a round.
    rounds : int
    clock : callable
        CPU time by default.
    """
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


def ratio(above: Sequence[float], below: Sequence[float]) -> float:
    """Return the median of the ratios within each round."""
    return median([a / b for a, b in zip(above, below, strict=True)])


def measure(
    only: Sequence[str] = (), rounds: int = 7, start: Start = lambda total: lambda: None
) -> list[Measurement]:
    """Measure the groups that are named, or all.

    Raises
    ------
    ValueError
        If there is no group of a name.
    """
    from benchmarks.speed.probes import GROUPS

    unknown = sorted(set(only) - set(GROUPS))
    if unknown:
        raise ValueError(f"no group named {unknown[0]!r}; there are: {', '.join(GROUPS)}")
    chosen = [name for name in GROUPS if not only or name in only]
    advance, results = start(len(chosen)), list[Measurement]()
    for name in chosen:
        for probe in GROUPS[name]:
            results += attempt(name, probe, rounds)
        advance()
    return results


def attempt(
    group: str, probe: Callable[[int], list[Measurement]], rounds: int
) -> list[Measurement]:
    """Return what a probe measures, or one line that says why it could not."""
    try:
        return probe(rounds)
    except Missing as reason:
        note = str(reason)
    except ModuleNotFoundError as error:
        note = f"{error.name} is not installed"
    except Exception as error:  # a figure that fails must not cost the others
        note = f"failed: {type(error).__name__}: {error}"
    title = (probe.__doc__ or probe.__name__).splitlines()[0].rstrip(".")
    return [Measurement(group, title, None, "", note=note)]


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
    lines = [heading] + [
        (
            r.group,
            r.name,
            f"{'>=' if r.better == 'more' else '<='} {_shown(r.floor)}" if r.floor else "",
            _shown(r.aim) if r.aim else "",
            _shown(r.value),
            r.unit,
            r.verdict,
            r.note,
        )
        for r in results
    ]
    widths = [max(len(line[i]) for line in lines) for i in range(len(heading))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    )


def record(results: Sequence[Measurement]) -> dict[str, Any]:
    """Return the figures as plain data, with what they were measured with and where."""
    return {
        "schema": 1,
        "measurements": [
            {**asdict(result), "passed": result.passed, "verdict": result.verdict}
            for result in results
        ],
        "made_with": {"packages": provenance.packages(), "commit": provenance.commit()},
        "volatile": provenance.occasion(),
    }
