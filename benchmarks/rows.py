"""A row of the board: one controller over one scenario file, with all that runs it again."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import artefacts, audit, knowledge, provenance, scenarios, statistics, tasks
from benchmarks.canonical import digest
from benchmarks.cells import AUDIT, PUBLIC, Cell, cells_of, sources
from benchmarks.controllers import Entrant, find
from benchmarks.metrics import METRICS, headline_of, of_track
from benchmarks.scenarios import ScenarioSet
from benchmarks.store import read_record, write_record

SCHEMA = 2
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


Record = Mapping[str, Any]


def pair_of(name: str) -> tuple[Entrant, ScenarioSet]:
    """Return controller and scenarios of a row's name.

    Raises
    ------
    ValueError
        If there is no such track or controller, or they do not go together.
    """
    track, _, controller = name.partition("--")
    known = scenarios.available()
    if track not in known:
        raise ValueError(
            f"{name}: no track {track!r}; a row is TRACK--CONTROLLER with a track of "
            f"{', '.join(known)}"
        )
    entrant = find(controller)
    if not entrant.runs_in(known[track].env):
        raise ValueError(f"{name}: {controller} is not for {known[track].env}")
    return entrant, known[track]


def assemble(entrant: Entrant, track: ScenarioSet, cells: Sequence[Record]) -> Row:
    """Return the row of a controller from its cells, in the order of :func:`cells.cells_of`.

    Parameters
    ----------
    entrant : Entrant
    track : ScenarioSet
    cells : sequence of mapping
        The record of every cell; none may be missing, none of another environment version.
    """
    _check_complete(entrant, track, cells)
    public = [cell for cell in cells if cell["split"] == PUBLIC]
    plants = {cell["scenario"]: cell["plant_digest"] for cell in public}
    about = _controller(entrant, public)
    episodes = [episode for cell in cells for episode in cell["episodes"]]
    scored = [episode for episode in episodes if episode["split"] == PUBLIC]
    row: Row = {
        "schema": SCHEMA,
        "row": row_name(track.name, entrant.name),
        "env": tasks.describe_env(track.env),
        "task": tasks.task_digest(track, plants),
        "controller": about,
        "scenarios": {
            "name": track.name,
            "version": track.content["version"],
            "digest": track.digest,
            "content": track.content,
        },
        "plants": plants,
        "models": {cell["scenario"]: cell["model_digest"] for cell in public},
        "seeds": list(track.seeds),
        "training_seeds": [seed for seed, _ in entrant.files],
        "made_with": {
            "packages": provenance.packages(),
            "sources": sources(entrant),
            "commit": provenance.commit(),
            "cpu": provenance.cpu(),
        },
        "episodes": episodes,
        "failures": failures(scored),
        "aggregate": aggregate(scored, of_track(track.content)),
        "by": breakdown(track, scored),
        "audit": None,
        "traces": [trace for cell in public for trace in cell.get("traces", ())],
        "volatile": {
            **provenance.occasion(),
            "predict_us": _median_times([cell["volatile"]["predict_us"] for cell in cells]),
        },
    }
    if len(scored) < len(episodes):
        row["audit"] = _audited(row, track)
    if entrant.files:
        row["actions"] = {c["scenario"]: c["actions"] for c in public if "actions" in c}
    return row


def _check_complete(entrant: Entrant, track: ScenarioSet, cells: Sequence[Record]) -> None:
    """Raise unless the records are those of the row's cells."""

    def place(cell: Cell) -> tuple[Any, ...]:
        return cell.split, cell.training_seed, cell.scenario.name

    wanted = [place(cell) for cell in cells_of(entrant, track)]
    if [(c["split"], c["training_seed"], c["scenario"]) for c in cells] != wanted:
        raise ValueError(f"{entrant.name}: the cells are not those of {track.name}")
    others = sorted({str(cell["env"]) for cell in cells} - {track.env})
    if others:
        raise ValueError(
            f"{entrant.name}: cells of {', '.join(others)} among those of {track.env}; results of "
            "different versions are not mixed: run it again with --force"
        )


