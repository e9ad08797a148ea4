"""Parallel computation of missing cells and writing of rows; cells on disk are the checkpoint."""

import importlib
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from benchmarks.identity import audit, tasks
from benchmarks.identity.audit import Audit
from benchmarks.runs import cells as cells_module
from benchmarks.runs import knowledge, rows
from benchmarks.runs.cells import Cell, cells_of
from benchmarks.runs.controllers import Entrant
from benchmarks.runs.store import Store
from benchmarks.scenarios.scenario import ScenarioSet
from sweeps import engine

CELLS = Path(__file__).parents[1] / ".cells"

Advance = Callable[[], None]
Pair = tuple[Entrant, ScenarioSet]


@dataclass(frozen=True)
class Plan:
    """Row to write."""

    entrant: Entrant
    track: ScenarioSet
    found: Audit | None  # audit if the controller is in the last round
    cells: dict[str, Cell]  # by key


def plans(pairs: Iterable[Pair]) -> list[Plan]:
    """Return the plans of rows."""
    made = []
    for entrant, track in pairs:
        found = audit.find(entrant, track)
        cells = {cell.key: cell for cell in cells_of(entrant, track, found)}
        made.append(Plan(entrant, track, found, cells))
    return made


@dataclass
class Report:
    """Report of a run."""

    computed: int = 0  # cells computed now
    found: int = 0  # cells already stored
    # names of corrupt cells that were computed again
    quarantined: list[str] = field(default_factory=list)
    rows: list[Path] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)  # cells and rows that could not be computed


@dataclass(frozen=True)
class Computing:
    """Processes that compute."""

    jobs: int = os.cpu_count() or 1
    """Number of processes; 1 computes in the calling process."""
    backend: Literal["loky", "dask"] = "loky"
    """Processes on this machine (loky), or a running Dask cluster."""
    address: str = ""
    """Address of the Dask scheduler, for example tcp://host:8786."""

    @property
    def cluster(self) -> engine.Cluster:
        """Processes of this machine, or a cluster."""
        return engine.Cluster(self.jobs, self.backend, self.address)


@dataclass(frozen=True)
class Options(Computing):
    """Options of a run."""

    force: bool = False
    """Compute stored cells again."""
    out: Path = rows.RESULTS
    """Folder of the rows."""
    cells: Path = CELLS
    """Folder of the cells, the checkpoint."""


def run(
    pairs: Sequence[Pair],
    options: Options,
    start: Callable[[int], Advance] = lambda total: lambda: None,
) -> Report:
    """Compute the missing cells of rows; write each row as soon as its last cell is done."""
    store, cluster = Store(options.cells), options.cluster
    report, before = Report(), set(store.quarantined())
    chosen = plans(pairs)
    requested = {key: cell for plan in chosen for key, cell in plan.cells.items()}
    if options.force:
        for key in requested:
            store.path(key).unlink(missing_ok=True)
    missing = {key: cell for key, cell in requested.items() if store.load(key) is None}
    report.found = len(requested) - len(missing)
    errors, failed = dict[str, str](), dict[int, str]()
    written = dict[int, Path]()

    def finish(place: int) -> None:
        """Write a row if all its cells are stored."""
        plan = chosen[place]
        loaded = {key: store.load(key) for key in plan.cells}
        for key in (key for key, record in loaded.items() if record is None):
            errors.setdefault(key, "its file has been removed meanwhile; run it again")
        records = [record for record in loaded.values() if record is not None]
        if len(records) < len(loaded):
            return
        try:
            row = rows.assemble(plan.entrant, plan.track, records, plan.found)
            written[place] = rows.save(row, options.out)
        except ValueError as error:
            failed[place] = f"{rows.row_name(plan.track.name, plan.entrant.name)}: {error}"

    lacking = [missing.keys() & plan.cells.keys() for plan in chosen]
    advance = start(len(missing))
    for place, keys in enumerate(lacking):
        if not keys:
            finish(place)
    for key, error in _compute(missing.values(), store, cluster):
        if error is not None:
            errors[key] = error
        advance()
        for place, keys in enumerate(lacking):
            if key in keys:
                keys.remove(key)
                if not keys:
                    finish(place)
    report.rows = [written[place] for place in sorted(written)]
    report.computed = sum(key not in errors for key in missing)
    report.missing = [failed[place] for place in sorted(failed)]
    report.missing += [f"{title(requested[key])}: {text}" for key, text in errors.items()]
    report.quarantined = sorted(set(store.quarantined()) - before)
    return report


def planned(pairs: Sequence[Pair], options: Options) -> Iterator[tuple[Cell, bool]]:
    """Return the cells of rows, and whether each is already stored; nothing is changed."""
    store = Store(options.cells)
    for key, cell in ((k, cell) for plan in plans(pairs) for k, cell in plan.cells.items()):
        yield cell, not options.force and store.sound(key)


def title(cell: Cell) -> str:
    """Return a cell in words."""
    policy = "" if cell.training_seed is None else f" of training seed {cell.training_seed}"
    return f"{cell.entrant.name}{policy} in {cell.track.name}/{cell.scenario.name} ({cell.split})"


def _compute(
    missing: Iterable[Cell], store: Store, cluster: engine.Cluster
) -> Iterator[tuple[str, str | None]]:
    """Compute cells, store each on completion, and yield its key and, on failure, the reason."""
    groups = {group.key: group for group in cells_module.grouped(missing)}
    for done in engine.run(cells_module.compute, groups.values(), cluster):
        for cell in groups[done.key].cells:
            if done.error is None:
                store.save(cell.key, done.value[cell.key])
            yield cell.key, done.error


def pairs_of(entrants: Iterable[Entrant], tracks: Iterable[ScenarioSet]) -> list[Pair]:
    """Return every controller with every track that it runs in."""
    chosen = list(entrants)
    return [
        (e, track) for track in tracks for e in chosen if e.runs_in(track.env) and fits(e, track)
    ]


def fits(entrant: Entrant, track: ScenarioSet) -> bool:
    """Return whether a track has the plants, signals and actions of a policy's training.

    Signals and actions depend on the arguments of the environment, like the valves of the elbow
    orthosis. A policy of plants that its environment no longer has fits no track. A controller that
    is designed from the plant of each episode fits tracks that draw it.
    """
    if knowledge.is_informed(entrant):
        return any(scenario.kwargs.get("randomize") for scenario in track.scenarios())
    if entrant.trained_with is None:
        return True
    outdated = getattr(importlib.import_module(entrant.source), "outdated", None)
    if outdated is not None and outdated(entrant.name):
        return False
    bases = [setting.env.unwrapped for setting in tasks.of(track).settings]
    return all(
        entrant.trained_with == (tuple(base.signals.names()), tuple(base.action_signals.names()))
        for base in bases
    )
