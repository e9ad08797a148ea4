"""Static site: one folder for any browser, without server and network."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.board import leaderboard, plots, site_data, standings
from benchmarks.identity.hashing import plain
from benchmarks.runs import rows
from benchmarks.runs.rows import Row
from benchmarks.runs.store import read_json, write_all

ASSETS = Path(__file__).parent / "site_assets"
OUT = Path(__file__).parents[1] / "site"
_OWNED = ("data/*.js", "data/traces/*.js", "figures/*.svg", "rows/*.json")


def build(results: Path = rows.RESULTS, out: Path = OUT) -> list[Path]:
    """Write the site from the rows of a folder, in place of an earlier build; return its files.

    ``index.html`` comes first; equal rows give equal bytes.
    """
    all_rows = leaderboard.load(results)
    texts = page(all_rows)
    for row in all_rows:
        stored = read_json(rows.path_of(str(row["row"]), results))
        texts[f"rows/{row['row']}.json"] = _json(stored) + "\n"
    return write_all(out, texts, _OWNED)


def page(all_rows: Sequence[Row]) -> dict[str, str]:
    """Return the site's files by their names, ``index.html`` first."""
    names = ("index.html", "page.css", "draw.js", "detail.js", "page.js")
    texts = {name: (ASSETS / name).read_text() for name in names}
    texts["data/board.js"] = f"const BOARD = {_json(site_data.board(all_rows))};\n"
    for name, ordered in standings.tracks(all_rows).items():
        texts[f"figures/{name}.svg"] = plots.track_figure(ordered)
    for row in sorted(all_rows, key=lambda row: str(row["row"])):
        if row.get("traces"):
            call = f"loadTraces({_json(row['row'])}, {_json(row['traces'])});\n"
            texts[f"data/traces/{row['row']}.js"] = call
    return texts


def _json(value: Any) -> str:
    """Return JSON that is valid in a script: ordered keys, ASCII letters."""
    return json.dumps(plain(value), separators=(",", ":"), allow_nan=False)
