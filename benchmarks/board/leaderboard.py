"""The board's files: a pure function of the rows, with equal bytes for equal rows."""

import html
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from benchmarks.board import accessors as views
from benchmarks.board import gap, plots, standings
from benchmarks.board.environment_page import page_text
from benchmarks.board.format import number, table
from benchmarks.board.summary import board_text, excerpt
from benchmarks.board.words import Cells, by_controller, short_env
from benchmarks.bounds import run as bounding
from benchmarks.bounds.run import Bounds
from benchmarks.identity import audit
from benchmarks.runs import rows, verified
from benchmarks.runs.rows import Row
from benchmarks.runs.store import write_folder
from pam_envs.files import write_text

BOARD = Path(__file__).parents[1] / "LEADERBOARD.md"
MARKUP = re.compile(r"([\\`\[\]])")
"""Characters that begin links, images and code in Markdown."""
README = Path(__file__).parents[2] / "README.md"
EXCERPT = re.compile(
    r"(<!-- leaderboard excerpt: begin -->\n).*?(\n<!-- leaderboard excerpt: end -->)", re.DOTALL
)
"""Marks of the table in README that the board writes."""
PAGES = "leaderboard"  # folder of the pages beside the board, with the figures and the times


def load(folder: Path) -> list[Row]:
    """Return the rows of a folder with their verifications and their place in the last round."""
    if not folder.is_dir():
        raise ValueError(f"{folder}: no such folder of rows; run `python -m benchmarks run` first")
    found = verified.committed(folder)
    loaded = []
    for row in rows.load_all(folder):  # without an audit if it is not of the last round
        last = audit.last(views.track_of(row)) if audit.in_last_round(row) else None
        held = {**row["audit"], "entrants": last.entrants} if last else None
        loaded.append({**row, "audit": held, views.VERIFIED: verified.of(row, found)})
    return loaded


def files(
    all_rows: Sequence[Row], bounds: Mapping[str, Bounds] = MappingProxyType({})
) -> dict[str, str]:
    """Return the texts of the board's files by their paths beside the board, the board first.

    ``bounds`` are the oracle's, by track.
    """
    all_rows = [_escaped(row) for row in all_rows]
    tracks = standings.tracks(all_rows)
    grouped = standings.by_env(tracks)
    pages = {env: f"{PAGES}/{short_env(env)}.md" for env in grouped}
    texts = {BOARD.name: board_text(all_rows, pages, bounds)}
    for env, held in grouped.items():
        figures = {track: f"figures/{track}.svg" for track in held}
        texts[pages[env]] = page_text(short_env(env), held, figures)
        for track, path in figures.items():
            texts[f"{PAGES}/{path}"] = plots.track_figure(held[track])
    if tracks:
        texts[f"{PAGES}/gap.md"] = gap.page_text(tracks, bounds)
        texts[f"{PAGES}/times.md"] = times_text(all_rows)
    return texts


def _escaped(value: Any) -> Any:
    """Return nested values with every text as plain text of Markdown, without HTML."""
    if isinstance(value, str):
        return MARKUP.sub(r"\\\1", html.escape(value, quote=False))
    if isinstance(value, dict):
        return {key: _escaped(entry) for key, entry in value.items()}
    return [_escaped(entry) for entry in value] if isinstance(value, list) else value


def write(folder: Path = rows.RESULTS, board: Path = BOARD) -> list[Path]:
    """Write the board, its pages, figures and times in place of earlier ones; return paths.

    The board of the checkout also writes its excerpt in README.
    """
    loaded, bounds = load(folder), bounding.read(folder)
    texts = files(loaded, bounds)
    first = texts.pop(BOARD.name)
    pages = {name.removeprefix(f"{PAGES}/"): text for name, text in texts.items()}
    written = write_folder(board.parent / PAGES, pages)
    write_text(board, first)
    if board != BOARD:
        return [board, *written]
    write_text(README, with_excerpt(README.read_text(encoding="utf-8"), loaded, bounds))
    return [board, README, *written]


def with_excerpt(text: str, all_rows: Sequence[Row], bounds: Mapping[str, Bounds]) -> str:
    """Return the text of README with the table of the rows between its marks."""
    return EXCERPT.sub(lambda m: f"{m[1]}{excerpt(all_rows, bounds)}{m[2]}", text)


def times_text(all_rows: Sequence[Row]) -> str:
    """Return the page of computation times, which are not verified."""
    lines = [
        "# Computation time per step",
        "",
        "Time of one call of `predict` for one observation, Python included, as stated by the",
        "author of the row, not verified. Median and 99th percentile of the first 50 actions",
        "in an episode of each scenario, or of all actions where the episodes run one by one.",
        "Machines and their load differ.",
        "",
    ]
    columns: Cells = {
        "median [us]": lambda row: number(row["volatile"]["predict_us"]["median"]),
        "p99 [us]": lambda row: number(row["volatile"]["predict_us"]["p99"]),
        "machine": lambda row: row["volatile"]["machine"],
        "date": lambda row: row["volatile"]["date"],
    }
    for name, ordered in standings.tracks(all_rows).items():
        lines += [f"## {name}", "", *table(*by_controller(ordered, columns)), ""]
    return "\n".join(lines).rstrip() + "\n"
