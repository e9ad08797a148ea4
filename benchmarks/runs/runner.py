"""Run the missing cells in parallel, then write the rows. The cells on disk are the checkpoint."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.identity import audit, tasks
from benchmarks.identity.audit import Audit
from benchmarks.runs import cells as cells_module
from benchmarks.runs import rows
from benchmarks.runs.cells import Cell, cells_of
from benchmarks.runs.controllers import Entrant
from benchmarks.runs.store import Store, sweep
from benchmarks.scenarios.scenario import ScenarioSet
from sweeps import engine

CELLS = Path(__file__).parents[1] / ".cells"

Advance = Callable[[], None]
Pair = tuple[Entrant, ScenarioSet]


@dataclass(frozen=True)
class Plan:
    """Plan of a row.

    Attributes
    ----------
    entrant : Entrant
    track : ScenarioSet
    found : Audit, optional
        If the present controller is in the last round of the track.
    """

    entrant: Entrant
    track: ScenarioSet
    found: Audit | None

    @property
    def cells(self) -> list[Cell]:
        """All cells of the row."""
        return cells_of(self.entrant, self.track, self.found)


def plans(pairs: Iterable[Pair]) -> list[Plan]:
    """Return the plans of rows."""
    return [Plan(*pair, audit.find(*pair)) for pair in pairs]


@dataclass
class Report:
    """Report of a run.

    Attributes
    ----------
    computed, found : int
        Cells that were computed now, and that were there already.
    swept : int
        Half-written files of killed processes that were removed.
    quarantined : list of str
        Corrupt cells that were set aside and computed again.
    rows : list of Path
        Rows that were written.
    missing : list of str
        Cells that could not be computed, and rows that could not be made, with the reason.
    """

    computed: int = 0
    found: int = 0
    swept: int = 0
    quarantined: list[str] = field(default_factory=list)
    rows: list[Path] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Options:
    """Options of a run.

    Attributes
    ----------
    jobs : int
        Processes; 1 computes in this one.
    force : bool
        Compute cells that are there already.
    out, cells : Path
        Folders of rows and of cells.
    backend : {"loky", "dask"}
        Processes of this machine, or an existing Dask cluster at ``address``.
    address : str
        Of the Dask scheduler.
    """

    jobs: int = 2
    force: bool = False
    out: Path = rows.RESULTS
    cells: Path = CELLS
    backend: str = "loky"
    address: str = ""

    @property
    def cluster(self) -> engine.Cluster:
        """Processes of this machine, or a cluster."""
        return engine.Cluster(self.jobs, self.backend, self.address)


def run(
    pairs: Sequence[Pair],
    options: Options,
    start: Callable[[int], Advance] = lambda total: lambda: None,
) -> Report:
    """Compute the missing cells of rows and write each complete row.

    Parameters
    ----------
    pairs : sequence of (Entrant, ScenarioSet)
        One row each.
    options : Options
    start : callable
        Called with the number of cells to compute; returns the callback after each of them.
    """
    cluster, store = options.cluster, Store(options.cells)
    report = Report(swept=store.sweep() + sweep(options.out))
    before = set(store.quarantined())
    chosen = [(plan, {cell.key: cell for cell in plan.cells}) for plan in plans(pairs)]
    requested = {key: cell for _, cells in chosen for key, cell in cells.items()}
    if options.force:
        for key in requested:
            store.path(key).unlink(missing_ok=True)
    missing = {key: cell for key, cell in requested.items() if store.load(key) is None}
    report.found = len(requested) - len(missing)
    making = _Rows(chosen, missing.keys(), store, options.out)
    errors, advance = dict[str, str](), start(len(missing))
    for key, error in _compute(missing.values(), store, cluster):
        if error is not None:
            errors[key] = error
        advance()
        making.done(key)
    for _, outcome in sorted(making.outcomes.items()):
        report.rows += outcome.rows
        report.missing += outcome.wrong
        errors = outcome.gone | errors
    report.computed = sum(key not in errors for key in missing)
    report.missing += [f"{title(requested[key])}: {text}" for key, text in errors.items()]
    report.quarantined = sorted(set(store.quarantined()) - before)
    return report


def planned(pairs: Sequence[Pair], options: Options) -> Iterator[tuple[Cell, bool]]:
    """Return the cells of rows, and whether each is there already; nothing is changed."""
    store = Store(options.cells)
    for cell in (cell for plan in plans(pairs) for cell in plan.cells):
        yield cell, not options.force and store.sound(cell.key)


@dataclass(frozen=True)
class _Outcome:
    """Outcome of a row: its file, or an error, or the cells that are gone."""

    rows: tuple[Path, ...] = ()
    wrong: tuple[str, ...] = ()
    gone: dict[str, str] = field(default_factory=dict)


class _Rows:
    """Rows in the making: each is written as soon as its last cell is done.

    Parameters
    ----------
    chosen : sequence of (Plan, mapping)
        Each row with its cells by key.
    missing : set of str
        Keys of the cells that are not there yet.
    store : Store
    out : Path
    """

    def __init__(
        self,
        chosen: Sequence[tuple[Plan, Mapping[str, Cell]]],
        missing: Set[str],
        store: Store,
        out: Path,
    ) -> None:
        self.chosen, self.store, self.out = chosen, store, out
        self.lacking = [missing & cells.keys() for _, cells in chosen]
        whole = (place for place, keys in enumerate(self.lacking) if not keys)
        self.outcomes = {place: self._finish(place) for place in whole}

    def done(self, key: str) -> None:
        """Take note of a cell that was computed, or could not be."""
        for place, keys in enumerate(self.lacking):
            if key in keys:
                keys.remove(key)
                if not keys:
                    self.outcomes[place] = self._finish(place)

    def _finish(self, place: int) -> _Outcome:
        """Write a row if its cells are all there."""
        plan, cells = self.chosen[place]
        loaded = {key: self.store.load(key) for key in cells}
        gone = [key for key, record in loaded.items() if record is None]
        if gone:
            why = "its file has been removed meanwhile; run it again"
            return _Outcome(gone=dict.fromkeys(gone, why))
        records = [record for record in loaded.values() if record is not None]
        try:
            row = rows.assemble(plan.entrant, plan.track, records, plan.found)
            return _Outcome(rows=(rows.save(row, self.out),))
        except ValueError as error:
            name = rows.row_name(plan.track.name, plan.entrant.name)
            return _Outcome(wrong=(f"{name}: {error}",))


def title(cell: Cell) -> str:
    """Return a cell in words."""
    policy = "" if cell.training_seed is None else f" of training seed {cell.training_seed}"
    return f"{cell.entrant.name}{policy} in {cell.track.name}/{cell.scenario.name} ({cell.split})"


def _compute(
    missing: Iterable[Cell], store: Store, cluster: engine.Cluster
) -> Iterator[tuple[str, str | None]]:
    """Compute cells, keep each as it comes, and yield its key and why it could not be computed."""
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
    """Return whether a track has the signals and actions that a policy was trained with.

    Those of an environment depend on its arguments, like the valves of the elbow orthosis.
    """
    if entrant.trained_with is None:
        return True
    bases = [setting.env.unwrapped for setting in tasks.of(track).settings]
    return all(
        entrant.trained_with == (tuple(base.signals.names()), tuple(base.action_signals.names()))
        for base in bases
    )
