"""What tables, claims and the page read of a row: the one place that knows a row's keys."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks import statistics
from benchmarks.metrics import headline_of
from benchmarks.rows import Row, scores_of, shown
from benchmarks.scenarios import ScenarioSet
from benchmarks.statistics import Array, Interval

PUBLIC, AUDIT = "public", "audit"
LISTED_SEEDS = 5
"""Training seeds that a learned row needs to be ranked."""


@dataclass(frozen=True)
class Scores:
    """One metric of a row.

    Attributes
    ----------
    table : (runs, n) array
        A row a training seed (one for a classical controller), a column an episode.
    pairs : tuple of (scenario, seed)
        Of each column.
    """

    table: Array
    pairs: tuple[tuple[str, int], ...]

    @property
    def strata(self) -> list[str]:
        """Scenario of each column."""
        return [scenario for scenario, _ in self.pairs]


def name_of(row: Mapping[str, Any]) -> str:
    """Return the controller's name."""
    return str(row["controller"]["name"])


def content_of(row: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the content of the row's scenario file."""
    return dict(row["scenarios"]["content"])


def track_of(row: Mapping[str, Any]) -> str:
    """Return the name of the row's track."""
    return str(row["scenarios"]["name"])


def factor_of(row: Mapping[str, Any]) -> float:
    """Return the factor from SI in which the row's headline is shown."""
    return shown(content_of(row))[1]


def episodes_of(row: Mapping[str, Any], split: str = PUBLIC) -> list[Mapping[str, Any]]:
    """Return the public or the audit episodes of a row."""
    return [episode for episode in row["episodes"] if episode.get("split", PUBLIC) == split]


def is_audited(row: Mapping[str, Any]) -> bool:
    """Return whether the row's published score is of audit episodes."""
    return bool(row.get("audit")) and bool(episodes_of(row, AUDIT))


def published_split(row: Mapping[str, Any]) -> str:
    """Return which episodes the published score is of."""
    return AUDIT if is_audited(row) else PUBLIC


def training_seeds(row: Mapping[str, Any]) -> int:
    """Return the number of training seeds, 0 for a classical controller."""
    if row["controller"]["kind"] == "classical":
        return 0
    return len({episode.get("training_seed") for episode in episodes_of(row)})


def is_listed(row: Mapping[str, Any]) -> bool:
    """Return whether the row has as many training seeds as a rank needs."""
    return row["controller"]["kind"] == "classical" or training_seeds(row) >= LISTED_SEEDS


def scores(row: Mapping[str, Any], metric: str = "", split: str = PUBLIC) -> Scores:
    """Return a metric of all episodes of a row, the headline where none is named."""
    return of_episodes(episodes_of(row, split), metric or headline_of(content_of(row)))


def of_episodes(episodes: list[Mapping[str, Any]], metric: str) -> Scores:
    """Return a metric of episodes as a table of training seeds by paired episodes."""
    runs: list[Hashable] = [episode.get("training_seed") for episode in episodes]
    pairs = [(str(episode["scenario"]), int(episode["seed"])) for episode in episodes]
    table, order = statistics.crossed(scores_of(episodes, metric), runs, pairs)
    place = {name: i for i, name in enumerate(dict.fromkeys(scenario for scenario, _ in order))}
    ordered = sorted(range(len(order)), key=lambda k: (place[order[k][0]], order[k][1]))
    return Scores(table[:, ordered], tuple(order[k] for k in ordered))


def mean_of(row: Mapping[str, Any], metric: str = "", split: str | None = None) -> float:
    """Return the mean of a metric over the published episodes, NaN where it never applies."""
    metric = metric or headline_of(content_of(row))
    values = scores_of(episodes_of(row, split or published_split(row)), metric)
    return (
        float(np.mean(values[np.isfinite(values)])) if np.isfinite(values).any() else float("nan")
    )


def interval(row: Mapping[str, Any], metric: str = "", split: str | None = None) -> Interval:
    """Return the mean of a metric over the published episodes with its 95 % interval."""
    found = scores(row, metric, split or published_split(row))
    return table_interval(found)


def table_interval(found: Scores, statistic: statistics.Statistic = statistics.mean) -> Interval:
    """Return a statistic of scores with its 95 % interval, over training seeds and seeds."""
    applies = np.isfinite(found.table).all(axis=0)
    table, strata = found.table[:, applies], found.strata
    if not table.size:
        return Interval(float("nan"), float("nan"), float("nan"))
    labels = [strata[k] for k in np.flatnonzero(applies)]
    drawn = statistics.resampled(
        table, labels, statistic, statistics.RESAMPLES, statistics.BOOTSTRAP_SEED
    )
    return statistics.between(float(statistic(table.ravel())), drawn)


def gap(row: Mapping[str, Any]) -> Interval | None:
    """Return the headline's audit mean less its public mean, ``None`` where there is no audit."""
    if not is_audited(row):
        return None
    public, audit = scores(row), scores(row, split=AUDIT)
    drawn = [
        statistics.resampled(found.table, found.strata, statistics.mean, statistics.RESAMPLES, seed)
        for found, seed in ((audit, statistics.BOOTSTRAP_SEED), (public, _OTHER_SEED))
    ]
    return statistics.between(float(audit.table.mean() - public.table.mean()), drawn[0] - drawn[1])


_OTHER_SEED = statistics.BOOTSTRAP_SEED + 1_000


def salts_drawn(row: Mapping[str, Any]) -> int:
    """Return how many salts the controller's name has had in this task, 0 without an audit."""
    return int(row["audit"].get("draw", 1)) if is_audited(row) else 0


def is_worse_unseen(row: Mapping[str, Any]) -> bool:
    """Return whether the audit mean lies above the public one by more than its interval."""
    found = gap(row)
    return found is not None and found.low > 0.0


def failures_of(row: Mapping[str, Any]) -> tuple[int, int]:
    """Return how many of the published episodes failed, and their number."""
    episodes = episodes_of(row, published_split(row))
    return sum(bool(episode["failed"]) for episode in episodes), len(episodes)


JUMPING = ("steps", "staircase")
"""References that jump: the mean over a track may be mostly the error of their edges."""


def references_of(row: Mapping[str, Any]) -> dict[str, str]:
    """Return the family of the reference of each scenario, empty where it has no name."""
    made = ScenarioSet(content_of(row)).scenarios()
    return {scenario.name: str(scenario.kwargs.get("reference", "")) for scenario in made}


def smooth(row: Mapping[str, Any]) -> Interval | None:
    """Return the headline over smooth references, ``None`` where none or all of them are."""
    families = references_of(row)
    kept = {name for name, family in families.items() if family not in JUMPING}
    if len(kept) in (0, len(families)):
        return None
    found = scores(row, split=published_split(row))
    columns = [k for k, (scenario, _) in enumerate(found.pairs) if scenario in kept]
    return table_interval(Scores(found.table[:, columns], tuple(found.pairs[k] for k in columns)))


def by_setting(row: Mapping[str, Any]) -> dict[tuple[str, str], float]:
    """Return the headline's mean for each value of each axis of the grid."""
    made = {s.name: s.kwargs for s in ScenarioSet(content_of(row)).scenarios()}
    found = scores(row, split=published_split(row))
    means = found.table.mean(axis=0)
    table: dict[tuple[str, str], float] = {}
    for axis, points in (content_of(row).get("grid") or {}).items():
        for point in points:
            chosen = [made[scenario][axis] == point for scenario in found.strata]
            table[axis, str(point)] = float(means[chosen].mean())
    return table


def same_episodes(first: Row, second: Row) -> bool:
    """Return whether two rows are of the same public episodes of the same task."""
    tasks = {row.get("task") for row in (first, second)}
    return len(tasks) == 1 and set(scores(first).pairs) == set(scores(second).pairs)


@dataclass(frozen=True)
class Cost:
    """What a controller cost to make.

    Attributes
    ----------
    tuning : str
        How it was tuned.
    trials : int or None
        Settings that were tried.
    steps, seconds : float or None
        Of one training seed, the mean over the seeds [1], [s].
    hardware : str
    command : str
        What trains the first seed again.
    """

    tuning: str
    trials: int | None
    steps: float | None
    seconds: float | None
    hardware: str
    command: str


def cost_of(row: Mapping[str, Any]) -> Cost:
    """Return what a controller cost to make, as its row states it."""
    tuning = row["controller"].get("tuning") or {}
    records = row["controller"].get("training") or []
    trials = [r["tuning_trials"] for r in records if r.get("tuning_trials") is not None]
    hardware = dict.fromkeys(str(r["hardware"]) for r in records if r.get("hardware"))
    return Cost(
        tuning=str(tuning.get("how", "search" if trials else "")),
        trials=max(trials) if trials else tuning.get("trials"),
        steps=_average(records, "steps"),
        seconds=_average(records, "seconds"),
        hardware=", ".join(hardware),
        command=next((str(r["command"]) for r in records if r.get("command")), ""),
    )


def _average(records: list[Mapping[str, Any]], name: str) -> float | None:
    known = [float(record[name]) for record in records if record.get(name) is not None]
    return sum(known) / len(known) if known else None
