"""Summary of the board: learned against paper controllers, rank changes, pages, explanations."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.board import accessors as views
from benchmarks.board import claims, standings
from benchmarks.board.claims import Claim
from benchmarks.board.format import chance, number, percent, tables
from benchmarks.board.standings import Track
from benchmarks.board.words import change_cells, full_verdict, largest_cost, score_words, short_env
from benchmarks.runs.rows import Row
from benchmarks.scoring.group import Column

Tracks = Mapping[str, Track]
CONTROLLERS = "best paper controller<br>best learned"
"""Heading of the two names, each cell beside them with a line for each."""
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
NOMINAL = "*P* is the probability of improvement. With 95 % intervals, costs and reasons:"
RANK_CHANGES = """\
Each track against the nominal one of its environment, among the controllers that have run in all
of them. *Nominal place*: place of the leaders in the nominal track. Kendall's tau is 1 for the same
order.
"""


@dataclass(frozen=True)
class Winner:
    """The best paper controller of a track and the learned controller nearest to a claim.

    ``headlines`` are the metrics beside the RMS of the track.
    """

    env: str
    track: str
    headlines: tuple[Column, ...]
    paper: Row | None
    claim: Claim | None

    @property
    def split(self) -> str:
        """Split of the episodes on which the two are compared."""
        if self.claim is not None:
            return self.claim.split
        return "" if self.paper is None else views.published_split(self.paper)

    @property
    def learned(self) -> Row | None:
        """The learned controller of the claim."""
        return None if self.claim is None else self.claim.row

    @property
    def silence(self) -> str:
        """Reason why there is no claim."""
        if self.paper is None:
            return "no paper controller to compare with"
        return "no learned controller has been run"


def nominal(tracks: Tracks) -> dict[str, Winner]:
    """Return the leaders of each environment's nominal track (of all tracks if none is nominal)."""
    chosen = {name: rows for name, rows in tracks.items() if "nominal" in name} or dict(tracks)
    found = {}
    for name, rows in chosen.items():
        made = claims.learned_claims(rows)
        nearest = made[0] if made else None
        about = (views.env_of(rows[0]), name, views.headlines(rows[0]))
        found[name] = Winner(*about, claims.best_paper(rows), nearest)
    return found


def board_text(all_rows: Sequence[Row], pages: Mapping[str, str] | None = None) -> str:
    """Return LEADERBOARD.md; ``pages`` are the environments' paths relative to it."""
    tracks = standings.tracks(all_rows)
    if not tracks:
        return f"{INTRODUCTION}\n{NO_ROWS}\n"
    lines = [*INTRODUCTION.splitlines(), "", verified_words(all_rows), ""]
    lines += ["## Nominal tracks", "", *_winners(tracks), ""]
    lines += ["## Rank changes between tracks", "", *_rank_changes(tracks), ""]
    lines += ["## Environments", "", *_environments(tracks, pages or {}), ""]
    if words := _budgets(all_rows):
        lines += [words, ""]
    return "\n".join([*lines, READING.read_text(encoding="utf-8")])


def _winners(tracks: Tracks) -> list[str]:
    """Return tables of the nominal tracks, and a line with intervals and reasons for each.

    Tracks with the same headlines form a table.
    """
    found, lines = list(nominal(tracks).values()), list[str]()
    for headlines in dict.fromkeys(winner.headlines for winner in found):
        scores = ["RMS", *(title for _, title, _ in headlines)]
        heading = ["environment", CONTROLLERS, *scores, "lower by", "P", "verdict"]
        chosen = [winner for winner in found if winner.headlines == headlines]
        lines += [*tables(heading, [_line(winner) for winner in chosen]), ""]
    return [*lines, NOMINAL, "", *map(_detail, found)]


def _line(found: Winner) -> list[str]:
    entry = found.claim
    both = [_scores(row, found) for row in (found.paper, found.learned)]
    cells = [f"`{short_env(found.env)}`", *map("<br>".join, zip(*both, strict=True))]
    if entry is None:
        return [*cells, "-", "-", found.silence]
    bold = f"**{entry.verdict}**" if entry.verdict == claims.BETTER else entry.verdict
    return [*cells, f"{100.0 * entry.gain.value:+.2g} %", f"{entry.probability.value:.2f}", bold]


def _scores(row: Row | None, found: Winner) -> list[str]:
    """Return the name of a controller and its headlines."""
    if row is None:
        return ["none", *("-" for _ in ("RMS", *found.headlines))]
    unit, factor = views.unit_of(row)
    score = f"{number(factor * views.mean_of(row, split=found.split))} {unit}"
    more = [number(by * views.mean_of(row, name, found.split)) for name, _, by in found.headlines]
    return [f"`{views.name_of(row)}`", score, *more]


def _detail(found: Winner) -> str:
    """Return the intervals, the largest cost and the reasons of a nominal track's claim."""
    paper, entry = found.paper, found.claim
    words = f"- `{short_env(found.env)}`, {found.split or 'no'} episodes: "
    if paper is not None:
        words += f"`{views.name_of(paper)}` {score_words(paper, found.split)}"
    if entry is None:
        return f"{words}; {found.silence}"
    return (
        f"{words}, `{views.name_of(entry.row)}` {score_words(entry.row, entry.split)}; lower by "
        f"{percent(entry.gain)}; P(improvement) {chance(entry.probability)}; largest cost "
        f"{largest_cost(entry)}; {full_verdict(entry)}"
    )


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
