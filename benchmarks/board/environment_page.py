"""Page of one environment: its tracks, rank changes, controllers and their cost."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from benchmarks.board import accessors as views
from benchmarks.board import claims, standings
from benchmarks.board import format as fmt
from benchmarks.board.cite import methods_of
from benchmarks.board.claims import Claim
from benchmarks.board.standings import Changes, Listing, Track
from benchmarks.board.words import (
    Cells,
    about,
    by_controller,
    change_cells,
    full_verdict,
    kind_of,
    round_words,
    short_name,
)
from benchmarks.runs.cells import PUBLIC
from benchmarks.runs.rows import Row
from benchmarks.scoring.group import Column
from benchmarks.scoring.metrics import COSTS, columns_of
from pam_envs import citations

INTRODUCTION = (
    "Written by `python -m benchmarks board`; do not edit. The columns are explained in the "
    "[leaderboard](../LEADERBOARD.md#how-to-read-the-tables)."
)


def page_text(name: str, tracks: Mapping[str, Track], figures: Mapping[str, str]) -> str:
    """Return the page of an environment; ``figures`` are paths relative to it, by track."""
    entries = {views.name_of(row): row for ordered in tracks.values() for row in ordered}
    lines = [f"# {name}", "", INTRODUCTION, ""]
    for change in standings.changes(standings.ranked(tracks)):
        lines += ["## Rank changes between tracks", "", *_rank_changes(change)]
    for track, ordered in tracks.items():
        lines += _track(ordered, figures.get(track))
    lines += ["## Tuning and training", "", *_costs(tracks), ""]
    lines += ["## Controllers", "", *_controllers(entries), ""]
    return "\n".join(lines).rstrip() + "\n"


def _rank_changes(found: Changes) -> list[str]:
    """Return a line for each track against the first, and all places."""
    lines = []
    for k in range(1, len(found.tracks)):
        _, track, leaders, was, fall, rise, tau, split = change_cells(found, k)
        lines.append(
            f"- *{track}*: first {leaders} (nominal: {was}); largest fall {fall}; largest rise "
            f"{rise}; Kendall's tau {tau}; {split} episodes"
        )
    heading = ["controller", *(short_name(name, found.tracks) for name in found.tracks)]
    places = [
        [
            f"`{name}`",
            str(first),
            *(_moved(place.first - first.first, str(place)) for place in more),
        ]
        for name, (first, *more) in found.places.items()
    ]
    places.append(["*Kendall's tau*", "1", *(f"{tau:.2f}" for tau in found.agreement[1:])])
    return [*lines, "", *fmt.folded("All places", fmt.tables(heading, places))]


def _moved(by: int, place: str) -> str:
    return place if not by else f"{place} ({'▼' if by > 0 else '▲'}{abs(by)})"


def _track(ordered: Track, figure: str | None) -> list[str]:
    """Return the section of a track."""
    content = views.content_of(ordered[0])
    columns = columns_of(content)
    listing, made = standings.listing(ordered), claims.learned_claims(ordered)
    lines = [f"## {content['title']}", "", about(ordered[0]), ""]
    lines += [f"**{round_words(listing)}**", "", *_verdicts(ordered, made)]
    lines += _scores(listing, made)
    if figure:
        lines += [f"![error, effort and performance profiles]({figure})", ""]
    inside = standings.ordered(listing.inside)
    unit, factor = views.unit_of(inside[0])
    folds = {
        "Knowledge, preview and verification": _origins(ordered),
        "Public episodes, smooth references and costs": _more_scores(inside, columns),
        "Every metric": by_controller(inside, _means([("", f"RMS [{unit}]", factor), *columns])),
        "Interquartile means, and each row against the one above": _pairs(inside),
    }
    if settings := list(views.by_setting(ordered[0])):
        folds["By setting"] = _settings(inside, settings)
    for title, (heading, cells) in folds.items():
        lines += fmt.folded(title, fmt.tables(heading, cells))
    return lines


def _verdicts(ordered: Track, made: Sequence[Claim]) -> list[str]:
    """Return the best classical controller and the claim of each learned one against it."""
    rival = claims.best_classical(ordered)
    if rival is None:
        return []
    lines = [f"- Best classical controller: `{views.name_of(rival)}`."]
    for entry in made:
        lines.append(
            f"- `{views.name_of(entry.row)}`: {full_verdict(entry)}; "
            f"{fmt.reduction_words(entry.gain)}, P(improvement) {fmt.chance(entry.probability)}."
        )
    return [*lines, ""]


def _scores(listing: Listing, made: Sequence[Claim]) -> list[str]:
    """Return the tables of scores: ranked rows, then those that are listed apart."""
    probabilities = {views.name_of(entry.row): entry.probability for entry in made}
    groups = (
        ("", listing.ranked, [str(place) for place in standings.ranks(listing.ranked)]),
        (f"Not ranked, fewer than {views.LISTED_SEEDS} training seeds:", listing.few, None),
        ("Not in the audit round, not ranked, public episodes:", listing.outside, None),
        ("Designed from the plant of each episode, not ranked:", listing.informed, None),
    )
    lines: list[str] = []
    for title, rows, places in groups:
        if rows:
            unit, split = views.unit_of(rows[0])[0], views.published_split(rows[0])
            columns: Cells = {f"{split} RMS [{unit}] [95 %]": _bold_score}
            for metric, name, factor in views.headlines(rows[0]):
                columns[f"{name} [95 %]"] = partial(_bounded, metric, factor)
            if views.is_audited(rows[0]):
                columns[f"audit - public [{unit}]"] = _gap_words
            columns[f"P(improvement), {split} episodes"] = lambda row: fmt.chance(
                probabilities.get(views.name_of(row))
            )
            columns["failures"] = lambda row: "{} of {}".format(*views.failures_of(row))
            heading, cells = by_controller(rows, columns)
            ranked = zip(places or ["-"] * len(rows), cells, strict=True)
            table = fmt.tables(["rank", *heading], [[place, *line] for place, line in ranked])
            lines += [*([title, ""] if title else []), *table, ""]
    return lines


def _bold_score(row: Row) -> str:
    value, _, bounds = fmt.bounded(views.interval(row), views.unit_of(row)[1]).partition(" ")
    return f"**{value}** {bounds}"


def _bounded(metric: str, factor: float, row: Row) -> str:
    return fmt.bounded(views.interval(row, metric), factor)


def _gap_words(row: Row) -> str:
    """Return the gap, bold if significant, and the number of the artefact if not the first.

    A changed artefact is audited again, so that a high number means that earlier gaps were known.
    """
    words = fmt.signed(views.gap(row), views.unit_of(row)[1])
    marked = f"**{words}**" if views.is_worse_unseen(row) else words
    entry = int(row["audit"]["entry"])
    return f"{marked} (artefact {entry})" if entry > 1 else marked


def _origins(rows: Sequence[Row]) -> fmt.Table:
    """Return kind, model knowledge, preview and verification of each row."""

    def preview(row: Row) -> str:
        seconds = views.preview_of(row)
        return f"{seconds:g} s" if seconds else "none"

    columns: Cells = {
        "kind": kind_of,
        "knows": lambda row: row["controller"]["knowledge"],
        "preview": preview,
        "state": views.verified_words,
    }
    return by_controller(rows, columns)


def _means(columns: Sequence[Column]) -> Cells:
    """Return columns with means over the published episodes."""

    def mean(metric: str, factor: float, row: Row) -> str:
        return fmt.number(factor * views.mean_of(row, metric))

    return {title: partial(mean, metric, factor) for metric, title, factor in columns}


def _more_scores(rows: Sequence[Row], columns: Sequence[Column]) -> fmt.Table:
    """Return interquartile mean, public score, smooth references and costs of each row."""
    unit, factor = views.unit_of(rows[0])
    costs = [c for c in columns if c[0] in COSTS and c not in views.headlines(rows[0])]
    cells: Cells = {
        f"IQM [{unit}]": lambda row: fmt.number(factor * views.middle(row).value),
        f"public RMS [{unit}]": lambda row: fmt.number(factor * views.mean_of(row, split=PUBLIC)),
    }
    if any(views.smooth(row) for row in rows):
        cells[f"smooth references [{unit}]"] = lambda row: fmt.bounded(views.smooth(row), factor)
    return by_controller(rows, {**cells, **_means(costs)})


def _pairs(rows: Sequence[Row]) -> fmt.Table:
    """Return interquartile means, and each row's difference to the row above."""
    unit, factor = views.unit_of(rows[0])
    above = dict(zip((row["row"] for row in rows[1:]), rows, strict=False))

    def compared(row: Row) -> tuple[str, str]:
        other = above.get(row["row"])
        gap = standings.difference(row, other) if other else None
        share = standings.improvement(row, other) if other else None
        if gap is None or share is None:
            return "-", "-"
        return fmt.signed(gap, factor), f"{100.0 * share.value:.0f} %"

    columns: Cells = {
        f"IQM of RMS [{unit}] [95 %]": lambda row: fmt.bounded(views.middle(row), factor),
        f"RMS minus the row above [{unit}] [95 %]": lambda row: compared(row)[0],
        "better than the row above in": lambda row: compared(row)[1],
    }
    return by_controller(rows, columns)


