"""Outcome of a diagnosis, its time series, and the progress of its stages."""

import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array


@contextmanager
def steps(progress: bool) -> Iterator[Callable[[str], None]]:
    """Provide a function that prints the present stage and the time since the start."""
    started = time.monotonic()

    def step(text: str) -> None:
        minutes, seconds = divmod(round(time.monotonic() - started), 60)
        if progress:
            print(f"{minutes}:{seconds:02}  {text}", file=sys.stderr, flush=True)

    yield step


@dataclass(frozen=True)
class Traces:
    """Time series of a report in SI, shape (T,): [s], [Pa], [N], [deg C]."""

    time: Array
    segment: NDArray[np.int64]  # index into the labels ``segments``
    segments: tuple[str, ...]
    held_out: NDArray[np.bool_]  # samples of the reported errors
    command: Array
    load: Array
    temperature: Array | None
    measured: dict[str, Array]  # readings by output, as the simulations base and extended
    base: dict[str, Array]
    extended: dict[str, Array]
    effects: dict[str, dict[str, Array]]  # contributions of the named causes
    # unit of each output, and the unit in SI
    units: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    # label and values of the driving signal, if no output is it
    drive: tuple[str, Array] | None = None


@dataclass(frozen=True)
class Diagnosis:
    """Outcome of a diagnosis."""

    verdict: str  # "adequate", "named", "ambiguous", "unexplained" or "insufficient"
    text: str  # verdict in a few sentences
    causes: tuple[str, ...]  # names, in the order of evidence
    report: dict[str, Any]  # content of report.json (docs/diagnosis_report.md), rounded
    base: Any  # the refitted plant
    plant: Any  # the base extended by the causes; equal to it without a cause
    traces: Traces  # time series of the figures
    # private: the underlying fits (Study), which may change in any version
    study: Any = field(default=None, repr=False, compare=False)

    def write(self, folder: str | Path) -> None:
        """Write ``report.json``, ``report.html`` and ``plant.yaml``."""
        from pam_envs.diagnosis.report.report import write

        write(self, Path(folder))
