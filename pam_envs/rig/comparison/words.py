"""Result of a comparison in words and as a table of text."""

import math
from collections.abc import Sequence

import numpy as np

from pam_envs.rig.comparison import prediction, ranks
from pam_envs.rig.comparison.rows import Ranking, Row


def accuracy(rows: Sequence[Row]) -> str:
    """Return in words how far predictions are from measurements."""
    done = [row for row in rows if math.isfinite(row.predicted)]
    text = (
        f"{sum(row.within for row in rows)} of {len(rows)} measured figures are in the "
        f"{100 * prediction.LEVEL:g} % prediction interval"
    )
    sizes = [abs(row.relative) for row in done if math.isfinite(row.relative)]
    if sizes:
        signed = float(np.median([row.relative for row in done if math.isfinite(row.relative)]))
        side = "high" if signed > 0.0 else "low"
        text += (
            f"; predictions differ from them by {100 * float(np.median(sizes)):.0f} % in the median"
            f" and are {100 * abs(signed):.0f} % too {side}"
        )
    lost = sorted({row.controller for row in rows} - {row.controller for row in done})
    failed = f" In simulation {', '.join(lost)} left the range of contractions." if lost else ""
    return f"{text}.{failed}"


def order(rankings: Sequence[Ranking]) -> str:
    """Return in words whether the order of the controllers is predicted."""
    if not rankings:
        return f"A rank correlation needs {ranks.FEWEST} controllers in one condition."
    first = rankings[0]
    rank, word = first.kendall, f"{first.controllers} controllers by {first.figure}"
    if not math.isfinite(rank.value):
        return f"The {word} have no order: their figures are equal."
    text = (
        f"The order of {word} has Kendall's tau {rank.value:.2f} "
        f"({100 * ranks.LEVEL:g} % interval {rank.low:.2f} to {rank.high:.2f})"
    )
    if rank.low > 0.0:
        return f"{text}: the simulation predicts which of them is better on this rig."
    if rank.high < 0.0:
        return f"{text}: the simulation predicts the opposite of the order on this rig."
    return (
        f"{text}: this does not show that the order is predicted; a random one agrees as well "
        f"with probability {rank.chance:.2g}."
    )


def rows_text(rows: Sequence[Row]) -> list[str]:
    """Return a heading and a line for each row."""
    wide = max(len(row.controller) for row in rows)
    where = max(len(row.condition.text) for row in rows)
    head = f"{'controller':{max(wide, 10)}}  {'condition':{max(where, 9)}}  {'figure':12}"
    lines = [f"{head} {'predicted':>9} {'interval':>17} {'measured':>9} {'error':>8}"]
    for row in rows:
        name = f"{row.controller:{max(wide, 10)}}  {row.condition.text:{max(where, 9)}}"
        span = f"{row.low:.3g} .. {row.high:.3g}" if math.isfinite(row.low) else "failed"
        error = f"{100 * row.relative:+.0f} %" if math.isfinite(row.relative) else "-"
        lines.append(
            f"{name}  {row.figure:12} {row.predicted:9.3g} {span:>17} {row.measured:9.3g} "
            f"{error:>8}{'' if row.within else '  outside'}"
        )
    return lines


def ranking_text(ranking: Ranking) -> str:
    """Return a ranking as a line."""
    parts = [
        f"{name} {rank.value:.2f} ({rank.low:.2f} to {rank.high:.2f})"
        for name, rank in (("Kendall", ranking.kendall), ("Spearman", ranking.spearman))
    ]
    return (
        f"ranks of {ranking.controllers} controllers by {ranking.figure}, "
        f"{ranking.condition.text}: {', '.join(parts)}"
    )
