"""The part of the board that is about one track."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from benchmarks.board import accessors as views
from benchmarks.board import claims, standings
from benchmarks.board.claims import Claim
from benchmarks.board.format import bounded, chance, folded, linked, number, signed, table
from benchmarks.board.standings import Listing
from benchmarks.board.summary import plain_verdict
from benchmarks.runs.rows import Row, shown
from benchmarks.scoring.metrics import headline_of

Column = tuple[str, str, float]
"""Metric, heading and factor from SI."""


def with_costs(columns: Sequence[Column]) -> tuple[Column, ...]:
    """Return the columns, and the constraint cost where it is not among them: claims rest on it."""
    if any(metric == "constraint_cost" for metric, _, _ in columns):
        return tuple(columns)
    return (*columns, ("constraint_cost", "constraint cost", 1.0))


def track_page(rows: Sequence[Row], columns: Sequence[Column], figure: str | None) -> list[str]:
    """Return the lines of a track: its main table, and the wide ones folded.

    Parameters
    ----------
    rows : sequence of rows
        Of the track.
    columns : sequence of (metric, heading, factor)
        After the headline.
    figure : str, optional
        Path of the track's picture.
    """
    listing, best_first = standings.listing(rows), standings.ordered(rows)
    made = claims.learned_claims(best_first)
    lines = [*_title(best_first), *_round_line(listing), *_verdict_line(best_first, made)]
    lines += _main(listing, made, columns)
    if figure:
        lines += [f"![error, effort and profiles]({figure})", ""]
    inside = standings.ordered(listing.inside)
    wide = [table(*_all_columns(inside, columns)), table(*_pairs(inside))]
    titles = ["Every metric", "Interquartile means, and each row against the one above"]
    if any(point for point in views.by_setting(best_first[0])):
        wide.append(table(*_settings(inside)))
        titles.append("By setting")
    for title, content in zip(titles, wide, strict=True):
        lines += folded(title, content)
    return lines


def _title(best_first: Sequence[Row]) -> list[str]:
    first = best_first[0]
    return [f"### {views.content_of(first)['title']}", "", about(first), ""]


def about(row: Row) -> str:
    """Return a sentence on the track of a row: environment, scenarios, what is scored."""
    content, scenarios = views.content_of(row), len(row["plants"])
    unit, factor = shown(content)
    public = len(views.pairs_of(row, views.PUBLIC))
    return (
        f"`{row['env']['id']}`, scenarios `{views.track_of(row)}` version {content['version']} "
        f"(`{row['scenarios']['digest'][:12]}`): {scenarios} scenarios, {public} public episodes, "
        f"settling window {content['settle_seconds']:g} s, worst case "
        f"{factor * content['worst_case'][headline_of(content)]:g} {unit}."
    )


def round_words(listing: Listing) -> str:
    """Return which audit round the scores of a track are of, and who is in it."""
    first = listing.inside[0]
    if not views.is_audited(first):
        return "Self-reported: no audit round yet, all of it is of the public episodes."
    found, total = views.round_of(first), len(listing.inside) + len(listing.outside)
    episodes = len(views.pairs_of(first, views.AUDIT))
    words = (
        f"Audit round {found['round']}, drawn {found['drawn']}: {episodes} episodes that nobody "
        f"could tune to, {len(listing.inside)} of {total} rows."
    )
    if listing.missing:
        words += f" In the round and without a row: {', '.join(listing.missing)}."
    return words


def _round_line(listing: Listing) -> list[str]:
    return [f"**{round_words(listing)}**", ""]


def _verdict_line(best_first: Sequence[Row], made: Sequence[Claim]) -> list[str]:
    paper = claims.best_paper(best_first)
    if paper is None:
        return []
    words = f"Best paper controller: `{views.name_of(paper)}`."
    for entry in made:
        words += f" `{views.name_of(entry.row)}`: {plain_verdict(entry)}."
    return [words, ""]


def _main(listing: Listing, made: Sequence[Claim], columns: Sequence[Column]) -> list[str]:
    found = {views.name_of(entry.row): entry for entry in made}
    places = [str(place) for place in standings.ranks(listing.ranked)]
    lines: list[str] = []
    if listing.ranked:
        lines += [*_short_table(listing.ranked, places, found, columns), ""]
    for title, rows in (
        (f"Not ranked, fewer than {views.LISTED_SEEDS} training seeds:", listing.few),
        ("Not in the audit round, not ranked; scores of the public episodes:", listing.outside),
    ):
        if rows:
            lines += [title, "", *_short_table(rows, ["-"] * len(rows), found, columns), ""]
    return lines


def _short_table(
    rows: Sequence[Row],
    places: Sequence[str],
    made: Mapping[str, Claim],
    columns: Sequence[Column],
) -> list[str]:
    unit, _ = shown(views.content_of(rows[0]))
    costs = [column for column in columns if column[0] in claims.COSTS]
    audited, split = views.is_audited(rows[0]), views.published_split(rows[0])
    smooth = any(views.smooth(row) for row in rows)
    heading = ["rank", "controller", "kind", "knows", "preview", f"{split} RMS [{unit}] [95 %]"]
    heading += [f"IQM [{unit}]"]
    heading += [f"public RMS [{unit}]", f"audit - public [{unit}]"] * audited
    heading += [f"smooth references [{unit}]"] * smooth
    heading += [f"P(improvement), {split} episodes", *(title for _, title, _ in costs)]
    heading += ["failures", "state"]
    lines = [
        _short_line(row, place, made.get(views.name_of(row)), costs, smooth)
        for row, place in zip(rows, places, strict=True)
    ]
    return table(heading, lines)


def _short_line(
    row: Row, place: str, claim: Claim | None, costs: Sequence[Column], smooth: bool
) -> list[str]:
    controller, factor = row["controller"], views.factor_of(row)
    value, _, bounds = bounded(views.interval(row), factor).partition(" ")
    failed, total = views.failures_of(row)
    line = [
        place,
        linked(row),
        kind_of(row),
        controller["knowledge"],
        f"{controller['preview_seconds']:g} s" if controller["preview_seconds"] else "none",
        f"**{value}** {bounds}",
        number(factor * views.middle(row).value),
    ]
    if views.is_audited(row):
        public = number(factor * views.mean_of(row, split=views.PUBLIC))
        line += [public, _gap_words(row)]
    if smooth:
        line.append(bounded(views.smooth(row), factor))
    line.append(chance(claim.probability if claim else None))
    line += [number(f * views.mean_of(row, metric)) for metric, _, f in costs]
    return [*line, f"{failed} of {total}", views.verified_words(row)]


def _gap_words(row: Row) -> str:
    """Return the gap, bold where it is one, with the number of the artefact if not the first.

    Whoever changes an artefact is audited anew: a number of many says that the gap was looked at.
    """
    words = signed(views.gap(row), views.factor_of(row))
    marked = f"**{words}**" if views.is_worse_unseen(row) else words
    audited = views.artefacts_audited(row)
    return f"{marked} (artefact {audited})" if audited > 1 else marked


def kind_of(row: Row) -> str:
    """Return the kind of a controller, with its training seeds where it has some."""
    seeds = views.training_seeds(row)
    return (
        f"{row['controller']['kind']}, {seeds} seed{'s' * (seeds != 1)}" if seeds else "classical"
    )


def _all_columns(
    rows: Sequence[Row], columns: Sequence[Column]
) -> tuple[list[str], list[list[str]]]:
    unit, factor = shown(views.content_of(rows[0]))
    heading = ["controller", f"RMS [{unit}]", *(title for _, title, _ in columns)]
    lines = [
        [
            f"`{views.name_of(row)}`",
            number(factor * views.mean_of(row)),
            *(number(f * views.mean_of(row, metric)) for metric, _, f in columns),
        ]
        for row in rows
    ]
    return heading, lines


def _pairs(rows: Sequence[Row]) -> tuple[list[str], list[list[str]]]:
    unit, _ = shown(views.content_of(rows[0]))
    heading = ["controller", f"IQM of RMS [{unit}] [95 %]"]
    heading += [f"RMS minus the row above [{unit}] [95 %]", "better than the row above in"]
    above = [None, *rows[:-1]]
    return heading, [_pair_line(row, other) for row, other in zip(rows, above, strict=True)]


def _pair_line(row: Row, above: Row | None) -> list[str]:
    factor = views.factor_of(row)
    line = [f"`{views.name_of(row)}`", bounded(views.middle(row), factor)]
    gap = None if above is None else standings.difference(row, above)
    share = None if above is None else standings.improvement(row, above)
    if gap is None or share is None:
        return [*line, "-", "-"]
    return [*line, signed(gap, factor), f"{100.0 * share.value:.0f} %"]


def _settings(rows: Sequence[Row]) -> tuple[list[str], list[list[str]]]:
    keys = list(views.by_setting(rows[0]))
    lines = []
    for row in rows:
        found, factor = views.by_setting(row), views.factor_of(row)
        values = [number(factor * found.get(key, float(np.nan))) for key in keys]
        lines.append([f"`{views.name_of(row)}`", *values])
    return ["controller", *(f"{axis} {point}" for axis, point in keys)], lines