def _controller(entrant: Entrant, cells: Sequence[Record]) -> dict[str, Any]:
    parameters = {_place(cell): cell["controller_digest"] for cell in cells}
    code = [cell["code_digest"] for cell in cells]
    trained = entrant.kind != "classical"
    return {
        "name": entrant.name,
        "kind": entrant.kind,
        "source": entrant.source,
        "summary": entrant.summary,
        "knowledge": knowledge.label(entrant.knowledge, cells),
        "claimed": entrant.knowledge,
        "citation": entrant.citation,
        "digest": digest(parameters)[:16],
        "parameters": parameters,
        "preview_seconds": max(cell.get("preview_used", 0.0) for cell in cells),
        "tuning": None if trained else {"trials": entrant.trials, "how": entrant.tuning},
        "artefact": artefacts.combine(entrant, parameters.values(), code).record(),
        "training": artefacts.training_of(entrant),
    }


def _place(cell: Record) -> str:
    seed = cell["training_seed"]
    return str(cell["scenario"]) + ("" if seed is None else f"#s{seed}")


def _audited(row: Row, track: ScenarioSet) -> dict[str, Any]:
    """Return salt, seeds and scores of the audit of a row that has such episodes."""
    artefact = row["controller"]["artefact"]["digest"]
    found = audit.of(audit.entries(), row["task"], artefact, track)
    if found is None:
        raise ValueError(f"{row['row']}: audit episodes, and no salt for this task and artefact")
    episodes = episodes_of(row, AUDIT)
    scores = aggregate(episodes, of_track(track.content))
    return {
        "salt": found.salt,
        "drawn": found.drawn,
        "draw": found.draw,
        "seeds": {name: list(seeds) for name, seeds in found.seeds.items()},
        "failures": failures(episodes),
        "aggregate": scores,
        "gap": gap(scores, row["aggregate"]),
    }


def gap(audited: Record, public: Record) -> dict[str, float]:
    """Return by how much the mean of each metric is higher in the audit."""
    return {name: audited[name]["mean"] - public[name]["mean"] for name in audited}


def failures(episodes: Sequence[Record]) -> int:
    """Return how many episodes a limit or an error ended."""
    return sum(bool(episode["failed"]) for episode in episodes)


def episodes_of(row: Record, split: str = PUBLIC) -> list[Record]:
    """Return the public or the audit episodes of a row."""
    return [episode for episode in row["episodes"] if episode["split"] == split]


def published(row: Record) -> tuple[Mapping[str, Any], str]:
    """Return the scores that the board prints, and of which episodes: the audit's if any."""
    found = row["audit"]
    return (row["aggregate"], PUBLIC) if found is None else (found["aggregate"], AUDIT)


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
    runs = [episode["training_seed"] for episode in episodes]
    pairs = [(episode["scenario"], episode["seed"]) for episode in episodes]
    crossed: dict[str, Any] = {"runs": runs, "pairs": pairs} if len(set(runs)) > 1 else {}
    table: dict[str, Any] = {}
    for metric in metrics:
        values = scores_of(episodes, metric)
        middle = statistics.bootstrap(values, strata, **crossed)
        inner = statistics.bootstrap(values, strata, statistics.interquartile_mean, **crossed)
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
    check_schema(row, path)
    return row


def check_schema(row: Record, path: Path) -> None:
    """Raise unless a record is a row as this version writes it."""
    found = row.get("schema")
    if found != SCHEMA or "aggregate" not in row:
        raise ValueError(
            f"{path}: not a row of schema {SCHEMA}, but of {found!r}; run it again: "
            f"{command(path.stem)}"
        )


def command(name: str) -> str:
    """Return the command that runs a row again."""
    track, _, controller = name.partition("--")
    return f"python -m benchmarks run --track {track} --controller {controller}"


def load_all(folder: Path = RESULTS) -> list[Row]:
    """Return all rows of a folder by name.

    Raises
    ------
    ValueError
        If one is damaged, of an environment version that is not here, or of another task than
        the other rows of its track: a board leaves nothing out silently and mixes nothing.
    """
    found = [load(path) for path in sorted(folder.glob("*--*.json"))]
    for row in found:
        tasks.check_version(row["env"]["id"], row["row"])
    check_together(found)
    return found


def check_together(found: Sequence[Record]) -> None:
    """Raise unless the rows of each track are of one environment version and one task.

    Raises
    ------
    ValueError
        Naming the versions and a row of each.
    """
    first: dict[str, Record] = {}
    for row in found:
        other = first.setdefault(row["scenarios"]["name"], row)
        for what, ours, theirs in (
            ("environment", row["env"]["id"], other["env"]["id"]),
            ("task", row["task"][:12], other["task"][:12]),
        ):
            if ours != theirs:
                raise ValueError(
                    f"{row['row']} is of {what} {ours} and {other['row']} of {theirs}: their "
                    f"results are not compared; run the older one again: {command(row['row'])}"
                )
