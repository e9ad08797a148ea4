"""The part of the board that is about one track."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks import claims, standings, statistics, views
from benchmarks.board_format import bounded, folded, linked, number, signed, table
from benchmarks.board_summary import plain_verdict
from benchmarks.metrics import headline_of
from benchmarks.rows import Row, shown
from benchmarks.standings import Listing

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
    paper = claims.best_paper(best_first)
    lines = [*_title(best_first), *_verdict_line(best_first, paper)]
    lines += _main(listing, paper, columns)
    if figure:
        lines += [f"![error, effort and profiles]({figure})", ""]
    wide = [table(*_all_columns(best_first, columns)), table(*_pairs(best_first))]
    titles = ["Every metric", "Interquartile means, and each row against the one above"]
    if any(point for point in views.by_setting(best_first[0])):
        wide.append(table(*_settings(best_first)))
        titles.append("By setting")
    for title, content in zip(titles, wide, strict=True):
        lines += folded(title, content)
    return lines


def _title(best_first: Sequence[Row]) -> list[str]:
    first = best_first[0]
    content = views.content_of(first)
    unit, factor = shown(content)
    lines = [
        f"### {content['title']}",
        "",
        f"`{first['env']['id']}`, scenarios `{views.track_of(first)}` version "
        f"{content['version']} (`{first['scenarios']['digest'][:12]}`), {len(first['plants'])} "
        f"scenarios x {len(first['seeds'])} public seeds, settling window "
        f"{content['settle_seconds']:g} s, worst case "
        f"{factor * content['worst_case'][headline_of(content)]:g} {unit}.",
        "",
    ]
    if len({(row["scenarios"]["digest"], row.get("task")) for row in best_first}) > 1:
        lines += ["**These rows are not of one scenario file: run the track again.**", ""]
    return lines


def _verdict_line(best_first: Sequence[Row], paper: Row | None) -> list[str]:
    if paper is None:
        return []
    words = f"Best paper controller: `{views.name_of(paper)}`."
    for entry in claims.learned_claims(best_first):
        words += f" `{views.name_of(entry.row)}`: {plain_verdict(entry)}."
    return [words, ""]


def _main(listing: Listing, paper: Row | None, columns: Sequence[Column]) -> list[str]:
    ranked = listing.ranked
    places = [str(place) for place in standings.ranks(ranked)]
    lines: list[str] = []
    if not listing.audited and listing.reported:
        lines += ["Self-reported: no row of this track has been audited yet.", ""]
    if ranked:
        lines += [*_short_table(ranked, places, paper, columns), ""]
    if listing.audited and listing.reported:
        lines += ["Self-reported, without an audit, not ranked:", ""]
        unranked = ["-"] * len(listing.reported)
        lines += [*_short_table(listing.reported, unranked, paper, columns), ""]
    if listing.few:
        lines += [f"Not ranked, fewer than {views.LISTED_SEEDS} training seeds:", ""]
        lines += [*_short_table(listing.few, ["-"] * len(listing.few), paper, columns), ""]
    return lines


def _short_table(
    rows: Sequence[Row], places: Sequence[str], paper: Row | None, columns: Sequence[Column]
) -> list[str]:
    unit, _ = shown(views.content_of(rows[0]))
    costs = [column for column in columns if column[0] in claims.COSTS]
    smooth = any(views.smooth(row) for row in rows)
    heading = ["rank", "controller", "kind", "knows", "preview", f"RMS [{unit}] [95 %]"]
    heading += [f"audit - public [{unit}]"] * any(views.is_audited(row) for row in rows)
    heading += [f"smooth references [{unit}]"] * smooth
    heading += ["P(improvement)", *(title for _, title, _ in costs), "failures"]
    lines = [
        _short_line(row, place, paper, costs, heading)
        for row, place in zip(rows, places, strict=True)
    ]
    return table(heading, lines)


def _short_line(
    row: Row, place: str, paper: Row | None, costs: Sequence[Column], heading: Sequence[str]
) -> list[str]:
    controller, factor = row["controller"], views.factor_of(row)
    head = views.interval(row)
    value, _, bounds = bounded(head, factor).partition(" ")
    failed, total = views.failures_of(row)
    line = [
        place,
        linked(row),
        kind_of(row),
        controller["knowledge"],
        f"{controller['preview_seconds']:g} s" if controller["preview_seconds"] else "none",
        f"**{value}** {bounds}",
    ]
    if any(name.startswith("audit") for name in heading):
        line.append(_gap_words(row))
    if any(name.startswith("smooth") for name in heading):
        line.append(bounded(views.smooth(row), factor))
    line.append(_probability(row, paper))
    line += [number(f * views.mean_of(row, metric)) for metric, _, f in costs]
    return [*line, f"{failed} of {total}"]


def _gap_words(row: Row) -> str:
    """Return the gap, bold where it is one, with the number of the salt where it is not the first.

    Whoever changes an artefact gets a new salt: a number of many says that the gap was looked at.
    """
    words = signed(views.gap(row), views.factor_of(row))
    marked = f"**{words}**" if views.is_worse_unseen(row) else words
    drawn = views.salts_drawn(row)
    return f"{marked} (salt {drawn})" if drawn > 1 else marked


def kind_of(row: Row) -> str:
    """Return the kind of a controller, with its training seeds where it has some."""
    seeds = views.training_seeds(row)
    return (
        f"{row['controller']['kind']}, {seeds} seed{'s' * (seeds != 1)}" if seeds else "classical"
    )


def _probability(row: Row, paper: Row | None) -> str:
    if paper is None or row is paper or row["controller"]["kind"] == "classical":
        return "-"
    found = standings.improvement(row, paper)
    return "-" if found is None else f"{found.value:.2f} [{found.low:.2f}, {found.high:.2f}]"


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
    middle = views.table_interval(
        views.scores(row, split=views.published_split(row)), statistics.interquartile_mean
    )
    line = [f"`{views.name_of(row)}`", bounded(middle, factor)]
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
