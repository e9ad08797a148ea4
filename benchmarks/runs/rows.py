"""Rows of the board: one controller over one scenario file, with all data to reproduce it."""

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import fastjsonschema
import numpy as np

from benchmarks.identity import artefacts, tasks, trainings
from benchmarks.identity.audit import Audit
from benchmarks.runs import knowledge, provenance
from benchmarks.runs.cells import PUBLIC, cells_of
from benchmarks.runs.controllers import Entrant
from benchmarks.runs.store import read_record, write_record
from benchmarks.scenarios import scenario as scenarios
from benchmarks.scenarios.scenario import ScenarioSet
from pam_envs.wording import printable, shown

SCHEMA = 4
RESULTS = Path(__file__).parents[1] / "results"
_VALID = fastjsonschema.compile(
    json.loads(Path(__file__).with_name("row.schema.json").read_text("utf-8"))
)
MOST_CONTENT = 100_000  # characters of a scenario file in a row
_NAME = re.compile(r"[A-Za-z0-9_]+")

Row = dict[str, Any]
Record = Mapping[str, Any]
SUFFIX = ".json.xz"  # of a row's file


def row_name(track: str, controller: str) -> str:
    """Return the name of a row."""
    return f"{track}--{controller}"


def path_of(name: str, folder: Path = RESULTS) -> Path:
    """Return the file of a row in a folder of rows: one folder a track, one file a controller."""
    track, _, controller = name.partition("--")
    return folder / track / f"{controller}{SUFFIX}"


def is_name(text: str) -> bool:
    """Return whether a text is of the form of a row's name."""
    parts = text.split("--")
    return len(parts) == 2 and all(map(_NAME.fullmatch, parts))


def name_of(path: Path) -> str:
    """Return the name of the row in a file."""
    return row_name(path.parent.name, path.name.removesuffix(SUFFIX))


def files(folder: Path = RESULTS) -> list[Path]:
    """Return the files of all rows of a folder, sorted."""
    return sorted(folder.glob(f"*/*{SUFFIX}"))


def assemble(
    entrant: Entrant, track: ScenarioSet, cells: Sequence[Record], found: Audit | None = None
) -> Row:
    """Return the row of a controller from the records of :func:`cells.cells_of` in its order."""
    task = tasks.of(track)
    identity = task.identity
    _check_cells(entrant, track, cells, found)
    trainings.check_cells(entrant, cells)
    public = [cell for cell in cells if cell["split"] == PUBLIC]
    return {
        "schema": SCHEMA,
        "row": row_name(track.name, entrant.name),
        "env": task.env,
        "task": identity.digest,
        "controller": _controller(entrant, track, public, found),
        "scenarios": {
            "name": track.name,
            "version": track.content["version"],
            "digest": track.digest,
            "content": track.content,
        },
        "plants": identity.plants,
        "models": identity.models,
        "seeds": {name: list(seeds) for name, seeds in track.seeds.items()},
        "training_seeds": [seed for seed, _ in entrant.files],
        "made_with": {
            "packages": provenance.packages(),
            "commit": provenance.commit(),
            "cpu": provenance.cpu(),
        },
        "episodes": [episode for cell in cells for episode in cell["episodes"]],
        "audit": None if found is None else found.record(),
        "traces": [trace for cell in public for trace in cell.get("traces", ())],
        "volatile": {
            **provenance.occasion(),
            "predict_us": {
                name: _median([cell["volatile"]["predict_us"][name] for cell in cells])
                for name in ("median", "p99")
            },
        },
    }


def _check_cells(
    entrant: Entrant, track: ScenarioSet, cells: Sequence[Record], found: Audit | None
) -> None:
    """Raise unless the records are those of the row's cells, of the present plants and models."""
    needed = [(c.split, c.training_seed, c.scenario.name) for c in cells_of(entrant, track, found)]
    if [(c["split"], c["training_seed"], c["scenario"]) for c in cells] != needed:
        raise ValueError(f"{entrant.name}: the cells are not those of {track.name}")
    identity = tasks.of(track).identity
    for cell in cells:
        name = cell["scenario"]
        present = (track.env, identity.plants[name], identity.models[name])
        if (cell["env"], cell["plant_digest"], cell["model_digest"]) != present:
            raise ValueError(
                f"{entrant.name}: a cell of {name} is of another environment, plant or model; run "
                "it again with --force"
            )


def _controller(
    entrant: Entrant, track: ScenarioSet, cells: Sequence[Record], found: Audit | None
) -> dict[str, Any]:
    """Return the controller's entry of a row from the records of its public cells."""
    made = artefacts.of(entrant, track)
    return {
        "name": entrant.name,
        "kind": entrant.kind,
        "summary": entrant.summary,
        "knowledge": knowledge.label(entrant.knowledge, cells),
        "claimed": entrant.knowledge,
        "author": entrant.author,
        "citation": entrant.citation,
        "preview_seconds": max(cell.get("preview_used", 0.0) for cell in cells),
        "tuning": {"trials": entrant.trials, "how": entrant.tuning},
        "artefact": {
            "digest": made.record()["digest"] if found is None else found.artefact,
            "files": [dict(file) for file in made.files],
            "knobs": dict(made.knobs),
        },
        "training": trainings.of(entrant),
    }


