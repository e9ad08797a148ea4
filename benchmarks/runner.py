"""Run the missing cells in parallel, then write the rows. The cells on disk are the checkpoint."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks import cells as cells_module
from benchmarks import rows
from benchmarks.cells import Cell, cells_of
from benchmarks.controllers import Entrant
from benchmarks.scenarios import ScenarioSet
from benchmarks.store import Store, sweep

ATTEMPTS = 4
"""Rounds over the cells that are still missing, so that a killed worker costs one cell."""

CELLS = Path(__file__).parent / ".cells"

Advance = Callable[[], None]


@dataclass
class Report:
    """What a run did.

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
        Cells that could not be computed, with the reason.
    """

    computed: int = 0
    found: int = 0
    swept: int = 0
    quarantined: list[str] = field(default_factory=list)
    rows: list[Path] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Options:
    """How to run.

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


def run(
    pairs: Sequence[tuple[Entrant, ScenarioSet]],
    options: Options,
    start: Callable[[int], Advance] = lambda total: lambda: None,
) -> Report:
    """Compute what is missing of the rows and write each row that is whole.

    Parameters
    ----------
    pairs : sequence of (Entrant, ScenarioSet)
        One row each.
    options : Options
    start : callable
        Called with the number of cells to compute; returns what to call after each of them.
    """
    store = Store(options.cells)
    report = Report(swept=store.sweep() + sweep(options.out))
    before = set(store.quarantined())
    wanted = {cell.key: cell for pair in pairs for cell in cells_of(*pair)}
    if options.force:
        for key in wanted:
            store.path(key).unlink(missing_ok=True)
    missing = {key: cell for key, cell in wanted.items() if store.load(key) is None}
    report.found = len(wanted) - len(missing)
    errors = _compute_all(missing, store, options, start(len(missing)))
    for pair in pairs:
        _finish(pair, store, options, report)
    report.computed = len(missing) - sum(store.load(key) is None for key in missing)
    report.missing = [f"{_title(wanted[key])}: {text}" for key, text in errors.items()]
    report.quarantined = sorted(set(store.quarantined()) - before)
    return report


def _finish(
    pair: tuple[Entrant, ScenarioSet], store: Store, options: Options, report: Report
) -> None:
    """Write a row whose cells are all there."""
    loaded = [store.load(cell.key) for cell in cells_of(*pair)]
    records = [record for record in loaded if record is not None]
    if len(records) == len(loaded):
        report.rows.append(rows.save(rows.assemble(*pair, records), options.out))


def _title(cell: Cell) -> str:
    return f"{cell.entrant.name} in {cell.track.name}/{cell.scenario.name}"


def _compute_all(
    missing: dict[str, Cell], store: Store, options: Options, advance: Advance
) -> dict[str, str]:
    """Compute cells round by round, and return what could not be computed."""
    left, errors = dict(missing), dict[str, str]()
    for attempt in range(ATTEMPTS):
        if not left:
            break
        # with the last attempt alone in this process, a cell that kills its worker is named
        for key, error in _attempt(left, store, options):
            if error:
                errors[key] = error
            else:
                errors.pop(key, None)
                advance()
        left = {k: c for k, c in left.items() if k not in errors and store.load(k) is None}
        if left and attempt + 1 < ATTEMPTS:
            time.sleep(0.1)
    for key in left:
        errors[key] = f"its worker died {ATTEMPTS} times; run it with --jobs 1 to see why"
    return errors


def _attempt(
    left: dict[str, Cell], store: Store, options: Options
) -> Iterator[tuple[str, str | None]]:
    """Compute cells until done or a worker dies."""
    if options.jobs == 1 and options.backend == "loky":
        for cell in left.values():
            yield _compute_one(cell, store)
        return
    from joblib import Parallel, delayed
    from joblib.externals.loky.process_executor import BrokenProcessPool

    tasks = (delayed(_compute_in_worker)(cell, store, os.getpid()) for cell in left.values())
    with _backend(options):
        parallel = Parallel(
            n_jobs=options.jobs, return_as="generator_unordered", pre_dispatch="3*n_jobs"
        )
        try:
            yield from parallel(tasks)
        except BrokenProcessPool:  # the cells on disk stay; the next attempt does the rest
            return


def _backend(options: Options) -> AbstractContextManager[Any]:
    """Return the joblib backend: processes here, or a running Dask cluster."""
    if options.backend == "dask":
        import joblib
        from dask.distributed import Client

        client = Client(options.address)
        return joblib.parallel_config(backend="dask", client=client)
    if options.backend != "loky":
        raise ValueError(f"backend = {options.backend!r}; choose 'loky' or 'dask'")
    return nullcontext()


def _compute_one(cell: Cell, store: Store) -> tuple[str, str | None]:
    """Compute a cell and keep it; an error is returned as a sentence."""
    try:
        store.save(cell.key, cells_module.compute(cell))
    except Exception as error:
        return cell.key, f"{type(error).__name__}: {error}"
    return cell.key, None


_watching = threading.Event()


def _compute_in_worker(cell: Cell, store: Store, driver: int) -> tuple[str, str | None]:
    """As :func:`_compute_one`, in a process that ends with the one that started it."""
    if not _watching.is_set():
        _watching.set()
        threading.Thread(target=_end_with, args=(driver,), daemon=True).start()
    return _compute_one(cell, store)


def _end_with(driver: int) -> None:
    """End this process when the driver is gone (a killed driver leaves its workers otherwise)."""
    if os.getppid() != driver:  # a cluster's worker, or one started through a helper
        return
    while os.getppid() == driver:
        time.sleep(0.5)
    os._exit(1)


def pairs_of(
    entrants: Iterable[Entrant], tracks: Iterable[ScenarioSet]
) -> list[tuple[Entrant, ScenarioSet]]:
    """Return every controller with every track of an environment that it runs in."""
    chosen = list(entrants)
    return [(e, track) for track in tracks for e in chosen if e.runs_in(track.env)]
