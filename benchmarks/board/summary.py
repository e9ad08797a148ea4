"""What the board says first: who wins where, how ranks change, and what it all cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from benchmarks.board import accessors as views
from benchmarks.board import claims, standings
from benchmarks.board.claims import Claim
from benchmarks.board.format import (
    bounded,
    chance,
    duration,
    folded,
    millions,
    number,
    percent,
    table,
)
from benchmarks.board.standings import Changes, Track
from benchmarks.runs.rows import Row, shown

Tracks = Mapping[str, Track]


def ranked_rows(tracks: Tracks) -> dict[str, Track]:
    """Return the rows of each track that ranks are of."""
    return {name: standings.listing(rows).ranked for name, rows in tracks.items()}


@dataclass(frozen=True)
class Winner:
    """The best paper controller of a track and the learned one that comes closest to a claim.

    Attributes
    ----------
    env, track : str
    paper : Row or None
    claim : Claim or None
    """

    env: str
    track: str
    paper: Row | None
    claim: Claim | None

    @property
    def split(self) -> str:
        """Which episodes the two are compared on."""
        if self.claim is not None:
            return self.claim.split
        return "" if self.paper is None else views.published_split(self.paper)

    @property
    def silence(self) -> str:
        """What is said where nothing can be claimed."""
        if self.paper is None:
            return "no paper controller to compare with"
        return "no learned controller has been run"


def nominal(tracks: Tracks) -> dict[str, Winner]:
    """Return who leads on the nominal track of each environment (on all where none is nominal)."""
    chosen = {name: rows for name, rows in tracks.items() if "nominal" in name} or dict(tracks)
    return {name: _winner(name, rows) for name, rows in chosen.items()}


def _winner(track: str, rows: Sequence[Row]) -> Winner:
    made = claims.learned_claims(rows)
    env = str(rows[0]["env"]["id"])
    return Winner(env, track, claims.best_paper(rows), made[0] if made else None)


def winners(tracks: Tracks) -> list[str]:
    """Return the table of the nominal tracks: best paper controller, best learned one, verdict."""
    heading = ["environment", "episodes", "best paper controller", "RMS [95 %]"]
    heading += ["best learned", "RMS [95 %]", "lower by [95 %]", "P(improvement) [95 %]"]
    heading += ["largest cost", "verdict"]
    return table(heading, [_winner_line(found) for found in nominal(tracks).values()])


def _winner_line(found: Winner) -> list[str]:
    line = [f"`{found.env}`", found.split or "-", *_named(found.paper, found.split)]
    if found.claim is None:
        return [*line, *_named(None, ""), "-", "-", "-", found.silence]
    best = found.claim
    verdict = plain_verdict(best)
    bold = f"**{verdict}**" if best.verdict == claims.BETTER else verdict
    learned = _named(best.row, best.split)
    against = [percent(best.gain), chance(best.probability), largest_cost(best)]
    return [*line, *learned, *against, bold]


def _named(row: Row | None, split: str) -> list[str]:
    """Return a controller's name and its score."""
    return ["none" if row is None else f"`{views.name_of(row)}`", score_words(row, split)]


def score_words(row: Row | None, split: str) -> str:
    """Return the score of a row over the episodes of a split, with its interval and unit."""
    if row is None:
        return "-"
    unit, factor = shown(views.content_of(row))
    return f"{bounded(views.interval(row, split=split), factor)} {unit}"


def largest_cost(entry: Claim) -> str:
    """Return the cost whose ratio to the paper controller's is the largest."""
    name, ratio = max(entry.ratios.items(), key=lambda item: item[1])
    return f"{number(ratio)}x {name}"


def plain_verdict(entry: Claim) -> str:
    """Return the verdict of a claim with what keeps it from being better, and what to know."""
    words = "; ".join((*entry.reasons, *entry.remarks))
    return f"{entry.verdict} ({words})" if words else entry.verdict


def rank_changes(tracks: Tracks) -> list[str]:
    """Return the table of every track against its environment's first, and all places, folded."""
    found = standings.changes(ranked_rows(tracks))
    if not found:
        return ["No environment has been run on more than one track.", ""]
    heading = ["environment", "track", "first here", "was", "largest fall", "largest rise"]
    heading += ["same order (Kendall's tau)", "episodes"]
    lines = [change_line(entry, k) for entry in found for k in range(1, len(entry.tracks))]
    places = [part for entry in found for part in (f"`{entry.env}`", "", *_places(entry), "")]
    return [*table(heading, lines), "", *folded("All places", places)]


