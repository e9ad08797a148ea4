"""Ranks of the rows of a track by paired differences, and rank changes between tracks."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from benchmarks.board import accessors as views
from benchmarks.runs.rows import Row
from benchmarks.scenarios import kinds
from benchmarks.scoring import statistics
from benchmarks.scoring.statistics import Interval

Track = list[Row]


@dataclass(frozen=True)
class Place:
    """Place of a row in a ranking, from 1, and whether others share it."""

    first: int
    shared: bool

    def __str__(self) -> str:
        """Return the rank as the board prints it."""
        return f"{self.first}{'=' if self.shared else ''}"


@dataclass(frozen=True)
class Listing:
    """The rows of a track, the lowest error first."""

    ranked: Track  # in the audit round of the track, or all rows where there is no round yet
    few: Track  # too few training seeds for a rank
    outside: Track  # not in the round
    missing: tuple[str, ...]  # controllers in the round without a row
    informed: Track  # designed from the plant of each episode

    @property
    def inside(self) -> Track:
        """Rows that are compared with each other."""
        return [*self.ranked, *self.few]

    @property
    def split(self) -> str:
        """Split of the episodes on which they are compared."""
        return views.published_split(self.inside[0])


def tracks(rows: Sequence[Row]) -> dict[str, Track]:
    """Return the rows of each track, best first; tracks by environment, the nominal one first."""
    grouped: dict[str, Track] = {}
    for row in rows:
        grouped.setdefault(views.track_of(row), []).append(row)

    def order(name: str) -> tuple[bool, str, bool, str]:  # positioning first
        env = views.env_of(grouped[name][0])
        return "Positioning" not in env, env, not kinds.is_of(name, kinds.NOMINAL), name

    return {name: ordered(grouped[name]) for name in sorted(grouped, key=order)}


def ranked(by_track: Mapping[str, Track]) -> dict[str, Track]:
    """Return the ranked rows of each track."""
    return {name: listing(rows).ranked for name, rows in by_track.items()}


def by_env(by_track: Mapping[str, Track]) -> dict[str, dict[str, Track]]:
    """Return the tracks of each environment, by its id."""
    grouped: dict[str, dict[str, Track]] = {}
    for name, rows in by_track.items():
        grouped.setdefault(views.env_of(rows[0]), {})[name] = rows
    return grouped


def ordered(rows: Sequence[Row]) -> Track:
    """Return the rows of a track by the mean of their headline, the audit round first."""

    def order(row: Row) -> tuple[bool, float, str]:
        mean = views.mean_of(row)
        return not views.is_audited(row), np.inf if np.isnan(mean) else mean, views.name_of(row)

    return sorted(rows, key=order)


def listing(rows: Sequence[Row]) -> Listing:
    """Return the rows of a track that are compared and those that are listed apart."""
    every = ordered(rows)
    best_first = [row for row in every if not views.is_informed(row)]
    audited = [row for row in best_first if views.is_audited(row)]
    inside = audited or best_first
    informed = [row for row in every if views.is_informed(row)]
    present = {views.name_of(row) for row in (*inside, *filter(views.is_audited, informed))}
    entrants = audited[0]["audit"]["entrants"] if audited else ()
    return Listing(
        ranked=[row for row in inside if views.is_listed(row)],
        few=[row for row in inside if not views.is_listed(row)],
        outside=best_first[len(inside) :],
        missing=tuple(sorted(set(entrants) - present)),
        informed=informed,
    )


def difference(first: Row, second: Row) -> Interval | None:
    """Return the difference of the headlines, paired by episode; ``None`` for other episodes."""
    return _compared(statistics.difference_of_tables, first, second)


def reduction(first: Row, second: Row) -> Interval | None:
    """Return by what share the mean headline of ``first`` is lower, paired by episode."""
    return _compared(statistics.reduction_of_tables, first, second)


def improvement(first: Row, second: Row) -> Interval | None:
    """Return the probability that ``first`` has the lower headline, by paired episodes."""
    return _compared(statistics.probability_of_improvement, first, second)


def _compared(compare: Callable[..., Interval], first: Row, second: Row) -> Interval | None:
    split = views.common_split(first, second)
    if split is None:
        return None
    a, b = (views.scores(row, split=split) for row in (first, second))
    return compare(a.table, b.table, a.strata)


def ranks(best_first: Sequence[Row]) -> list[Place]:
    """Return the place of each row of a track.

    A row shares the place of the first of its group if the interval of their paired difference
    contains zero.
    """
    groups: list[list[Row]] = []
    for row in best_first:
        gap = difference(row, groups[-1][0]) if groups else None
        if gap is not None and gap.low <= 0.0 <= gap.high:
            groups[-1].append(row)
        else:
            groups.append([row])
    places, first = [], 1
    for group in groups:
        places += [Place(first, len(group) > 1)] * len(group)
        first += len(group)
    return places


@dataclass(frozen=True)
class Changes:
    """Ranks of the controllers that have run in all tracks of an environment."""

    env: str
    tracks: tuple[str, ...]  # the nominal one first
    splits: tuple[str, ...]  # split of each one's episodes
    # a place a track for each controller, in the order of the first track
    places: Mapping[str, tuple[Place, ...]]
    agreement: tuple[float, ...]  # Kendall's tau of each track's means with those of the first


def changes(by_track: Mapping[str, Sequence[Row]]) -> list[Changes]:
    """Return the rank changes of each environment with several tracks, from its ranked rows."""
    families: dict[str, list[str]] = {}
    for name, rows in by_track.items():
        if rows:
            families.setdefault(views.env_of(rows[0]), []).append(name)
    return [_changes(env, names, by_track) for env, names in families.items() if len(names) > 1]


def _changes(env: str, names: list[str], by_track: Mapping[str, Sequence[Row]]) -> Changes:
    everywhere = set.intersection(*({views.name_of(r) for r in by_track[n]} for n in names))
    kept = {n: [r for r in by_track[n] if views.name_of(r) in everywhere] for n in names}
    placed = {
        n: dict(zip(map(views.name_of, rows), ranks(rows), strict=True)) for n, rows in kept.items()
    }
    order = [views.name_of(row) for row in kept[names[0]]]
    means = {n: {views.name_of(r): views.mean_of(r) for r in rows} for n, rows in kept.items()}
    first = [means[names[0]][c] for c in order]
    agreement = [
        float(stats.kendalltau(first, [means[n][c] for c in order]).statistic)
        if len(order) > 1
        else float("nan")
        for n in names
    ]
    places = {c: tuple(placed[n][c] for n in names) for c in order}
    splits = tuple(views.published_split(by_track[n][0]) for n in names)
    return Changes(env, tuple(names), splits, places, tuple(agreement))
