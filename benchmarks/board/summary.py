"""Summary of the board: best controllers, claims, rank changes, pages, explanations."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from benchmarks.board import accessors as views
from benchmarks.board import claims, gap, standings
from benchmarks.board.claims import Claim
from benchmarks.board.format import chance, number, reduction_words, table, tables
from benchmarks.board.standings import Track
from benchmarks.board.words import (
    change_cells,
    full_verdict,
    largest_cost,
    score_words,
    scores_by_title,
    short_env,
)
from benchmarks.bounds.run import Bounds
from benchmarks.runs.rows import Row
from benchmarks.scenarios import kinds
from benchmarks.scoring.metrics import headline_of

Tracks = Mapping[str, Track]
NO_BOUNDS: Mapping[str, Bounds] = MappingProxyType({})
READING = Path(__file__).with_name("reading.md")  # explanation of the tables
NO_ROWS = "There are no rows yet: run `python -m benchmarks run`."
INTRODUCTION = """\
# Leaderboard

Written by `python -m benchmarks board` from the rows in `benchmarks/results`; do not edit. Each
environment has a page with its tracks and all its controllers; a page shows the
[distance from an oracle](leaderboard/gap.md). `python -m benchmarks show-row ROW` prints a row,
`verify ROW` computes it again, `cite ROW` prints BibTeX, and `python -m benchmarks site` writes an
interactive page with trajectories.
"""
BEST = """\
RMS with its 95 % interval, *EMG effort* of the gait environments, and the share of episodes that
reached their end if some did not. *Paper's controller*: the best one as published or by a textbook
rule, without preview and without tuning. *Best classical*: tuned or not. *Best learned*: mean over
its training seeds. *Oracle*: a predictive controller with the true plant, on the first public
episodes of each scenario ([distance from it](leaderboard/gap.md)).
"""
NEAREST = """\
The learned controller nearest to a claim in each track, against the best classical one. *P* is the
probability of improvement; 95 % intervals, the largest ratio of costs, and what is missing to
*better* in brackets."""
AUDITED = """\
audit episodes, whose seeds were drawn
after every controller had been committed"""
EXCERPT = """\
Nine environments, {count}, scored on {episodes}.
RMS error on the nominal plant / on plants with drawn parameters:
"""
RANK_CHANGES = """\
Each track against the nominal one of its environment, among the controllers that have run in all
of them. *Nominal place*: place of the leaders in the nominal track. Kendall's tau is 1 for the same
order.
"""


KINDS = (kinds.NOMINAL, kinds.DRAWN, kinds.WRONG_MODEL, kinds.EVERYDAY)
"""Kinds of the tracks in the first table."""
SIDES = ("paper's controller", "best classical", "best learned", "oracle")
"""Columns of the first table."""


@dataclass(frozen=True)
class Best:
    """The best controllers of a track.

    Attributes
    ----------
    paper : dict, optional
        Row of the best controller as published, without preview and without tuning.
    classical : dict, optional
        Row of the best classical controller with a source.
    learned : dict, optional
        Row of the learned controller with the lowest mean.
    claim : Claim, optional
        Of the learned controller nearest to a claim, against the classical one.
    oracle : Bounds, optional
        Bounds of the task of these rows.
    """

    env: str
    track: str
    paper: Row | None
    classical: Row | None
    learned: Row | None
    claim: Claim | None
    oracle: Bounds | None

    @property
    def split(self) -> str:
        """Split of the episodes on which learned and classical controllers are compared."""
        if self.claim is not None:
            return self.claim.split
        return "" if self.classical is None else views.published_split(self.classical)

    @property
    def silence(self) -> str:
        """Reason why there is no claim."""
        if self.classical is None:
            return "no classical controller to compare with"
        return "no learned controller has been run"


def best_of(track: str, rows: Sequence[Row], bounds: Mapping[str, Bounds]) -> Best:
    """Return the best controllers of a track; bounds of another task count as none."""
    made, found = claims.learned_claims(rows), bounds.get(track)
    known = found if found is not None and found.task == rows[0]["task"] else None
    return Best(
        views.env_of(rows[0]),
        track,
        gap.best(rows, gap.is_as_published),
        claims.best_classical(rows),
        best_learned(rows),
        made[0] if made else None,
        known,
    )


def best_learned(rows: Sequence[Row]) -> Row | None:
    """Return the learned row with the lowest mean, of those with a rank if there is one."""
    learned = [row for row in standings.ordered(rows) if not views.is_classical(row)]
    return next(iter([*filter(views.is_listed, learned), *learned]), None)


def nominal(tracks: Tracks) -> dict[str, Best]:
    """Return the best of each environment's nominal track (of all tracks if none is nominal)."""
    found = {name: rows for name, rows in tracks.items() if kinds.is_of(name, kinds.NOMINAL)}
    chosen = found or dict(tracks)
    return {name: best_of(name, rows, NO_BOUNDS) for name, rows in chosen.items()}


