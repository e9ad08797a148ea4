"""What the page shows, as plain data: a pure function of the rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks import board_summary, cite, claims, standings, views
from benchmarks.board_format import bounded
from benchmarks.board_tables import Column, with_costs
from benchmarks.leaderboard import columns_of
from benchmarks.metrics import headline_of
from benchmarks.rows import Row, shown
from benchmarks.standings import Changes, Listing, Track
from benchmarks.statistics import Interval

GROUPS = {
    "audited": "Audited: the score is of episodes that nobody could tune to",
    "self-reported": "Self-reported: without an audit, the score is of the public episodes",
    "few": f"Not ranked: fewer than {views.LISTED_SEEDS} training seeds",
}


def board(rows: Sequence[Row]) -> dict[str, Any]:
    """Return all that the page shows but the trajectories.

    Parameters
    ----------
    rows : sequence of rows
        In any order.
    """
    tracks = standings.tracks(rows)
    changes = standings.changes(board_summary.ranked_rows(tracks))
    kinds = {views.name_of(row): row["controller"]["kind"] for row in rows}
    return {
        "groups": [{"name": name, "title": title} for name, title in GROUPS.items()],
        "tracks": [_track(name, ordered) for name, ordered in tracks.items()],
        "winners": [_winner(found) for found in board_summary.nominal(tracks).values()],
        "changes": [_change(found, kinds) for found in changes],
    }


def rounded(value: float | None) -> float | None:
    """Return a number with six digits, ``None`` for what is none."""
    return None if value is None or not np.isfinite(value) else float(f"{value:.6g}")


def _numbers(interval: Interval | None, factor: float = 1.0) -> list[float | None] | None:
    if interval is None or not np.isfinite(interval.value):
        return None
    return [rounded(factor * x) for x in (interval.value, interval.low, interval.high)]


def _track(name: str, ordered: Track) -> dict[str, Any]:
    first, listing = ordered[0], standings.listing(ordered)
    content = views.content_of(first)
    unit, factor = shown(content)
    columns = with_costs(columns_of(content))
    paper = claims.best_paper(ordered)
    return {
        "name": name,
        "title": str(content["title"]),
        "env": str(first["env"]["id"]),
        "about": (
            f"{first['env']['id']}, {name} version {content['version']}: {len(first['plants'])} "
            f"scenarios x {len(first['seeds'])} public seeds, settling window "
            f"{content['settle_seconds']:g} s, worst case "
            f"{factor * content['worst_case'][headline_of(content)]:g} {unit}."
        ),
        "digest": first["scenarios"]["digest"],
        "unit": unit,
        "factor": factor,
        "paper": "" if paper is None else views.name_of(paper),
        "figure": f"figures/{name}.svg",
        "columns": [title for _, title, _ in columns],
        "costs": [k for k, (metric, _, _) in enumerate(columns) if metric in claims.COSTS],
        "settings": [f"{axis} {point}" for axis, point in views.by_setting(first)],
        "rows": _rows(listing, columns, paper),
    }


def _rows(listing: Listing, columns: Sequence[Column], paper: Row | None) -> list[dict[str, Any]]:
    places = dict(
        zip(map(views.name_of, listing.ranked), standings.ranks(listing.ranked), strict=True)
    )
    groups = (listing.audited, listing.reported, listing.few)
    made = []
    for group, rows in zip(GROUPS, groups, strict=True):
        for row in rows:
            place = places.get(views.name_of(row))
            made.append(
                {
                    "group": group,
                    "rank": "-" if place is None else str(place),
                    "place": None if place is None else place.first,
                    **_row(row, columns, paper),
                }
            )
    return made


def _row(row: Row, columns: Sequence[Column], paper: Row | None) -> dict[str, Any]:
    controller, factor = row["controller"], views.factor_of(row)
    learned = controller["kind"] != "classical"
    against = claims.claim(row, paper) if learned and paper is not None else None
    times = row["volatile"].get("predict_us") or {}
    return {
        "row": row["row"],
        "controller": controller["name"],
        "kind": controller["kind"],
        "seeds": views.training_seeds(row),
        "knows": controller["knowledge"],
        "state": "audited" if views.is_audited(row) else "self-reported",
        "preview": rounded(controller["preview_seconds"]),
        "score": _numbers(views.interval(row), factor),
        "gap": _numbers(views.gap(row), factor),
        "worse": views.is_worse_unseen(row),
        "smooth": _numbers(views.smooth(row), factor),
        "chance": _numbers(against.probability) if against else None,
        "claim": board_summary.plain_verdict(against) if against else "",
        "metrics": [rounded(f * views.mean_of(row, metric)) for metric, _, f in columns],
        "settings": [rounded(factor * value) for value in views.by_setting(row).values()],
        "failures": list(views.failures_of(row)),
        "step_us": [rounded(times.get("median")), rounded(times.get("p99"))],
        "traces": bool(row.get("traces")),
        **_origin(row),
    }


def _origin(row: Row) -> dict[str, Any]:
    """Return what the row was made from and how it is run again."""
    controller, cost = row["controller"], views.cost_of(row)
    made = row["made_with"]
    return {
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
        "artefact": (controller.get("artefact") or {}).get("digest", ""),
        "made_with": ", ".join(f"{name} {v}" for name, v in sorted(made["packages"].items())),
        "commit": made["commit"],
        "again": again(row, cost),
        "bibtex": cite.bibtex(row),
    }


def _audit_words(row: Row) -> str:
    if not views.is_audited(row):
        return ""
    salt, drawn = row["audit"]["salt"], row["audit"]["drawn"]
    return f"salt {salt}, drawn {drawn}, number {views.salts_drawn(row)} of this name in this task"


def again(row: Row, cost: views.Cost) -> list[str]:
    """Return the commands that check the row, score the controller anew and train it again."""
    return [
        f"python -m benchmarks verify {row['row']}",
        f"python -m benchmarks run --env {row['env']['id']} --controller {views.name_of(row)} "
        f"--track {views.track_of(row)}",
        *([cost.command] if cost.command else []),
    ]


def _winner(found: board_summary.Winner) -> dict[str, Any]:
    paper, entry = found.paper, found.claim
    return {
        "env": found.env,
        "track": found.track,
        "paper": views.name_of(paper) if paper else "none",
        "paper_score": _score(paper),
        "learned": views.name_of(entry.row) if entry else "none",
        "learned_score": _score(entry.row if entry else None),
        "chance": _numbers(entry.probability) if entry else None,
        "cost": board_summary.largest_cost(entry) if entry else "-",
        "verdict": board_summary.plain_verdict(entry) if entry else found.silence,
        "better": entry is not None and entry.verdict == claims.BETTER,
    }


def _score(row: Row | None) -> str:
    if row is None:
        return "-"
    unit, factor = shown(views.content_of(row))
    return f"{bounded(views.interval(row), factor)} {unit}"


def _change(found: Changes, kinds: Mapping[str, str]) -> dict[str, Any]:
    names = list(found.places)
    count = range(len(found.tracks))

    def order(k: int) -> list[str]:
        return sorted(names, key=lambda name: found.places[name][k].first)

    return {
        "env": found.env,
        "tracks": [board_summary.short_name(name, found.tracks) for name in found.tracks],
        "places": {n: [[p.first, p.shared] for p in places] for n, places in found.places.items()},
        "order": [order(k) for k in count],
        "agreement": [rounded(tau) for tau in found.agreement],
        "learned": [name for name in names if kinds[name] != "classical"],
        "lines": [
            [cell.replace("`", "") for cell in board_summary.change_line(found, k)]
            for k in count[1:]
        ],
    }
