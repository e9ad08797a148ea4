"""Accessors of a row for tables, claims and the site; only this module knows the keys of a row."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.runs.cells import AUDIT, PUBLIC
from benchmarks.runs.knowledge import TRUE
from benchmarks.runs.rows import Row, episodes_of, scores_of
from benchmarks.scenarios.scenario import ScenarioSet
from benchmarks.scoring import statistics
from benchmarks.scoring.group import Column
from benchmarks.scoring.metrics import headline_of, headlines_of, shown
from benchmarks.scoring.statistics import Interval
from pam_envs.arrays import Array

LISTED_SEEDS = 5  # training seeds that a learned row needs to be ranked
VERIFIED = "verified"
"""Key of a row's verification, set by :func:`benchmarks.board.leaderboard.load`."""


@dataclass(frozen=True)
class Scores:
    """One metric of a row: a row a training seed and a column an episode."""

    table: Array
    strata: list[str]  # scenarios of the columns, ascending
    runs: list[int | None]  # training seeds, ascending


def name_of(row: Mapping[str, Any]) -> str:
    """Return the controller's name."""
    return str(row["controller"]["name"])


def content_of(row: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the content of the row's scenario file."""
    return dict(row["scenarios"]["content"])


def track_of(row: Mapping[str, Any]) -> str:
    """Return the name of the row's track."""
    return str(row["scenarios"]["name"])


def env_of(row: Mapping[str, Any]) -> str:
    """Return the id of the row's environment."""
    return str(row["env"]["id"])


def unit_of(row: Mapping[str, Any]) -> tuple[str, float]:
    """Return the unit in which the row's headline is shown, and its factor from SI."""
    return shown(content_of(row))


def headlines(row: Mapping[str, Any]) -> tuple[Column, ...]:
    """Return the metrics that are shown beside the row's RMS."""
    return headlines_of(content_of(row))


def is_classical(row: Mapping[str, Any]) -> bool:
    """Return whether the row's controller has no learned part."""
    return bool(row["controller"]["kind"] == "classical")


def is_informed(row: Mapping[str, Any]) -> bool:
    """Return whether the row's controller is designed from the plant of each episode."""
    return bool(row["controller"].get("claimed") == TRUE)


def preview_of(row: Mapping[str, Any]) -> float:
    """Return the preview horizon that the row's controller uses [s], as measured."""
    return float(row["controller"]["preview_seconds"])


def is_audited(row: Mapping[str, Any]) -> bool:
    """Return whether the row is in the audit round of its track."""
    return row["audit"] is not None


def published_split(row: Mapping[str, Any]) -> str:
    """Return the split of the row's score: the audit episodes if it is in the round."""
    return AUDIT if is_audited(row) else PUBLIC


def training_seeds(row: Mapping[str, Any]) -> int:
    """Return the number of training seeds, 0 for a classical controller."""
    if is_classical(row):
        return 0
    return len({episode.get("training_seed") for episode in episodes_of(row)})


def is_listed(row: Mapping[str, Any]) -> bool:
    """Return whether the row has enough training seeds for a rank."""
    return is_classical(row) or training_seeds(row) >= LISTED_SEEDS


def scores(row: Mapping[str, Any], metric: str = "", split: str = "") -> Scores:
    """Return a metric of a row: by default its headline over the published episodes."""
    episodes = episodes_of(row, split or published_split(row))
    values = scores_of(episodes, metric or headline_of(content_of(row)))
    runs = [episode["training_seed"] for episode in episodes]
    pairs = [(str(episode["scenario"]), int(episode["seed"])) for episode in episodes]
    try:
        table, order = statistics.crossed(values, runs, pairs)
    except ValueError as error:
        raise ValueError(f"{row['row']}: {error}") from error
    return Scores(table, [scenario for scenario, _ in order], sorted(set(runs)))


def mean_of(row: Mapping[str, Any], metric: str = "", split: str = "") -> float:
    """Return the mean of a metric over the published episodes, NaN where it never applies."""
    table = scores(row, metric, split).table
    kept = table[:, statistics.applying(table)]
    return float(kept.mean()) if kept.size else float("nan")


def interval(row: Mapping[str, Any], metric: str = "", split: str = "") -> Interval:
    """Return the mean of a metric over the published episodes with its 95 % interval."""
    found = scores(row, metric, split)
    return statistics.of_table(found.table, found.strata)


def middle(row: Mapping[str, Any]) -> Interval:
    """Return the interquartile mean of the headline over the published episodes."""
    found = scores(row)
    return statistics.of_table(found.table, found.strata, statistics.interquartile_mean)


def by_training_seed(row: Mapping[str, Any], split: str = "") -> dict[int, float]:
    """Return the headline's mean of each training seed; empty for a classical controller."""
    found = scores(row, split=split)
    means = found.table.mean(axis=1).tolist()
    return {run: mean for run, mean in zip(found.runs, means, strict=True) if run is not None}


def gap(row: Mapping[str, Any]) -> Interval | None:
    """Return the headline's audit mean less its public mean, ``None`` without an audit."""
    if not is_audited(row):
        return None
    audit, public = scores(row, split=AUDIT), scores(row, split=PUBLIC)
    return statistics.difference_of_splits(audit.table, audit.strata, public.table, public.strata)


def is_worse_unseen(row: Mapping[str, Any]) -> bool:
    """Return whether the audit mean exceeds the public one by more than its interval."""
    found = gap(row)
    return found is not None and found.low > 0.0


def failures_of(row: Mapping[str, Any], split: str = "") -> tuple[int, int]:
    """Return the number of failed episodes among the published ones, and the number of all."""
    episodes = episodes_of(row, split or published_split(row))
    return sum(bool(episode["failed"]) for episode in episodes), len(episodes)


def verified_words(row: Mapping[str, Any]) -> str:
    """Return whether and when the row was reproduced."""
    found = row.get(VERIFIED)
    if not found:
        return "not verified yet"
    where = " elsewhere" if found["mode"] == "elsewhere" else ""
    return f"verified {found['date']}{where}"


JUMPING = ("steps", "staircase")
"""References with jumps, whose edges may dominate the mean error of a track."""


def smooth(row: Mapping[str, Any]) -> Interval | None:
    """Return the headline over smooth references, ``None`` if none or all references are smooth."""
    made = ScenarioSet(content_of(row)).scenarios()
    kept = {s.name for s in made if str(s.kwargs.get("reference", "")) not in JUMPING}
    if len(kept) in (0, len(made)):
        return None
    found = scores(row)
    chosen = np.array([scenario in kept for scenario in found.strata])
    return statistics.of_table(found.table[:, chosen], np.array(found.strata)[chosen])


def by_setting(row: Mapping[str, Any]) -> dict[tuple[str, str], float]:
    """Return the headline's mean for each value of each axis of the grid."""
    track, episodes = ScenarioSet(content_of(row)), episodes_of(row, published_split(row))
    values = scores_of(episodes, headline_of(track.content))
    settings = {scenario.name: scenario.kwargs for scenario in track.scenarios()}
    return {
        (axis, str(point)): float(
            np.mean(values[[settings[e["scenario"]][axis] == point for e in episodes]])
        )
        for axis, points in (track.content.get("grid") or {}).items()
        for point in points
    }


def pairs_of(row: Mapping[str, Any], split: str) -> frozenset[tuple[str, int]]:
    """Return scenario and seed of the episodes of a split, the same for all training seeds."""
    return frozenset((e["scenario"], e["seed"]) for e in episodes_of(row, split))


def common_split(first: Row, second: Row) -> str | None:
    """Return the split on which two rows are compared: the audit of both, or the public one."""
    split = AUDIT if is_audited(first) and is_audited(second) else PUBLIC
    same = first["task"] == second["task"] and pairs_of(first, split) == pairs_of(second, split)
    return split if same else None


@dataclass(frozen=True)
class Cost:
    """Cost of tuning and training a controller."""

    tuning: str
    trials: int | None  # settings tried, None if not counted
    steps: float | None  # mean over the training seeds
    seconds: float | None  # mean over the training seeds [s]
    hardware: str
    command: str  # trains the first seed again


def cost_of(row: Mapping[str, Any]) -> Cost:
    """Return the cost of tuning and training a controller, as stated in its row."""
    tuning = row["controller"]["tuning"]
    records = row["controller"].get("training") or []

    def average(name: str) -> float | None:
        known = [float(record[name]) for record in records if record.get(name) is not None]
        return sum(known) / len(known) if known else None

    hardware = dict.fromkeys(str(r["hardware"]) for r in records if r.get("hardware"))
    command = next((str(r["command"]) for r in records if r.get("command")), "")
    measured = (average("steps"), average("seconds"), ", ".join(hardware))
    return Cost(str(tuning["how"]), tuning["trials"], *measured, command)
