"""Console output of runs and of verified rows."""

import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.board import accessors as views
from benchmarks.runs import rows, verified
from benchmarks.runs.cells import AUDIT, PUBLIC
from benchmarks.runs.runner import Report
from benchmarks.runs.verify import Verdict
from benchmarks.scoring.metrics import shown

LINES = 40  # largest number of listed fields of a row
HOLDS, NEARLY, DRIFTED = "reproduced", "reproduced within tolerance", "DRIFTED"


def run(report: Report) -> int:
    """Print the report of a run, and return the exit code: 1 if something is missing."""
    print(f"{report.computed} cells computed, {report.found} were there already")
    for name in report.quarantined:
        print(f"corrupt, set aside and computed again: {name}")
    for path in report.rows:
        print(_score(path))
    for line in report.missing:
        print(f"MISSING {line}", file=sys.stderr)
    return 1 if report.missing else 0


def _score(path: Path) -> str:
    """Return the headline of a row in words, and that of its audit if there is one."""
    row = rows.load(path)
    unit, factor = shown(views.content_of(row))

    def words(split: str) -> str:
        found = views.interval(row, split=split)
        value, low, high = (factor * x for x in (found.value, found.low, found.high))
        return f"{value:.3f} {unit} [{low:.3f}, {high:.3f}]"

    said = f"{row['row']}: RMS {words(PUBLIC)}"
    failed, total = views.failures_of(row, PUBLIC)
    if failed:
        said += f", {failed} of {total} episodes failed"
    if views.is_audited(row):
        gap = factor * (views.mean_of(row, split=AUDIT) - views.mean_of(row, split=PUBLIC))
        said += f"; audit {words(AUDIT)}, gap {gap:+.3f}"
    return said


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
    """Print whether a row was reproduced, the drifted fields, and the remedy."""
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
