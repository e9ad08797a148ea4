"""Output of the command line on runs and on rows that were verified."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.identity.audit import Round
from benchmarks.runs import rows, verified
from benchmarks.runs.cells import AUDIT, PUBLIC
from benchmarks.runs.runner import Report
from benchmarks.runs.verify import Verdict
from benchmarks.scoring.metrics import headline_of

LINES = 40
"""Fields of a row that are listed at most."""


def run(report: Report) -> int:
    """Print what a run did, and return the exit code: 1 if something is missing."""
    print(f"{report.computed} cells computed, {report.found} were there already")
    for name in report.quarantined:
        print(f"corrupt, set aside and computed again: {name}")
    if report.swept:
        print(f"{report.swept} half-written files removed")
    for path in report.rows:
        print(_score(path))
    for line in report.missing:
        print(f"MISSING {line}", file=sys.stderr)
    return 1 if report.missing else 0


def _score(path: Path) -> str:
    """Return the headline of a row in words, and its audit's where there is one."""
    row = rows.load(path)
    content = row["scenarios"]["content"]
    headline, (unit, factor) = headline_of(content), rows.shown(content)

    def means(split: str) -> dict[str, float]:
        scores = rows.aggregate(rows.episodes_of(row, split), [headline])[headline]
        return {name: factor * scores[name] for name in ("mean", "low", "high")}

    def words(scores: dict[str, float]) -> str:
        return f"{scores['mean']:.3f} {unit} [{scores['low']:.3f}, {scores['high']:.3f}]"

    public = means(PUBLIC)
    said = f"{row['row']}: RMS {words(public)}"
    if failed := rows.failures(rows.episodes_of(row)):
        said += f", {failed} of {len(rows.episodes_of(row))} episodes failed"
    if row["audit"]:
        unseen = means(AUDIT)
        said += f"; audit {words(unseen)}, gap {unseen['mean'] - public['mean']:+.3f}"
    return said


def round_in_words(found: Round) -> str:
    """Return number, size, salt and day of a round."""
    return (
        f"round {found.number}, {len(found.entrants)} controllers, salt {found.salt} of "
        f"{found.drawn}"
    )


HOLDS, NEARLY, DRIFTED = "reproduced", "reproduced within tolerance", "DRIFTED"


def outcome(found: Verdict) -> str:
    """Return in words whether a row was reproduced: to the last bit, within tolerance, or not."""
    if not found.holds:
        return DRIFTED
    return HOLDS if found.mode == verified.BITS else NEARLY


def counted(found: Sequence[Verdict]) -> str:
    """Return the number of rows by outcome."""
    outcomes = [outcome(one) for one in found]
    counts = [(outcomes.count(word), word) for word in (HOLDS, NEARLY, DRIFTED)]
    return f"{len(outcomes)} rows: " + "; ".join(f"{n} {word}" for n, word in counts if n)


def verdict(found: Verdict) -> None:
    """Print whether a row was reproduced, what has drifted, and what to do about it."""
    print(f"{found.row}: {outcome(found)}", flush=True)
    for line in found.drifted[:LINES]:
        print(f"  {line}")
    if len(found.drifted) > LINES:
        print(f"  and {len(found.drifted) - LINES} fields more")
    for line in found.notes:
        print(f"  note: {line}")
    command = rows.command(found.row)
    if not found.holds and not any(command in line for line in found.drifted):
        print(f"  if this checkout is right, run the row again: {command}")
