"""Inventory of the papers: every figure, table, numbered equation and claim, and its coverage.

``inventory.yaml`` lists them in the order of each paper. An item with a text alone has rows that
groups compute; the others state why there is none, under ``not modelled`` or ``not checkable``.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import yaml

from benchmarks.papers.published import UNKNOWN, VERDICTS, Figure, aligned

FILE = Path(__file__).with_name("inventory.yaml")
KINDS = {"Fig. ": "figures", "Table ": "tables", "Eq. (": "equations"}
"""Beginning of a place by its kind; all others are claims."""


@cache
def items() -> dict[str, dict[str, Figure | None]]:
    """Return by paper and place the stated row of an item, ``None`` where groups compute it."""
    papers = yaml.safe_load(FILE.read_text(encoding="utf-8"))
    return {
        paper: {place: _stated(paper, place, entry) for place, entry in listed.items()}
        for paper, listed in papers.items()
    }


def _stated(paper: str, place: str, entry: str | dict[str, str | float]) -> Figure | None:
    if isinstance(entry, str):
        return None
    (verdict,) = entry.keys() & {"not modelled", "not checkable"}
    printed = entry.get("printed", UNKNOWN)
    words = printed if isinstance(printed, str) else ""
    value = UNKNOWN if isinstance(printed, str) else float(printed)
    source, note, unit = f"{paper}, {place}", str(entry[verdict]), str(entry.get("unit", ""))
    name, more = str(entry["text"]), {"claim": words, "absent": verdict}
    return Figure(name, None, unit, source, value, note=note, **more)  # type: ignore[arg-type]


def stated(paper: str) -> Iterator[Figure]:
    """Yield the rows of the items that no group computes."""
    return (row for row in items()[paper].values() if row is not None)


def kind(place: str) -> str:
    """Return the kind of an item."""
    return next((name for start, name in KINDS.items() if place.startswith(start)), "claims")


def judged(paper: str, place: str, figures: Sequence[Figure]) -> str:
    """Return the verdict of an item: ``differs`` if one of its rows does.

    Rows with a printed number or claim decide where there are any, before recomputed ones.
    """
    rows = [f for f in figures if f.source.startswith(f"{paper}, ") and place in f.places]
    own = [f for f in rows if f.comparable and (f.printed is not None or f.claim)]
    found = {row.verdict for row in own or rows}
    order = ("differs", "reproduced", "not modelled", "not checkable")
    return next(verdict for verdict in order if verdict in found)


def coverage(figures: Sequence[Figure]) -> list[tuple[str, ...]]:
    """Return the number of items of each paper by kind and verdict, with a head."""
    lines: list[tuple[str, ...]] = [("paper", "items", "number", *VERDICTS)]
    for paper, listed in items().items():
        for name in (*KINDS.values(), "claims"):
            places = [place for place in listed if kind(place) == name]
            found = Counter(judged(paper, place, figures) for place in places)
            counts = (len(places), *(found[verdict] for verdict in VERDICTS))
            lines.append((paper, name, *map(str, counts)))
    return lines


def summary(figures: Sequence[Figure]) -> str:
    """Return :func:`coverage` as aligned text."""
    return aligned(coverage(figures))