def episodes_of(row: Record, split: str = PUBLIC) -> list[Record]:
    """Return the public or the audit episodes of a row."""
    return [episode for episode in row["episodes"] if episode["split"] == split]


def _median(times: Sequence[float | None]) -> float | None:
    known = [time for time in times if time is not None]
    return float(np.median(known)) if known else None


def scores_of(episodes: Sequence[Mapping[str, Any]], metric: str) -> np.ndarray[Any, Any]:
    """Return one metric of all episodes; NaN if it does not apply."""
    values = [episode["scores"][metric] for episode in episodes]
    return np.array([np.nan if value is None else value for value in values], float)


def save(row: Row, folder: Path = RESULTS) -> Path:
    """Write a row under its name and return the path."""
    path = path_of(str(row["row"]), folder)
    write_record(path, row)
    return path


def load(path: Path) -> Row:
    """Return a row; raise ValueError if it is damaged, of another schema, or wrongly named."""
    row = read_record(path)
    check_schema(row, path)
    return row


def check_schema(row: Any, path: Path) -> None:
    """Raise ValueError unless a record has exactly the entries of a row, and the file's name."""
    again = f"run it again: {command(name_of(path))}"
    version = row.get("schema") if isinstance(row, Mapping) else None
    if version != SCHEMA:
        raise ValueError(f"{path}: not a row of schema {SCHEMA}, but of {shown(version)}; {again}")
    try:
        _VALID(row)
        _check_content(row)
    except fastjsonschema.JsonSchemaValueException as error:
        place = str(error.name).removeprefix("data").lstrip(".") or "it"
        why = printable(error.message.replace(error.name, place, 1)[:300])
        raise ValueError(f"{path}: not a row: {why}; {again}") from error
    except (ValueError, TypeError, LookupError, AttributeError, ArithmeticError) as error:
        raise ValueError(f"{path}: not a row: {printable(str(error)[:300])}; {again}") from error
    track, controller = str(row["scenarios"]["name"]), str(row["controller"]["name"])
    if {row["row"], name_of(path)} != {row_name(track, controller)}:
        raise ValueError(
            f"{path}: holds {row['row']!r}, of {controller!r} in {track!r}; file, row, track and "
            f"controller have to agree: {again}"
        )
    if track not in scenarios.names():
        raise ValueError(
            f"{path}: this checkout has no track {track!r}; check out the row's commit"
        )


def _check_content(row: Record) -> None:
    """Raise ValueError unless scenarios, scores and seeds of a row belong together."""
    content, name = row["scenarios"]["content"], row["scenarios"]["name"]
    if len(json.dumps(content)) > MOST_CONTENT:
        raise ValueError(f"scenarios.content has more than {MOST_CONTENT:,} characters")
    track = ScenarioSet(content)
    given = (track.name, content["version"], track.env, track.digest)
    said = (name, row["scenarios"]["version"], row["env"]["id"], row["scenarios"]["digest"])
    if given != said:
        raise ValueError("scenarios.content is not that of its name, version, digest and env")
    names = {scenario.name for scenario in track.scenarios()}
    for key in ("plants", "models", "seeds"):
        if row[key].keys() != names:
            raise ValueError(f"{key} has other names than the scenarios")
    metrics, seeds = content["worst_case"].keys(), row["training_seeds"] or [None]
    for k, episode in enumerate(row["episodes"]):
        if episode["scenario"] not in names or episode["training_seed"] not in seeds:
            raise ValueError(f"episodes[{k}] is of another scenario or training seed")
        if episode["scores"].keys() != metrics:
            raise ValueError(f"episodes[{k}].scores has other metrics than {name}")


def command(name: str) -> str:
    """Return the command that runs a row again."""
    track, _, controller = name.partition("--")
    return f"python -m benchmarks run --track {track} --controller {controller}"


def load_all(folder: Path = RESULTS) -> list[Row]:
    """Return all rows of a folder by name.

    A ValueError says that one is damaged, of an environment version that is not here, or of another
    task than the other rows of its track.
    """
    found = [load(path) for path in files(folder)]
    for row in found:
        tasks.check_version(row["env"]["id"], row["row"])
    check_together(found)
    return found


def check_together(found: Sequence[Record]) -> None:
    """Raise unless the rows of each track are of one environment and one task, and none twice."""
    first: dict[str, Record] = {}
    names: set[str] = set()
    for row in found:
        if row["row"] in names:
            raise ValueError(f"{row['row']} is there twice; take one of them out")
        names.add(row["row"])
        track = row["scenarios"]["name"]
        other = first.setdefault(track, row)
        for what, ours in _shared(row).items():
            theirs = _shared(other)[what]
            if ours != theirs:
                raise ValueError(
                    f"{row['row']} is of {what} {ours} and {other['row']} of {theirs}: their "
                    "results are not compared; run the older ones again: "
                    f"python -m benchmarks run --track {track}"
                )


def _shared(row: Record) -> dict[str, str]:
    """Return the properties that all rows of a track share."""
    return {"environment": str(row["env"]["id"]), "task": str(row["task"])[:12]}
