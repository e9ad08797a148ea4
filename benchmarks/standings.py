"""Who stands where in a track, by paired differences, and how that changes between tracks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from benchmarks import statistics, views
from benchmarks.rows import Row
from benchmarks.statistics import Interval

Track = list[Row]


@dataclass(frozen=True)
class Place:
    """Where a row stands.

    Attributes
    ----------
    first : int
        Place of the first row of its group, from 1.
    shared : bool
        Whether others share it.
    """

    first: int
    shared: bool

    def __str__(self) -> str:
        """Return the rank as the board prints it."""
        return f"{self.first}{'=' if self.shared else ''}"


@dataclass(frozen=True)
class Listing:
    """The rows of a track.

    Attributes
    ----------
    audited, reported, few : list of rows
        With a published score on audit episodes; without; and with too few training seeds. Each
        by its mean over the public episodes, the lowest first.
    """

    audited: Track
    reported: Track
    few: Track

    @property
    def ranked(self) -> Track:
        """The rows that ranks and claims are of: the audited ones, all where none is audited."""
        return self.audited or self.reported


def tracks(rows: Sequence[Row]) -> dict[str, Track]:
    """Return the rows of each track, best first; tracks by environment, the nominal one first."""
    grouped: dict[str, Track] = {}
    for row in rows:
        grouped.setdefault(views.track_of(row), []).append(row)
    names = sorted(grouped, key=lambda n: (_family(grouped[n][0]), "nominal" not in n, n))
    return {name: ordered(grouped[name]) for name in names}


def _family(row: Row) -> str:
    """Return what tracks of one environment sort by: positioning first."""
    env = str(row["env"]["id"])
    return "" if "Positioning" in env else env


def ordered(rows: Sequence[Row]) -> Track:
    """Return rows by the mean of their headline over the public episodes, the lowest first."""
    keys = {id(row): (views.mean_of(row, split=views.PUBLIC), views.name_of(row)) for row in rows}
    return sorted(rows, key=lambda row: keys[id(row)])


def listing(rows: Sequence[Row]) -> Listing:
    """Return which rows of a track are audited, self-reported, or of too few training seeds."""
    best_first = ordered(rows)
    few = [row for row in best_first if not views.is_listed(row)]
    kept = [row for row in best_first if views.is_listed(row)]
    audited = [row for row in kept if views.is_audited(row)]
    return Listing(audited, [row for row in kept if not views.is_audited(row)], few)


def difference(first: Row, second: Row) -> Interval | None:
    """Return the headline of ``first`` less that of ``second`` over the public episodes, paired.

    ``None`` if they have not run the same episodes.
    """
    if not views.same_episodes(first, second):
        return None
    a, b = views.scores(first), views.scores(second)
    return statistics.difference_of_tables(a.table, _arranged(b, a), a.strata)


def _arranged(given: views.Scores, like: views.Scores) -> statistics.Array:
    """Return the table with its columns in the order of another's."""
    place = {pair: k for k, pair in enumerate(given.pairs)}
    return given.table[:, [place[pair] for pair in like.pairs]]


def improvement(first: Row, second: Row) -> Interval | None:
    """Return how likely ``first`` has the smaller headline, over training seeds and episodes."""
    if not views.same_episodes(first, second):
        return None
    a, b = views.scores(first), views.scores(second)
    return statistics.probability_of_improvement(a.table, _arranged(b, a), a.strata)


def ranks(best_first: Sequence[Row]) -> list[Place]:
    """Return the place of each row of a track.

    A row shares the place of the first of its group where the interval of their paired difference
    holds zero.
    """
    groups: list[list[Row]] = []
    for row in best_first:
        if groups and _tied(row, groups[-1][0]):
            groups[-1].append(row)
        else:
            groups.append([row])
    sizes = [len(group) for group in groups]
    firsts = np.cumsum([1, *sizes[:-1]]) if sizes else ()
    return [
        Place(int(first), size > 1)
        for first, size in zip(firsts, sizes, strict=True)
        for _ in range(size)
    ]


def _tied(row: Row, leader: Row) -> bool:
    found = difference(row, leader)
    return found is not None and found.low <= 0.0 <= found.high


@dataclass(frozen=True)
class Changes:
    """Ranks of the controllers that have run in all tracks of an environment.

    Attributes
    ----------
    env : str
    tracks : tuple of str
        The nominal one first.
    places : mapping from controller to a place a track
        In the order of the first track.
    agreement : tuple of float
        Kendall's tau of each track's means with those of the first, 1 for the same order.
    """

    env: str
    tracks: tuple[str, ...]
    places: Mapping[str, tuple[Place, ...]]
    agreement: tuple[float, ...]

    def largest(self, controller: str) -> int:
        """Return the largest change of place against the first track; below zero: it does worse."""
        first, *others = self.places[controller]
        moves = [first.first - place.first for place in others]
        return max(moves, key=abs, default=0)


def changes(by_track: Mapping[str, Sequence[Row]]) -> list[Changes]:
    """Return how ranks change between the tracks of each environment that has more than one.

    Parameters
    ----------
    by_track : mapping from track to rows
        The rows that are ranked, best first, tracks in the order of :func:`tracks`.
    """
    families: dict[str, list[str]] = {}
    for name, rows in by_track.items():
        if rows:
            families.setdefault(str(rows[0]["env"]["id"]), []).append(name)
    return [_changes(env, names, by_track) for env, names in families.items() if len(names) > 1]


def _changes(env: str, names: list[str], by_track: Mapping[str, Sequence[Row]]) -> Changes:
    everywhere = set.intersection(*({views.name_of(r) for r in by_track[n]} for n in names))
    kept = {n: [r for r in by_track[n] if views.name_of(r) in everywhere] for n in names}
    placed = {
        n: dict(zip(map(views.name_of, rows), ranks(rows), strict=True)) for n, rows in kept.items()
    }
    order = [views.name_of(row) for row in kept[names[0]]]
    means = {
        n: {views.name_of(r): views.mean_of(r, split=views.PUBLIC) for r in rows}
        for n, rows in kept.items()
    }
    first = [means[names[0]][c] for c in order]
    agreement = [_tau(first, [means[n][c] for c in order]) for n in names]
    places = {c: tuple(placed[n][c] for n in names) for c in order}
    return Changes(env, tuple(names), places, tuple(agreement))


def _tau(first: Sequence[float], second: Sequence[float]) -> float:
    if len(first) < 2:
        return float("nan")
    return float(stats.kendalltau(first, second).statistic)
