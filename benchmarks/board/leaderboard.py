"""The board's files: a pure function of the rows, with equal bytes for equal rows."""

from collections.abc import Sequence
from pathlib import Path

from benchmarks.board import accessors as views
from benchmarks.board import plots, standings
from benchmarks.board.environment_page import page_text
from benchmarks.board.format import number, table
from benchmarks.board.summary import board_text
from benchmarks.board.words import Cells, by_controller, short_env
from benchmarks.identity import audit
from benchmarks.runs import rows, verified
from benchmarks.runs.rows import Row
from benchmarks.runs.store import write_all

BOARD = Path(__file__).parents[1] / "LEADERBOARD.md"
PAGES = "leaderboard"  # folder of the pages beside the board, with the figures and the times


def load(folder: Path) -> list[Row]:
    """Return the rows of a folder with their verifications and their place in the last round."""
    if not folder.is_dir():
        raise ValueError(f"{folder}: no such folder of rows; run `python -m benchmarks run` first")
    found = verified.read(folder)
    loaded = []
    for row in rows.load_all(folder):  # without an audit if it is not of the last round
        last = audit.last(views.track_of(row)) if audit.in_last_round(row) else None
        held = {**row["audit"], "entrants": last.entrants} if last else None
        loaded.append({**row, "audit": held, views.VERIFIED: verified.of(row, found)})
    return loaded


def files(all_rows: Sequence[Row]) -> dict[str, str]:
    """Return the texts of the board's files by their paths beside the board, the board first."""
    tracks = standings.tracks(all_rows)
    grouped = standings.by_env(tracks)
    pages = {env: f"{PAGES}/{short_env(env)}.md" for env in grouped}
    texts = {BOARD.name: board_text(all_rows, pages)}
    for env, held in grouped.items():
        figures = {track: f"figures/{track}.svg" for track in held}
        texts[pages[env]] = page_text(short_env(env), held, figures)
        for track, path in figures.items():
            texts[f"{PAGES}/{path}"] = plots.track_figure(held[track])
    if tracks:
        texts[f"{PAGES}/times.md"] = times_text(all_rows)
    return texts


def write(folder: Path = rows.RESULTS, board: Path = BOARD) -> list[Path]:
    """Write the board, its pages, figures and times in place of earlier ones; return paths."""
    texts = files(load(folder))
    named = {board.name if name == BOARD.name else name: text for name, text in texts.items()}
    return write_all(board.parent, named, (f"{PAGES}/*.md", f"{PAGES}/figures/*.svg"))


def times_text(all_rows: Sequence[Row]) -> str:
    """Return the page of computation times, which are not verified."""
    lines = [
        "# Computation time per step",
        "",
        "Time of one call of `predict` for one observation, Python included, as stated by the",
        "author of the row, not verified. Median and 99th percentile of the first 100 actions",
        "in two episodes, each as the median over the scenarios. Machines and their load differ.",
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