def board_text(
    all_rows: Sequence[Row],
    pages: Mapping[str, str] | None = None,
    bounds: Mapping[str, Bounds] = NO_BOUNDS,
) -> str:
    """Return LEADERBOARD.md; ``pages`` are the environments' paths relative to it."""
    tracks = standings.tracks(all_rows)
    if not tracks:
        return f"{INTRODUCTION}\n{NO_ROWS}\n"
    found = {name: best_of(name, rows, bounds) for name, rows in tracks.items()}
    lines = [*INTRODUCTION.splitlines(), "", verified_words(all_rows), ""]
    lines += ["## Best controllers", "", *_best_controllers(found), ""]
    lines += ["## Learned against classical controllers", "", *_learned(found), ""]
    lines += ["## Rank changes between tracks", "", *_rank_changes(tracks), ""]
    lines += ["## Environments", "", *_environments(tracks, pages or {}), ""]
    if words := _budgets(all_rows):
        lines += [words, ""]
    return "\n".join([*lines, READING.read_text(encoding="utf-8")])


def _best_controllers(found: Mapping[str, Best]) -> list[str]:
    """Return the table of every environment, nominal and with other plants."""
    lines = []
    for kind in KINDS:
        for name, best in found.items():
            if kinds.is_of(name, kind):
                where = f"`{short_env(best.env)}`<br>{kind.replace('_', ' ')}"
                rows = (best.paper, best.classical, best.learned)
                lines.append([where, *map(_scores, rows), _bound(best)])
    if not lines:
        return ["There is no row of a track of these kinds yet."]
    return [*BEST.splitlines(), "", *table(["environment", *SIDES], lines)]


def _scores(row: Row | None) -> str:
    """Return name, headlines and failures of a controller, in a cell of some lines."""
    if row is None:
        return "-"
    scores = scores_by_title(row, views.published_split(row))
    made = [f"`{views.name_of(row)}`", scores.pop("RMS")]
    made += [f"{title} {value}" for title, value in scores.items()]
    failed, total = views.failures_of(row)
    if failed:
        made.append(f"success {100.0 * (1.0 - failed / total):.3g} %")
    return "<br>".join(made)


def _bound(best: Best) -> str:
    """Return the mean of the oracle, with its other headlines."""
    row = best.classical or best.paper
    if best.oracle is None or row is None:
        return "-"
    unit, factor = views.unit_of(row)
    shown = [(headline_of(views.content_of(row)), unit, factor)]
    shown += [(metric, title, by) for metric, title, by in views.headlines(row)]
    episodes = best.oracle.episodes
    means = [by * float(np.mean([e.scores[metric] for e in episodes])) for metric, _, by in shown]
    first, *more = zip(means, (word for _, word, _ in shown), strict=True)
    return "<br>".join([f"{number(first[0])} {first[1]}", *(f"{w} {number(m)}" for m, w in more)])


def _learned(found: Mapping[str, Best]) -> list[str]:
    """Return a line for each track: intervals, largest cost and reasons of the learned claim."""
    every = [best for best in found.values() if best.claim is not None]
    silent = sorted({short_env(b.env) for b in found.values()} - {short_env(b.env) for b in every})
    lines = [NEAREST, "", *map(_detail, every)] if every else []
    if silent:
        words = ", ".join(f"`{name}`" for name in silent)
        lines += [""] * bool(lines) + [f"No learned controller has been run in {words}."]
    return lines


def _detail(best: Best) -> str:
    """Return the comparison of a track's learned controller with the best classical one."""
    entry = best.claim
    assert entry is not None and best.classical is not None
    return (
        f"- {best.track}: `{views.name_of(entry.row)}` {score_words(entry.row, entry.split)} "
        f"against `{views.name_of(best.classical)}` {score_words(best.classical, entry.split)}; "
        f"{reduction_words(entry.gain)}; P(improvement) {chance(entry.probability)}; largest cost "
        f"{largest_cost(entry)}; {full_verdict(entry)}"
    )


