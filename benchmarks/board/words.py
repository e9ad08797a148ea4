"""Common sentences and table cells of the board's pages and the site."""

from collections.abc import Callable, Sequence

from benchmarks.board import accessors as views
from benchmarks.board.claims import Claim
from benchmarks.board.format import Table, bounded, number
from benchmarks.board.standings import Changes, Listing
from benchmarks.runs.cells import AUDIT, PUBLIC
from benchmarks.runs.rows import Row
from benchmarks.scoring.metrics import columns_of, headline_of

Cells = dict[str, Callable[[Row], str]]
"""Columns of a table by their headings, each a function of a row."""


def by_controller(rows: Sequence[Row], columns: Cells) -> Table:
    """Return a table with a line for each row, beginning with the controller's name."""
    lines = [[f"`{views.name_of(row)}`", *(cell(row) for cell in columns.values())] for row in rows]
    return ["controller", *columns], lines


def short_env(env: str) -> str:
    """Return the name of an environment without namespace and version."""
    return env.removeprefix("PAM/").rpartition("-v")[0]


def about(row: Row) -> str:
    """Return a sentence on the track of a row: environment, scenarios, scoring."""
    content, scenarios = views.content_of(row), len(row["plants"])
    unit, factor = views.unit_of(row)
    public = len(views.pairs_of(row, PUBLIC))
    return (
        f"`{row['env']['id']}`, scenarios `{views.track_of(row)}` version {content['version']} "
        f"(`{row['scenarios']['digest'][:12]}`): {scenarios} scenarios, {public} public episodes, "
        f"settling window {content['settle_seconds']:g} s, worst case "
        f"{factor * content['worst_case'][headline_of(content)]:g} {unit}."
    )


def round_words(listing: Listing) -> str:
    """Return the audit round of a track's scores and its entrants."""
    first = listing.inside[0]
    if not views.is_audited(first):
        return "Self-reported: no audit round yet, all scores are of the public episodes."
    found, total = first["audit"], len(listing.inside) + len(listing.outside)
    episodes = len(views.pairs_of(first, AUDIT))
    words = (
        f"Audit round {found['round']}, drawn {found['drawn']}: {episodes} episodes with seeds "
        f"unknown before, {len(listing.inside)} of {total} rows."
    )
    if listing.missing:
        words += f" In the round and without a row: {', '.join(listing.missing)}."
    return words


def scores_by_title(row: Row | None, split: str) -> dict[str, str]:
    """Return RMS and headlines of a row over the episodes of a split, with intervals and unit."""
    if row is None:
        return {}
    unit, factor = views.unit_of(row)
    scores = {"RMS": f"{bounded(views.interval(row, split=split), factor)} {unit}"}
    for metric, title, scale in views.headlines(row):
        scores[title] = bounded(views.interval(row, metric, split), scale)
    return scores


def score_words(row: Row, split: str) -> str:
    """Return the scores of a row in words, the RMS first and without its name."""
    (_, score), *more = scores_by_title(row, split).items()
    return ", ".join([score, *(f"{title} {value}" for title, value in more)])


def largest_cost(entry: Claim) -> str:
    """Return the cost whose ratio to the classical controller's is the largest."""
    name, ratio = max(entry.ratios.items(), key=lambda item: item[1])
    return f"{number(ratio)}x {name}"


def full_verdict(entry: Claim) -> str:
    """Return the verdict of a claim with its reasons and remarks."""
    words = "; ".join((*entry.reasons, *entry.remarks))
    return f"{entry.verdict} ({words})" if words else entry.verdict


def change_cells(found: Changes, k: int) -> list[str]:
    """Return the cells of the k-th track of an environment against its first.

    Environment, track, leaders, their places in the first track, largest fall, largest rise,
    Kendall's tau, episodes.
    """

    def move(name: str) -> str:
        return f"`{name}` {found.places[name][0]} → {found.places[name][k]}"

    moves = {name: places[0].first - places[k].first for name, places in found.places.items()}
    leaders = [name for name, places in found.places.items() if places[k].first == 1]
    fall, rise = min(moves, key=lambda n: moves[n]), max(moves, key=lambda n: moves[n])
    return [
        f"`{found.env}`",
        short_name(found.tracks[k], found.tracks),
        ", ".join(f"`{name}`" for name in leaders),
        ", ".join(str(found.places[name][0]) for name in leaders),
        move(fall) if moves[fall] < 0 else "-",
        move(rise) if moves[rise] > 0 else "-",
        f"{found.agreement[k]:.2f}",
        " / ".join(dict.fromkeys((found.splits[0], found.splits[k]))),
    ]


def short_name(track: str, tracks: Sequence[str]) -> str:
    """Return a track's name without the prefix common to all tracks of its environment."""
    words = [name.split("_") for name in tracks]
    common = 0
    while all(len(w) > common + 1 and w[common] == words[0][common] for w in words):
        common += 1
    return " ".join(track.split("_")[common:])


def kind_of(row: Row) -> str:
    """Return the kind of a controller, with its number of training seeds."""
    seeds = views.training_seeds(row)
    if not seeds:
        return "classical"
    return f"{row['controller']['kind']}, {seeds} seed{'s' * (seeds != 1)}"


def row_text(row: Row) -> str:
    """Return a row in words: origin, headline of each split, every metric, every setting."""
    controller, content = row["controller"], views.content_of(row)
    unit, factor = views.unit_of(row)
    splits = [split for split in (PUBLIC, AUDIT) if views.pairs_of(row, split)]
    lines = [
        str(row["row"]),
        f"  {controller['summary']}",
        f"  {kind_of(row)}; knows: {controller['knowledge']}; commit {row['made_with']['commit']}",
        f"  {about(row).replace('`', '')}",
    ]
    for split in splits:
        failed, total = views.failures_of(row, split)
        score = bounded(views.interval(row, split=split), factor)
        lines.append(f"{split} RMS: {score} {unit}; {failed} of {total} episodes failed")
    lines.append(f"metrics ({' and '.join(splits)} episodes):")
    for metric, title, scale in columns_of(content):
        means = (number(scale * views.mean_of(row, metric, split)) for split in splits)
        lines.append(f"  {title:44s} {'  '.join(f'{mean:>9s}' for mean in means)}")
    for (axis, point), value in views.by_setting(row).items():
        lines.append(f"  {f'RMS, {axis} {point} [{unit}]':44s} {number(factor * value):>9s}")
    return "\n".join(lines)