def change_line(found: Changes, k: int) -> list[str]:
    """Return the line of the k-th track of an environment against its first."""
    moves = {name: places[0].first - places[k].first for name, places in found.places.items()}
    leaders = [name for name, places in found.places.items() if places[k].first == 1]
    fall, rise = min(moves, key=lambda n: moves[n]), max(moves, key=lambda n: moves[n])
    return [
        f"`{found.env}`",
        short_name(found.tracks[k], found.tracks),
        ", ".join(f"`{name}`" for name in leaders),
        ", ".join(str(found.places[name][0]) for name in leaders),
        _step(found, fall, k) if moves[fall] < 0 else "-",
        _step(found, rise, k) if moves[rise] > 0 else "-",
        f"{found.agreement[k]:.2f}",
        " / ".join(dict.fromkeys((found.splits[0], found.splits[k]))),
    ]


def _step(found: Changes, name: str, k: int) -> str:
    places = found.places[name]
    return f"`{name}` {places[0]} → {places[k]}"


def short_name(track: str, tracks: Sequence[str]) -> str:
    """Return a track's name without what the tracks of its environment have in common."""
    words = [name.split("_") for name in tracks]
    common = 0
    while all(len(w) > common + 1 and w[common] == words[0][common] for w in words):
        common += 1
    return " ".join(track.split("_")[common:])


def _places(found: Changes) -> list[str]:
    heading = ["controller", *(short_name(name, found.tracks) for name in found.tracks)]
    lines = []
    for name, (first, *others) in found.places.items():
        cells = [_moved(place.first - first.first, str(place)) for place in others]
        lines.append([f"`{name}`", str(first), *cells])
    agreement = ["1", *(f"{tau:.2f}" for tau in found.agreement[1:])]
    lines.append(["*order as in the first (Kendall's tau)*", *agreement])
    return table(heading, lines)


def _moved(by: int, place: str) -> str:
    return place if not by else f"{place} ({'▼' if by > 0 else '▲'}{abs(by)})"


COSTS = """\
As stated by its maker, not verified: `verify` runs controllers, it does not train them again.
"""


def costs(rows: Sequence[Row]) -> list[str]:
    """Return what each controller cost to make: a table, and how equal the tuning was."""
    entries = {views.name_of(row): row for row in sorted(rows, key=lambda row: row["row"])}
    return [COSTS.rstrip() + _budgets(list(entries.values())), "", *_cost_table(entries)]


def _budgets(rows: Sequence[Row]) -> str:
    """Return sentences on the tuning trials of classical and learned controllers."""
    trials: dict[bool, list[int | None]] = {}
    for row in rows:
        learned = row["controller"]["kind"] != "classical"
        trials.setdefault(learned, []).append(views.cost_of(row).trials)
    if len(trials) < 2:
        return ""
    most = {learned: max(count or 0 for count in counts) for learned, counts in trials.items()}
    said = ""
    if most[True] != most[False]:
        said += (
            f" Tuning budgets are not equal: up to {most[True]} trials of a learned controller, "
            f"up to {most[False]} of a classical one."
        )
    if by_hand := trials[True].count(None):
        said += f" Of {by_hand} learned controllers the settings were chosen by hand, uncounted."
    return said


def _cost_table(entries: Mapping[str, Row]) -> list[str]:
    heading = ["controller", "kind", "tuning", "tuning trials", "training seeds", "steps a seed"]
    heading += ["time a seed", "hardware"]
    return table(heading, [_cost_line(entries[name]) for name in sorted(entries)])


def _cost_line(row: Row) -> list[str]:
    controller, cost = row["controller"], views.cost_of(row)
    return [
        f"`{views.name_of(row)}`",
        controller["kind"],
        cost.tuning or "-",
        "-" if cost.trials is None else str(cost.trials),
        str(views.training_seeds(row)) if controller["kind"] != "classical" else "-",
        millions(cost.steps),
        duration(cost.seconds),
        cost.hardware or "-",
    ]


def legend(rows: Sequence[Row]) -> list[str]:
    """Return a line for each controller: what it is and where it is from."""
    entries = {views.name_of(row): row["controller"] for row in rows}
    lines = []
    for name in sorted(entries):
        about = entries[name]
        cited = f" *{about['citation']}*" if about["citation"] else ""
        lines.append(f"- `{name}`: {about['summary']}{cited}")
    return lines
