"""One row as text: its controller, its task and the scores of its episodes."""

from __future__ import annotations

from benchmarks.board import accessors as views
from benchmarks.board.environment_page import kind_of
from benchmarks.board.format import bounded, number
from benchmarks.board.words import about
from benchmarks.runs.cells import AUDIT, PUBLIC
from benchmarks.runs.rows import Row
from benchmarks.scoring.metrics import columns_of


def row_text(row: Row) -> str:
    """Return a row in words: origin, headline of each split, every metric, every setting."""
    controller, content = row["controller"], views.content_of(row)
    unit, factor = views.unit_of(row)
    splits = [split for split in (PUBLIC, AUDIT) if views.pairs_of(row, split)]
    lines = [
        str(row["row"]),
        f"  {controller['summary']}",
        f"  {kind_of(row)}; knows: {controller['knowledge']}; commit {row['made_with']['commit']}",
        f"  {about(row).replace('`', '')}",
    ]
    for split in splits:
        failed, total = views.failures_of(row, split)
        score = bounded(views.interval(row, split=split), factor)
        lines.append(f"{split} RMS: {score} {unit}; {failed} of {total} episodes failed")
    lines.append(f"metrics ({' and '.join(splits)} episodes):")
    for metric, title, scale in columns_of(content):
        means = (number(scale * views.mean_of(row, metric, split)) for split in splits)
        lines.append(f"  {title:44s} {'  '.join(f'{mean:>9s}' for mean in means)}")
    for (axis, point), value in views.by_setting(row).items():
        lines.append(f"  {f'RMS, {axis} {point} [{unit}]':44s} {number(factor * value):>9s}")
    return "\n".join(lines)