def excerpt(all_rows: Sequence[Row], bounds: Mapping[str, Bounds] = NO_BOUNDS) -> str:
    """Return the table of README: RMS on the nominal tracks and on those with drawn plants."""
    tracks, lines = standings.tracks(all_rows), []
    for name in tracks:
        drawn = kinds.counterpart(name, kinds.NOMINAL, kinds.DRAWN)
        if drawn is None or drawn not in tracks:
            continue
        pair = [name, drawn]
        found = [best_of(one, tracks[one], bounds) for one in pair]
        cells = [
            "-" if set(both) == {"-"} else " / ".join(both)
            for both in zip(*map(_short, found), strict=True)
        ]
        lines.append([f"`{short_env(found[0].env)}`", views.unit_of(tracks[name][0])[0], *cells])
    count = f"{len(tracks)} tracks and {len(all_rows)} rows"
    audited = all(map(views.is_audited, all_rows))
    words = {"count": count, "episodes": AUDITED if audited else "public episodes"}
    return "\n".join([EXCERPT.format(**words), *table(["environment", "unit", *SIDES], lines)])


def _short(best: Best) -> list[str]:
    """Return the RMS of each side, in the unit of the track."""
    rows = (best.paper, best.classical, best.learned)
    made = [
        "-" if row is None else number(views.unit_of(row)[1] * views.mean_of(row)) for row in rows
    ]
    return [*made, _bound(best).partition(" ")[0]]


def _rank_changes(tracks: Tracks) -> list[str]:
    """Return the table of every track against its environment's first."""
    found = standings.changes(standings.ranked(tracks))
    if not found:
        return ["No environment has been run on more than one track."]
    heading = ["environment", "track", "first here", "nominal place", "Kendall's tau", "episodes"]
    lines = []
    for entry in found:
        for k in range(1, len(entry.tracks)):
            _, track, leaders, was, _, _, tau, split = change_cells(entry, k)
            names = leaders.replace(", ", "<br>")
            lines.append([f"`{short_env(entry.env)}`", track, names, was, tau, split])
    return [*RANK_CHANGES.splitlines(), "", *tables(heading, lines)]


def _environments(tracks: Tracks, pages: Mapping[str, str]) -> list[str]:
    """Return the table of the environments' pages."""
    grouped = standings.by_env(tracks)
    lines = []
    for env, held in grouped.items():
        name, names = short_env(env), {views.name_of(row) for rows in held.values() for row in rows}
        link = f"[{name}]({pages[env]})" if env in pages else f"`{name}`"
        count = sum(map(len, held.values()))
        lines.append([link, str(len(held)), str(len(names)), str(count)])
    return tables(["environment", "tracks", "controllers", "rows"], lines)


def verified_words(all_rows: Sequence[Row]) -> str:
    """Return how many rows were reproduced, to the last bit or within tolerance, and when."""
    found = [row[views.VERIFIED] for row in all_rows if row.get(views.VERIFIED)]
    when = f", last on {max(entry['date'] for entry in found)}" if found else ""
    elsewhere = sum(entry["mode"] == "elsewhere" for entry in found)
    how = f", {elsewhere} of them within tolerance on another machine" if elsewhere else ""
    return f"{len(found)} of {len(all_rows)} rows are verified{when}{how}."


def _budgets(rows: Sequence[Row]) -> str:
    """Return sentences on the tuning trials of classical and learned controllers."""
    entries = {views.name_of(row): row for row in sorted(rows, key=lambda row: row["row"])}
    trials: dict[bool, list[int | None]] = {}
    for row in entries.values():
        trials.setdefault(not views.is_classical(row), []).append(views.cost_of(row).trials)
    if len(trials) < 2:
        return ""
    most = {learned: max(count or 0 for count in counts) for learned, counts in trials.items()}
    words = []
    if most[True] != most[False]:
        words.append(
            f"Tuning budgets are not equal: up to {most[True]} trials of a learned controller, "
            f"up to {most[False]} of a classical one."
        )
    if by_hand := trials[True].count(None):
        words.append(f"Of {by_hand} learned controllers the settings were chosen by hand.")
    return " ".join(words)
