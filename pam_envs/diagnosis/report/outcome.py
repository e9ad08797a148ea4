"""Outcome of a diagnosis, its time series, and the progress bar."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.diagnosis.arrays import Array
from pam_envs.plants.single_muscle.plant import SingleMuscle


@contextmanager
def steps(progress: bool) -> Iterator[Callable[[str], None]]:
    """Provide a function that shows the present stage."""
    if not progress:
        yield lambda text: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, transient=True) as bar:
        task = bar.add_task("reading", total=7)

        def step(text: str) -> None:
            bar.update(task, description=text, advance=1)

        yield step


@dataclass(frozen=True)
class Traces:
    """Time series of a report in SI, shape (T,): [s], [Pa], [N], [deg C].

    ``segment`` is an index into the labels ``segments``; ``held_out`` are the samples of the
    reported errors. ``measured``, ``base`` and ``extended`` are readings and simulations by output,
    ``effects`` the contributions of the named causes.
    """

    time: Array
    segment: NDArray[np.int64]
    segments: tuple[str, ...]
    held_out: NDArray[np.bool_]
    command: Array
    load: Array
    temperature: Array | None
    measured: dict[str, Array]
    base: dict[str, Array]
    extended: dict[str, Array]
    effects: dict[str, dict[str, Array]]


@dataclass(frozen=True)
class Diagnosis:
    """Outcome of a diagnosis.

    Attributes
    ----------
    verdict : {"adequate", "named", "ambiguous", "unexplained", "insufficient"}
        Verdict in one word.
    text : str
        Verdict in a few sentences.
    causes : tuple of str
        Names of the causes, in the order of evidence.
    report : dict
        Content of ``report.json`` (``docs/diagnosis_report.md``), in plain types, rounded.
    base, plant : SingleMuscle
        The refitted plant, and the plant extended by the causes; equal without a cause.
    traces : Traces
        Time series of the figures.
    study : Study
        Private: the underlying fits. It may change in any version.
    """

    verdict: str
    text: str
    causes: tuple[str, ...]
    report: dict[str, Any]
    base: SingleMuscle
    plant: SingleMuscle
    traces: Traces
    study: Any = field(default=None, repr=False, compare=False)

    def write(self, folder: str | Path) -> None:
        """Write ``report.json``, ``report.html`` and ``plant.yaml``."""
        from pam_envs.diagnosis.report.report import write

        write(self, Path(folder))
