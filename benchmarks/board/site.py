"""Static site, a pure function of the rows: one folder, without server and network."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.board import accessors as views
from benchmarks.board import cite, claims, leaderboard, plots, standings, words
from benchmarks.board import summary as board_summary
from benchmarks.board.claims import Claim
from benchmarks.board.format import percent
from benchmarks.board.standings import Changes, Listing, Track
from benchmarks.identity.hashing import plain
from benchmarks.runs import rows
from benchmarks.runs.cells import PUBLIC
from benchmarks.runs.rows import Row
from benchmarks.runs.store import CHECKSUM, read_json, write_folder
from benchmarks.scoring.group import Column
from benchmarks.scoring.metrics import COSTS, columns_of
from benchmarks.scoring.statistics import Interval
from sweeps.progress import Advance, Start, unnoticed

ASSETS = Path(__file__).parent / "site_assets"
OUT = Path(__file__).parents[1] / "site"
GROUPS = {
    "ranked": "",
    "few": f"Not ranked: fewer than {views.LISTED_SEEDS} training seeds",
    "outside": "Not ranked, not in the audit round: all numbers are of the public episodes",
    "informed": "Not ranked: designed from the plant of each episode",
}
"""Parts of a track's table with their titles; the first has the track's round as its title."""


def build(results: Path = rows.RESULTS, out: Path = OUT, start: Start = unnoticed) -> list[Path]:
    """Write the site from the rows of a folder; equal rows give equal bytes.

    The progress counts the tracks twice: their tables, then their figures.
    """
    all_rows = leaderboard.load(results)
    texts = page(all_rows, start)
    for row in all_rows:
        stored = read_json(rows.path_of(str(row["row"]), results))
        texts[f"rows/{row['row']}.json"] = _json(stored) + "\n"
    return write_folder(out, texts)


def page(all_rows: Sequence[Row], start: Start = unnoticed) -> dict[str, str]:
    """Return the site's files by their names, ``index.html`` first."""
    advance = start(2 * len(standings.tracks(all_rows)))
    names = ("index.html", "page.css", "draw.js", "detail.js", "page.js")
    texts = {name: (ASSETS / name).read_text() for name in names}
    texts["data/board.js"] = f"const BOARD = {_json(board(all_rows, advance))};\n"
    for name, ordered in standings.tracks(all_rows).items():
        texts[f"figures/{name}.svg"] = plots.track_figure(ordered)
        advance()
    for row in sorted(all_rows, key=lambda row: str(row["row"])):
        if row.get("traces"):
            call = f"loadTraces({_json(row['row'])}, {_json(row['traces'])});\n"
            texts[f"data/traces/{row['row']}.js"] = call
    return texts


def _json(value: Any) -> str:
    """Return JSON that is valid in a script: ordered keys, ASCII letters."""
    return json.dumps(plain(value), separators=(",", ":"), allow_nan=False)


def board(all_rows: Sequence[Row], advance: Advance | None = None) -> dict[str, Any]:
    """Return the content of the site without the trajectories, from rows in any order."""
    tracks, shown = standings.tracks(all_rows), []
    for name, ordered in tracks.items():
        shown.append(_track(name, ordered))
        if advance is not None:
            advance()
    changes = standings.changes(standings.ranked(tracks))
    kinds = {views.name_of(row): row["controller"]["kind"] for row in all_rows}
    return {
        "groups": [{"name": name, "title": title} for name, title in GROUPS.items()],
        "tracks": shown,
        "winners": [_winner(found) for found in board_summary.nominal(tracks).values()],
        "changes": [_change(found, kinds) for found in changes],
    }


def rounded(value: float | None) -> float | None:
    """Return a number with six digits, ``None`` if it is not finite."""
    return None if value is None or not np.isfinite(value) else float(f"{value:.6g}")


def _numbers(interval: Interval | None, factor: float = 1.0) -> list[float | None] | None:
    if interval is None or not np.isfinite(interval.value):
        return None
    return [rounded(factor * x) for x in (interval.value, interval.low, interval.high)]


def _track(name: str, ordered: Track) -> dict[str, Any]:
    first, listing = ordered[0], standings.listing(ordered)
    content = views.content_of(first)
    unit, factor = views.unit_of(first)
    columns, headlines = columns_of(content), views.headlines(first)
    rival = claims.best_classical(ordered)
    return {
        "name": name,
        "title": str(content["title"]),
        "env": views.env_of(first),
        "about": words.about(first).replace("`", ""),
        "round": words.round_words(listing),
        "split": listing.split,
        "digest": first["scenarios"]["digest"],
        "unit": unit,
        "factor": factor,
        "rival": "" if rival is None else views.name_of(rival),
        "figure": f"figures/{name}.svg",
        "columns": [title for _, title, _ in columns],
        "headlines": [title for _, title, _ in headlines],
        "costs": [k for k, c in enumerate(columns) if c[0] in COSTS and c not in headlines],
        "settings": [f"{axis} {point}" for axis, point in views.by_setting(first)],
        "rows": _rows(listing, columns, claims.learned_claims(ordered)),
    }


