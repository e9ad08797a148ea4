"""Page of one environment: its tracks, rank changes, controllers and their cost."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from benchmarks.board import accessors as views
from benchmarks.board import claims, standings
from benchmarks.board.cite import methods
from benchmarks.board.claims import Claim
from benchmarks.board.columns import Column, columns_of, with_costs
from benchmarks.board.format import (
    bounded,
    chance,
    duration,
    folded,
    millions,
    number,
    percent,
    signed,
    tables,
)
from benchmarks.board.standings import Changes, Listing, Track
from benchmarks.board.words import about, change_cells, full_verdict, round_words, short_name
from benchmarks.runs.cells import PUBLIC
from benchmarks.runs.rows import Row, shown
from benchmarks.scoring.metrics import COSTS
from pam_envs import citations

Table = tuple[list[str], list[list[str]]]
"""Heading and lines."""


def page_text(name: str, tracks: Mapping[str, Track], figures: Mapping[str, str]) -> str:
    """Return the page of an environment.

    Parameters
    ----------
    name : str
    tracks : mapping from track to rows
        Of the environment, the nominal one first; rows best first.
    figures : mapping from track to path
        Pictures to show, relative to the page.
    """
    rows = [row for ordered in tracks.values() for row in ordered]
    lines = [f"# {name}", "", INTRODUCTION, ""]
    for change in standings.changes(standings.ranked(tracks)):
        lines += ["## Rank changes between tracks", "", *_rank_changes(change)]
    for track, ordered in tracks.items():
        lines += _track(ordered, figures.get(track))
    lines += ["## Tuning and training", "", *_costs(rows), ""]
    lines += ["## Controllers", "", *_controllers(rows), ""]
    return "\n".join(lines).rstrip() + "\n"


INTRODUCTION = (
    "Written by `python -m benchmarks board`; do not edit. The columns are explained in the "
    "[leaderboard](../LEADERBOARD.md#how-to-read-the-tables)."
)


def _rank_changes(found: Changes) -> list[str]:
    """Return a line for each track against the first, and all places."""
    lines = []
    for k in range(1, len(found.tracks)):
        _, track, leaders, was, fall, rise, tau, split = change_cells(found, k)
        lines.append(
            f"- *{track}*: first {leaders} (nominal: {was}); largest fall {fall}; largest rise "
            f"{rise}; Kendall's tau {tau}; {split} episodes"
        )
    return [*lines, "", *folded("All places", tables(*_places(found)))]


def _places(found: Changes) -> Table:
    heading = ["controller", *(short_name(name, found.tracks) for name in found.tracks)]
    lines = []
    for name, (first, *others) in found.places.items():
        cells = [_moved(place.first - first.first, str(place)) for place in others]
        lines.append([f"`{name}`", str(first), *cells])
    agreement = ["1", *(f"{tau:.2f}" for tau in found.agreement[1:])]
    lines.append(["*Kendall's tau*", *agreement])
    return heading, lines


def _moved(by: int, place: str) -> str:
    return place if not by else f"{place} ({'▼' if by > 0 else '▲'}{abs(by)})"


def _track(ordered: Track, figure: str | None) -> list[str]:
    """Return the section of a track."""
    content = views.content_of(ordered[0])
    columns = with_costs(columns_of(content))
    listing, made = standings.listing(ordered), claims.learned_claims(ordered)
    lines = [f"## {content['title']}", "", about(ordered[0]), ""]
    lines += [f"**{round_words(listing)}**", "", *_verdicts(ordered, made)]
    lines += _scores(listing, made)
    if figure:
        lines += [f"![error, effort and performance profiles]({figure})", ""]
    inside = standings.ordered(listing.inside)
    folds = {
        "Knowledge, preview and verification": _origins(ordered),
        "Public episodes, smooth references and costs": _more_scores(inside, columns),
        "Every metric": _metrics(inside, columns),
        "Interquartile means, and each row against the one above": _pairs(inside),
    }
    if views.by_setting(ordered[0]):
        folds["By setting"] = _settings(inside)
    for title, (heading, cells) in folds.items():
        lines += folded(title, tables(heading, cells))
    return lines


def _verdicts(ordered: Track, made: Sequence[Claim]) -> list[str]:
    """Return the best paper controller and the claim of each learned one against it."""
    paper = claims.best_paper(ordered)
    if paper is None:
        return []
    lines = [f"- Best paper controller: `{views.name_of(paper)}`."]
    for entry in made:
        lines.append(
            f"- `{views.name_of(entry.row)}`: {full_verdict(entry)}; lower by "
            f"{percent(entry.gain)}, P(improvement) {chance(entry.probability)}."
        )
    return [*lines, ""]


def _scores(listing: Listing, made: Sequence[Claim]) -> list[str]:
    """Return the tables of scores: ranked rows, rows with few training seeds, rows outside."""
    found = {views.name_of(entry.row): entry for entry in made}
    groups = (
        ("", listing.ranked, [str(place) for place in standings.ranks(listing.ranked)]),
        (f"Not ranked, fewer than {views.LISTED_SEEDS} training seeds:", listing.few, None),
        ("Not in the audit round, not ranked, public episodes:", listing.outside, None),
    )
    lines: list[str] = []
    for title, rows, places in groups:
        if rows:
            cells = _score_table(rows, places or ["-"] * len(rows), found)
            lines += [*([title, ""] if title else []), *tables(*cells), ""]
    return lines


def _score_table(rows: Track, places: Sequence[str], made: Mapping[str, Claim]) -> Table:
    unit, factor = shown(views.content_of(rows[0]))
    split, audited = views.published_split(rows[0]), views.is_audited(rows[0])
    heading = ["rank", "controller", f"{split} RMS [{unit}] [95 %]"]
    heading += [f"audit - public [{unit}]"] * audited
    heading += [f"P(improvement), {split} episodes", "failures"]
    lines = []
    for row, place in zip(rows, places, strict=True):
        value, _, bounds = bounded(views.interval(row), factor).partition(" ")
        claim = made.get(views.name_of(row))
        failed, total = views.failures_of(row)
        line = [place, f"`{views.name_of(row)}`", f"**{value}** {bounds}"]
        line += [_gap_words(row)] if audited else []
        lines.append([*line, chance(claim.probability if claim else None), f"{failed} of {total}"])
    return heading, lines


def _gap_words(row: Row) -> str:
    """Return the gap, bold if significant, and the number of the artefact if not the first.

    A changed artefact is audited anew, so that a high number shows that earlier gaps were seen.
    """
    words = signed(views.gap(row), views.factor_of(row))
    marked = f"**{words}**" if views.is_worse_unseen(row) else words
    audited = views.artefacts_audited(row)
    return f"{marked} (artefact {audited})" if audited > 1 else marked


def _origins(rows: Sequence[Row]) -> Table:
    """Return kind, model knowledge, preview and verification of each row."""
    lines = []
    for row in rows:
        controller = row["controller"]
        preview = controller["preview_seconds"]
        lines.append(
            [
                f"`{controller['name']}`",
                kind_of(row),
                controller["knowledge"],
                f"{preview:g} s" if preview else "none",
                views.verified_words(row),
            ]
        )
    return ["controller", "kind", "knows", "preview", "state"], lines


def kind_of(row: Row) -> str:
    """Return the kind of a controller, with its number of training seeds."""
    seeds = views.training_seeds(row)
    if not seeds:
        return "classical"
    return f"{row['controller']['kind']}, {seeds} seed{'s' * (seeds != 1)}"


def _more_scores(rows: Sequence[Row], columns: Sequence[Column]) -> Table:
    """Return interquartile mean, public score, smooth references and costs of each row."""
    unit, factor = shown(views.content_of(rows[0]))
    costs = [column for column in columns if column[0] in COSTS]
    smooth = any(views.smooth(row) for row in rows)
    heading = ["controller", f"IQM [{unit}]", f"public RMS [{unit}]"]
    heading += [f"smooth references [{unit}]"] * smooth + [title for _, title, _ in costs]
    lines = []
    for row in rows:
        public = views.mean_of(row, split=PUBLIC)
        line = [f"`{views.name_of(row)}`", number(factor * views.middle(row).value)]
        line.append(number(factor * public))
        line += [bounded(views.smooth(row), factor)] if smooth else []
        lines.append([*line, *_means(row, costs)])
    return heading, lines


def _means(row: Row, columns: Iterable[Column]) -> list[str]:
    return [number(factor * views.mean_of(row, metric)) for metric, _, factor in columns]


def _metrics(rows: Sequence[Row], columns: Sequence[Column]) -> Table:
    unit, factor = shown(views.content_of(rows[0]))
    heading = ["controller", f"RMS [{unit}]", *(title for _, title, _ in columns)]
    return heading, [
        [f"`{views.name_of(row)}`", number(factor * views.mean_of(row)), *_means(row, columns)]
        for row in rows
    ]


def _pairs(rows: Sequence[Row]) -> Table:
    unit, _ = shown(views.content_of(rows[0]))
    heading = ["controller", f"IQM of RMS [{unit}] [95 %]"]
    heading += [f"RMS minus the row above [{unit}] [95 %]", "better than the row above in"]
    above = [None, *rows[:-1]]
    return heading, [_pair(row, other) for row, other in zip(rows, above, strict=True)]


def _pair(row: Row, above: Row | None) -> list[str]:
    factor = views.factor_of(row)
    line = [f"`{views.name_of(row)}`", bounded(views.middle(row), factor)]
    gap = None if above is None else standings.difference(row, above)
    share = None if above is None else standings.improvement(row, above)
    if gap is None or share is None:
        return [*line, "-", "-"]
    return [*line, signed(gap, factor), f"{100.0 * share.value:.0f} %"]


def _settings(rows: Sequence[Row]) -> Table:
    keys = list(views.by_setting(rows[0]))
    lines = []
    for row in rows:
        found, factor = views.by_setting(row), views.factor_of(row)
        values = [number(factor * found.get(key, float(np.nan))) for key in keys]
        lines.append([f"`{views.name_of(row)}`", *values])
    return ["controller", *(f"{axis} {point}" for axis, point in keys)], lines


def _costs(rows: Sequence[Row]) -> list[str]:
    """Return tuning and training of each controller."""
    heading = ["controller", "kind", "tuning", "trials", "seeds", "steps a seed", "time a seed"]
    heading += ["hardware"]
    entries = {views.name_of(row): row for row in sorted(rows, key=lambda row: row["row"])}
    lines = []
    for name in sorted(entries):
        row, cost = entries[name], views.cost_of(entries[name])
        trials = "-" if cost.trials is None else str(cost.trials)
        seeds = views.training_seeds(row)
        line = [f"`{name}`", row["controller"]["kind"], cost.tuning or "-", trials]
        line += [str(seeds) if row["controller"]["kind"] != "classical" else "-"]
        lines.append([*line, millions(cost.steps), duration(cost.seconds), cost.hardware or "-"])
    return ["As stated by the author of the row, not verified.", "", *tables(heading, lines)]


def _controllers(rows: Sequence[Row]) -> list[str]:
    """Return a line for each controller with the keys of its sources, then the sources."""
    entries = {views.name_of(row): row["controller"] for row in rows}
    lines, named = [], set[str]()
    for name in sorted(entries):
        keys = methods(entries[name]["citation"])
        cited = f" ({', '.join(keys)})" if keys else ""
        lines.append(f"- `{name}`: {entries[name]['summary']}{cited}")
        named |= set(keys)
    sources = [f"- {key}: {citations.in_words(key)}" for key in sorted(named)]
    return [*lines, "", "## Sources", "", *sources] if sources else lines
