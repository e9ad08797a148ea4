"""What may be said of a controller against the best paper controller of its track."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks import standings, views
from benchmarks.metrics import of_track
from benchmarks.rows import Row
from benchmarks.statistics import Interval

CLAIM_SEEDS = 10
"""Training seeds that a claim needs."""
PROBABILITY, LOWER_BOUND = 0.95, 0.5
"""What the probability of improvement has to exceed, and its lower 95 % bound."""
COST_RATIO = 1.1
"""By how much effort and constraint cost may exceed the paper controller's."""
COST_FLOOR = {"constraint_cost": 1e-3}
"""Costs below which there is nothing to compare: a thousandth of a scale, all the time."""
COSTS = {
    "emg_ratio": "EMG ratio",
    "pressure_travel": "pressure travel",
    "air_use": "air",
    "constraint_cost": "constraint cost",
}
"""Metrics that a lower error must not be bought with, where a track has them."""

BETTER, DEARER, NOT_SHOWN = "better", "better error, higher cost", "not shown to be better"


@dataclass(frozen=True)
class Claim:
    """A controller beside the best paper controller of its track.

    Attributes
    ----------
    row, paper : Row
    probability : Interval
        Of improvement of the headline over training seeds and paired episodes.
    ratios : mapping from the name of a cost to its ratio
        Infinite where the paper controller has none of it.
    verdict : str
        ``BETTER``, ``DEARER`` or ``NOT_SHOWN``.
    reasons : tuple of str
        What keeps the claim from being ``BETTER``.
    """

    row: Row
    paper: Row
    probability: Interval
    ratios: dict[str, float]
    verdict: str
    reasons: tuple[str, ...]


def is_paper(row: Row) -> bool:
    """Return whether a row is of a paper's method or a textbook rule: classical, with a source."""
    return row["controller"]["kind"] == "classical" and bool(row["controller"]["citation"])


def best_paper(rows: Sequence[Row]) -> Row | None:
    """Return the paper controller with the lowest public mean, ``None`` where there is none."""
    return next((row for row in standings.ordered(rows) if is_paper(row)), None)


def cost_ratios(row: Row, paper: Row) -> dict[str, float]:
    """Return each cost over the paper controller's, means over the public episodes."""
    wanted = [metric for metric in COSTS if metric in of_track(views.content_of(row))]
    return {COSTS[metric]: _ratio(row, paper, metric) for metric in wanted}


def _ratio(row: Row, paper: Row, metric: str) -> float:
    ours, theirs = (views.mean_of(r, metric, views.PUBLIC) for r in (row, paper))
    floor = COST_FLOOR.get(metric, 0.0)
    if ours <= floor:  # nothing to speak of, whatever the other has
        return min(1.0, ours / theirs) if theirs > 0.0 else 1.0
    return ours / max(theirs, floor) if max(theirs, floor) > 0.0 else math.inf


def claim(row: Row, paper: Row) -> Claim | None:
    """Return what may be said of a row, ``None`` if the two have not run the same episodes."""
    probability = standings.improvement(row, paper)
    if probability is None:
        return None
    ratios = cost_ratios(row, paper)
    doubts = _doubts(row, paper, probability)
    costs = [f"{name} {ratio:.2f}x" for name, ratio in ratios.items() if not ratio <= COST_RATIO]
    verdict = NOT_SHOWN if doubts else DEARER if costs else BETTER
    return Claim(row, paper, probability, ratios, verdict, (*doubts, *costs))


def _doubts(row: Row, paper: Row, probability: Interval) -> list[str]:
    """Return what speaks against a lower error, each as a few words."""
    doubts = []
    if not probability.value > PROBABILITY:
        doubts.append(f"P {probability.value:.2f}, needs more than {PROBABILITY:g}")
    elif not probability.low > LOWER_BOUND:
        doubts.append(f"lower bound of P {probability.low:.2f}, needs more than {LOWER_BOUND:g}")
    seeds = views.training_seeds(row)
    if row["controller"]["kind"] != "classical" and seeds < CLAIM_SEEDS:
        doubts.append(f"{seeds} training seed{'s' * (seeds != 1)}, a claim needs {CLAIM_SEEDS}")
    (failed, total), (theirs, of) = (_failures(r) for r in (row, paper))
    if failed / total > theirs / of:
        doubts.append(f"{failed} of {total} episodes failed")
    if not views.is_audited(row):
        doubts.append("self-reported, a claim needs an audit")
    elif views.is_audited(paper) and not views.mean_of(row) < views.mean_of(paper):
        doubts.append("not lower on the audit episodes")
    return doubts


def _failures(row: Row) -> tuple[int, int]:
    episodes = views.episodes_of(row)
    return sum(bool(episode["failed"]) for episode in episodes), len(episodes)


def learned_claims(rows: Sequence[Row]) -> list[Claim]:
    """Return the claims of a track's learned and residual rows, the likeliest first."""
    paper = best_paper(rows)
    if paper is None:
        return []
    learned = [row for row in standings.ordered(rows) if row["controller"]["kind"] != "classical"]
    made = [claim(row, paper) for row in learned]
    order = (BETTER, DEARER, NOT_SHOWN)
    return sorted(
        (entry for entry in made if entry is not None),
        key=lambda entry: (order.index(entry.verdict), -entry.probability.value),
    )