def _rows(
    listing: Listing, columns: Sequence[Column], made: Sequence[Claim]
) -> list[dict[str, Any]]:
    found = {views.name_of(entry.row): entry for entry in made}
    ranks = dict(
        zip((r["row"] for r in listing.ranked), standings.ranks(listing.ranked), strict=True)
    )
    shown = []
    parts = (listing.ranked, listing.few, listing.outside, listing.informed)
    for group, own in zip(GROUPS, parts, strict=True):
        for row in own:
            place = ranks.get(row["row"])
            placed = {"group": group, "rank": str(place or "-"), "place": place and place.first}
            shown.append({**placed, **_row(row, columns, found.get(views.name_of(row)))})
    return shown


def _row(row: Row, columns: Sequence[Column], against: Claim | None) -> dict[str, Any]:
    controller, factor = row["controller"], views.unit_of(row)[1]
    times, cost = row["volatile"].get("predict_us") or {}, views.cost_of(row)
    trainings = views.by_training_seed(row).items()
    made, artefact = row["made_with"], controller.get("artefact") or {}
    return {
        "row": row["row"],
        "controller": controller["name"],
        "kind": controller["kind"],
        "seeds": views.training_seeds(row),
        "knows": controller["knowledge"],
        "state": "audited" if views.is_audited(row) else "self-reported",
        "verified": views.verified_words(row),
        "split": views.published_split(row),
        "preview": rounded(controller["preview_seconds"]),
        "score": _numbers(views.interval(row), factor),
        "headlines": [_numbers(views.interval(row, m), f) for m, _, f in views.headlines(row)],
        "iqm": _numbers(views.middle(row), factor),
        "public": _numbers(views.interval(row, split=PUBLIC), factor),
        "gap": _numbers(views.gap(row), factor),
        "worse": views.is_worse_unseen(row),
        "smooth": _numbers(views.smooth(row), factor),
        "chance": _numbers(against.probability) if against else None,
        "claim": words.full_verdict(against) if against else "",
        "metrics": [rounded(f * views.mean_of(row, metric)) for metric, _, f in columns],
        "settings": [rounded(factor * value) for value in views.by_setting(row).values()],
        "trainings": {str(seed): rounded(factor * value) for seed, value in trainings},
        "failures": list(views.failures_of(row)),
        "step_us": [rounded(times.get("median")), rounded(times.get("p99"))],
        "traces": bool(row.get("traces")),
        "summary": controller["summary"],
        "citation": controller["citation"],
        "cost": {
            "tuning": cost.tuning,
            "trials": cost.trials,
            "steps": rounded(cost.steps),
            "seconds": rounded(cost.seconds),
            "hardware": cost.hardware,
        },
        "audit": _audit_words(row),
        "task": row.get("task", ""),
        "artefact": artefact.get("digest", ""),
        "checksum": row.get(CHECKSUM, ""),
        "made_with": ", ".join(f"{name} {v}" for name, v in sorted(made["packages"].items())),
        "commit": made["commit"],
        "again": again(row, cost),
        "bibtex": cite.bibtex(row),
    }


def _audit_words(row: Row) -> str:
    found = row["audit"]
    if found is None:
        return ""
    return (
        f"round {found['round']}, drawn {found['drawn']}, salt {found['salt']}; artefact number "
        f"{found['entry']} of this name in the rounds of this track"
    )


def again(row: Row, cost: views.Cost) -> list[str]:
    """Return the commands that verify the row, score the controller and train it again."""
    return [
        f"python -m benchmarks verify {row['row']}",
        f"python -m benchmarks run --env {row['env']['id']} --controller {views.name_of(row)} "
        f"--track {views.track_of(row)}",
        *([cost.command] if cost.command else []),
    ]


def _winner(found: board_summary.Best) -> dict[str, Any]:
    rival, entry = found.classical, found.claim
    return {
        "env": found.env,
        "track": found.track,
        "split": found.split,
        "rival": views.name_of(rival) if rival else "none",
        "rival_scores": words.scores_by_title(rival, found.split),
        "learned": views.name_of(entry.row) if entry else "none",
        "learned_scores": words.scores_by_title(entry.row if entry else None, found.split),
        "chance": _numbers(entry.probability) if entry else None,
        "gain": percent(entry.gain) if entry else "-",
        "cost": words.largest_cost(entry) if entry else "-",
        "verdict": words.full_verdict(entry) if entry else found.silence,
        "better": entry is not None and entry.verdict == claims.BETTER,
    }


def _change(found: Changes, kinds: Mapping[str, str]) -> dict[str, Any]:
    names = list(found.places)
    count = range(len(found.tracks))

    def order(k: int) -> list[str]:
        return sorted(names, key=lambda name: found.places[name][k].first)

    return {
        "env": found.env,
        "tracks": [words.short_name(name, found.tracks) for name in found.tracks],
        "places": {n: [[p.first, p.shared] for p in places] for n, places in found.places.items()},
        "order": [order(k) for k in count],
        "agreement": [rounded(tau) for tau in found.agreement],
        "learned": [name for name in names if kinds[name] != "classical"],
        "lines": [
            [cell.replace("`", "") for cell in words.change_cells(found, k)] for k in count[1:]
        ],
    }
