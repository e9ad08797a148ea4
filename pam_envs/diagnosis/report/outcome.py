"""What a diagnosis gives."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pam_envs.diagnosis.report.traces import Traces
from pam_envs.plants.single_muscle.plant import SingleMuscle


@dataclass(frozen=True)
class Diagnosis:
    """The outcome.

    Attributes
    ----------
    verdict : {"adequate", "named", "ambiguous", "unexplained", "insufficient"}
        In a word.
    text : str
        In a few sentences.
    causes : tuple of str
        Names of the causes, in the order of evidence.
    report : dict
        What ``report.json`` holds (``docs/diagnosis_report.md``), in plain types, rounded as there.
    base, plant : SingleMuscle
        The refitted plant, and that with the causes in it; the same where there are none.
    traces : Traces
        What the figures draw.
    study : Study
        Private: the fits that all this was made from. It may change in any version.
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
