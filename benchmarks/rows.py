"""A row of the board: one controller over one scenario file, with all that runs it again."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from benchmarks import provenance, statistics
from benchmarks.canonical import digest
from benchmarks.controllers import Entrant
from benchmarks.metrics import METRICS, headline_of, of_track
from benchmarks.scenarios import ScenarioSet
from benchmarks.store import read_record, write_record

SCHEMA = 1
RESULTS = Path(__file__).parent / "results"

Row = dict[str, Any]
SHOWN: dict[str, Any] = {"unit": "mm", "factor": 1e3}
"""How errors are shown where the scenario file does not say."""


def shown(content: Mapping[str, Any]) -> tuple[str, float]:
    """Return the unit in which errors are shown, and its factor from SI."""
    how = content.get("shown") or SHOWN
    return str(how["unit"]), float(how["factor"])


def row_name(track: str, controller: str) -> str:
    """Return the name of a row and of its file."""
    return f"{track}--{controller}"


def assemble(entrant: Entrant, track: ScenarioSet, cells: Sequence[Mapping[str, Any]]) -> Row:
    """Return the row of a controller from its cells, in the order of the scenario file.

    Parameters
    ----------
    entrant : Entrant
    track : ScenarioSet
    cells : sequence of mapping
        A record of every scenario; none may be missing.
    """
    wanted = [scenario.name for scenario in track.scenarios()]
    if [cell["scenario"] for cell in cells] != wanted:
        raise ValueError(f"{entrant.name}: the cells are not the scenarios of {track.name}")
    episodes = [episode for cell in cells for episode in cell["episodes"]]
    row: Row = {
        "schema": SCHEMA,
        "row": row_name(track.name, entrant.name),
        "env": {"id": track.env, "version": env_version(track.env)},
        "controller": _controller(entrant, cells),
        "scenarios": {
            "name": track.name,
            "version": track.content["version"],
            "digest": track.digest,
            "content": track.content,
        },
        "plants": {cell["scenario"]: cell["plant_digest"] for cell in cells},
        "models": {cell["scenario"]: cell["model_digest"] for cell in cells},
        "seeds": list(track.seeds),
        "made_with": {
            "packages": provenance.packages(),
            "sources": provenance.sources(entrant.source.partition(".")[0]),
            "commit": provenance.commit(),
        },
        "episodes": episodes,
        "failures": sum(bool(episode["failed"]) for episode in episodes),
        "aggregate": aggregate(episodes, of_track(track.content)),
        "by": breakdown(track, episodes),
        "volatile": {
            **provenance.occasion(),
            "predict_us": _median_times([cell["volatile"]["predict_us"] for cell in cells]),
        },
    }
    if entrant.kind == "learned":
        row["actions"] = {cell["scenario"]: cell["actions"] for cell in cells}
    return row


def env_version(env: str) -> int:
    """Return the version at the end of an id."""
    return int(gym.envs.registration.parse_env_id(env)[2] or 0)


def _controller(entrant: Entrant, cells: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    parameters = {cell["scenario"]: cell["controller_digest"] for cell in cells}
    return {
        "name": entrant.name,
        "kind": entrant.kind,
        "source": entrant.source,
        "summary": entrant.summary,
        "knowledge": entrant.knowledge,
        "citation": entrant.citation,
        "digest": digest(parameters)[:16],
        "parameters": parameters,
        "preview_seconds": max(cell.get("preview_used", 0.0) for cell in cells),
    }


def _median_times(times: Sequence[Mapping[str, Any]]) -> dict[str, float | None]:
    known = [time["median"] for time in times if time["median"] is not None]
    high = [time["p99"] for time in times if time["p99"] is not None]
    return {
        "median": float(np.median(known)) if known else None,
        "p99": float(np.median(high)) if high else None,
    }


def scores_of(episodes: Sequence[Mapping[str, Any]], metric: str) -> np.ndarray[Any, Any]:
    """Return one metric of all episodes, NaN where it does not apply."""
    values = [episode["scores"][metric] for episode in episodes]
    return np.array([np.nan if value is None else value for value in values], float)


def aggregate(
    episodes: Sequence[Mapping[str, Any]], metrics: Iterable[str] = METRICS
) -> dict[str, Any]:
    """Return mean and interquartile mean of every metric with their intervals.

    The mean leads: an interquartile mean would drop failures.
    """
    strata = [episode["scenario"] for episode in episodes]
    table: dict[str, Any] = {}
    for metric in metrics:
        values = scores_of(episodes, metric)
        middle = statistics.bootstrap(values, strata)
        inner = statistics.bootstrap(values, strata, statistics.interquartile_mean)
        table[metric] = {
            "mean": middle.value,
            "low": middle.low,
            "high": middle.high,
            "iqm": inner.value,
            "iqm_low": inner.low,
            "iqm_high": inner.high,
            "episodes": int(np.isfinite(values).sum()),
        }
    return table


def breakdown(track: ScenarioSet, episodes: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the headline's mean for each value of each axis of the grid."""
    settings = {scenario.name: scenario.kwargs for scenario in track.scenarios()}
    values = scores_of(episodes, headline_of(track.content))
    table: dict[str, Any] = {}
    for axis, points in (track.content.get("grid") or {}).items():
        for point in points:
            chosen = [settings[episode["scenario"]][axis] == point for episode in episodes]
            table.setdefault(axis, {})[str(point)] = float(np.mean(values[chosen]))
    return table


def save(row: Row, folder: Path = RESULTS) -> Path:
    """Write a row under its name and return the path."""
    path = folder / f"{row['row']}.json"
    write_record(path, row)
    return path


def load(path: Path) -> Row:
    """Return a row of this schema whose checksum matches.

    Raises
    ------
    ValueError
        If the file is damaged, altered or of another schema.
    """
    row = read_record(path)
    if row.get("schema") != SCHEMA or "aggregate" not in row:
        raise ValueError(f"{path}: not a row of schema {SCHEMA}; run it again")
    return row


def load_all(folder: Path = RESULTS) -> list[Row]:
    """Return all rows of a folder by name.

    Raises
    ------
    ValueError
        If one is damaged: a board leaves nothing out silently.
    """
    return [load(path) for path in sorted(folder.glob("*--*.json"))]
