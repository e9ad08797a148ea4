"""Outcome of a diagnosis."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pam_envs.diagnosis.report.traces import Traces
from pam_envs.plants.single_muscle.plant import SingleMuscle


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