def _settings(rows: Sequence[Row], keys: Sequence[tuple[str, str]]) -> fmt.Table:
    found = {row["row"]: views.by_setting(row) for row in rows}

    def cell(key: tuple[str, str], row: Row) -> str:
        return fmt.number(views.unit_of(row)[1] * found[row["row"]].get(key, float(np.nan)))

    return by_controller(rows, {f"{key[0]} {key[1]}": partial(cell, key) for key in keys})


def _costs(tracks: Mapping[str, Track]) -> list[str]:
    """Return tuning and training of each controller."""
    rows = sorted((row for track in tracks.values() for row in track), key=lambda row: row["row"])
    entries = {views.name_of(row): row for row in rows}
    columns: Cells = {
        "kind": lambda row: row["controller"]["kind"],
        "tuning": lambda row: views.cost_of(row).tuning or "-",
        "trials": lambda row: "-" if (n := views.cost_of(row).trials) is None else str(n),
        "seeds": lambda row: str(views.training_seeds(row) or "-"),
        "steps a seed": lambda row: fmt.millions(views.cost_of(row).steps),
        "time a seed": lambda row: fmt.duration(views.cost_of(row).seconds),
        "hardware": lambda row: views.cost_of(row).hardware or "-",
    }
    table = by_controller([entries[name] for name in sorted(entries)], columns)
    return ["As stated by the author of the row, not verified.", "", *fmt.tables(*table)]


def _controllers(entries: Mapping[str, Row]) -> list[str]:
    """Return a line for each controller with the keys of its sources, then the sources."""
    lines, named = [], set[str]()
    for name in sorted(entries):
        about = entries[name]["controller"]
        keys = methods_of(about)
        cited = f" ({', '.join(keys)})" if keys else ""
        lines.append(f"- `{name}`: {about['summary']}{cited}")
        named |= set(keys)
    sources = [f"- {key}: {citations.in_words(key)}" for key in sorted(named)]
    return [*lines, "", "## Sources", "", *sources] if sources else lines
