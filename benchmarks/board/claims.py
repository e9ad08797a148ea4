"""Claims of a controller against the best classical controller of its track."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.board import accessors as views
from benchmarks.board import standings
from benchmarks.runs import knowledge
from benchmarks.runs.cells import AUDIT, PUBLIC
from benchmarks.runs.rows import Row
from benchmarks.scoring.metrics import COST_FLOOR, COST_RATIO, COSTS, of_track
from benchmarks.scoring.statistics import NOTHING, Interval

CLAIM_SEEDS = 10  # training seeds that a claim needs
PROBABILITY, LOWER_BOUND = 0.95, 0.5
"""Thresholds of the probability of improvement and of its lower 95 % bound."""
BETTER, DEARER, NOT_SHOWN = "better", "better error, higher cost", "not shown to be better"


@dataclass(frozen=True)
class Claim:
    """Comparison of a controller with the best classical one of its track."""

    row: Row
    rival: Row
    split: str
    probability: Interval  # of improvement of the headline, over training seeds and paired episodes
    ratios: dict[str, float]  # cost ratios, infinite if the rival has no such cost
    verdict: str
    reasons: tuple[str, ...]  # violated conditions of BETTER
    gain: Interval  # relative reduction of the mean, paired by episode
    remarks: tuple[str, ...]  # numbers of settings tried for each side


def is_rival(row: Row) -> bool:
    """Return whether a row is of a classical controller with a source (a paper or a textbook).

    A controller that is designed from the plant of each episode is not: it knows more.
    """
    sourced = views.is_classical(row) and bool(row["controller"]["citation"])
    return sourced and not views.is_informed(row)


def best_classical(rows: Sequence[Row]) -> Row | None:
    """Return the classical row with the lowest audit (else public) mean; ``None`` without."""
    return next((row for row in standings.ordered(rows) if is_rival(row)), None)


def _matched(row: Row, rows: Sequence[Row], rival: Row) -> list[str]:
    """Return the objection to a lower error that may be due to the preview, if there is one.

    If ``row`` uses preview and ``rival``, the best classical controller, none, it has to be better
    than the best classical controller with preview as well.
    """
    if not views.preview_of(row) or views.preview_of(rival):
        return []
    other = best_classical([one for one in rows if views.preview_of(one)])
    if other is None:
        return [f"uses {views.preview_of(row):g} s of preview, no classical controller does"]
    found = standings.improvement(row, other)
    if found is None:
        return [f"has not run the episodes of {views.name_of(other)}, which uses preview as well"]
    if found.value > PROBABILITY and found.low > LOWER_BOUND:
        return []
    return [f"P {found.value:.2f} against {views.name_of(other)}, which uses preview as well"]


def cost_ratios(row: Row, rival: Row, split: str) -> dict[str, float]:
    """Return each cost over the rival's, means over the episodes of a split."""
    known = of_track(views.content_of(row))
    return {
        name: _ratio(row, rival, metric, split) for metric, name in COSTS.items() if metric in known
    }


def _ratio(row: Row, rival: Row, metric: str, split: str) -> float:
    ours, theirs = (views.mean_of(r, metric, split) for r in (row, rival))
    floor = COST_FLOOR.get(metric, 0.0)
    if ours <= floor:  # counts as none
        return min(1.0, ours / theirs) if theirs > 0.0 else 1.0
    return ours / max(theirs, floor) if max(theirs, floor) > 0.0 else math.inf


def claim(row: Row, rival: Row, doubts: Sequence[str] = ()) -> Claim | None:
    """Return the claim of a row; ``None`` if the two have not run the same episodes."""
    split, probability = views.common_split(row, rival), standings.improvement(row, rival)
    if split is None or probability is None:
        return None
    ratios, gained = cost_ratios(row, rival, split), gain(row, rival)
    against = [*_doubts(row, rival, probability, gained, split), *doubts]
    costs = [f"{name} {ratio:.2f}x" for name, ratio in ratios.items() if not ratio <= COST_RATIO]
    verdict = NOT_SHOWN if against else DEARER if costs else BETTER
    reasons = (*against, *costs)
    return Claim(
        row, rival, split, probability, ratios, verdict, reasons, gained, _budgets(row, rival)
    )


def gain(row: Row, rival: Row) -> Interval:
    """Return the relative reduction of the mean against the rival."""
    return standings.reduction(row, rival) or NOTHING


def tried(row: Row) -> str:
    """Return the number of settings tried, in words."""
    trials = views.cost_of(row).trials
    return "by hand" if trials is None else str(trials)


def _budgets(row: Row, rival: Row) -> tuple[str, ...]:
    """Return a remark if the numbers of settings tried differ."""
    mine, theirs = tried(row), tried(rival)
    if mine == theirs:
        return ()
    return (f"settings tried: {mine}, {theirs} for {views.name_of(rival)}",)


def _doubts(row: Row, rival: Row, probability: Interval, gained: Interval, split: str) -> list[str]:
    """Return the objections to a lower error, each in a few words."""
    doubts = []
    if not probability.value > PROBABILITY:
        doubts.append(f"P {probability.value:.2f}, needs more than {PROBABILITY:g}")
    elif not probability.low > LOWER_BOUND:
        doubts.append(f"lower bound of P {probability.low:.2f}, needs more than {LOWER_BOUND:g}")
    elif not gained.value > 0.0:
        doubts.append("lower in most episodes, not in the mean")
    elif not gained.low > 0.0:
        doubts.append("the interval of the mean's gain holds zero")
    mine, theirs = (each["controller"]["knowledge"] for each in (row, rival))
    if knowledge.is_ahead(mine, theirs):
        doubts.append(
            f"knows the plant ({mine}) that differs from the model of {views.name_of(rival)}"
        )
    seeds = views.training_seeds(row)
    if not views.is_classical(row) and seeds < CLAIM_SEEDS:
        doubts.append(f"{seeds} training seed{'s' * (seeds != 1)}, a claim needs {CLAIM_SEEDS}")
    (failed, total), (failed_too, of) = (views.failures_of(r, split) for r in (row, rival))
    if failed / total > failed_too / of:
        doubts.append(f"{failed} of {total} episodes failed")
    if not views.is_audited(row):
        doubts.append("not audited")
    elif not views.is_audited(rival):
        doubts.append(f"{views.name_of(rival)} not audited")
    return doubts


def learned_claims(rows: Sequence[Row]) -> list[Claim]:
    """Return the claims of a track's learned and residual rows, the likeliest first."""
    rival = best_classical(rows)
    if rival is None:
        return []
    doubts = _doubts_of_track(rows, rival)
    learned = [row for row in standings.ordered(rows) if not views.is_classical(row)]
    made = [claim(row, rival, [*doubts, *_matched(row, rows, rival)]) for row in learned]
    order = (BETTER, DEARER, NOT_SHOWN)

    def rank(entry: Claim) -> tuple[int, bool, float]:
        return order.index(entry.verdict), entry.split != AUDIT, -entry.probability.value

    return sorted((entry for entry in made if entry is not None), key=rank)


def _doubts_of_track(rows: Sequence[Row], rival: Row) -> list[str]:
    """Return the reasons why another classical controller may be the best."""
    listing = standings.listing(rows)
    doubts = [f"{name} is in the audit round and has no row" for name in listing.missing]
    best, public = views.name_of(rival), views.mean_of(rival, split=PUBLIC)
    for row in filter(is_rival, listing.outside):
        if row is not rival and views.mean_of(row) < public:
            doubts.append(f"{views.name_of(row)}, not audited, is below {best} on public episodes")
    return doubts
