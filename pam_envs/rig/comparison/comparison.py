"""Comparison of predicted with measured closed-loop figures of a rig: rows, ranks, sentence."""

import json
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pam_envs.files import write_text
from pam_envs.rig.comparison import picture, prediction, ranks, references, words
from pam_envs.rig.comparison.figures import FIGURES
from pam_envs.rig.comparison.prediction import Prediction, Settings
from pam_envs.rig.comparison.rows import Ranking, Row
from pam_envs.rig.comparison.table import Condition, Measurement
from pam_envs.wording import package

SCHEMA = 1
JSON, PICTURE = "comparison.json", "comparison.png"


@dataclass(frozen=True)
class Comparison:
    """All rows of a table with the rankings that they give."""

    settings: Settings
    rows: tuple[Row, ...]
    rankings: tuple[Ranking, ...]

    @property
    def text(self) -> str:
        """Result in words."""
        return " ".join((words.accuracy(self.rows), words.order(self.rankings)))

    def table(self) -> str:
        """Return the rows and rankings as lines of text."""
        return "\n".join((*words.rows_text(self.rows), *map(words.ranking_text, self.rankings)))

    def record(self) -> dict[str, Any]:
        """Return the comparison for a JSON file."""
        chosen = self.settings
        return {
            "schema": SCHEMA,
            "package": package(),
            "plant": chosen.plant.digest(),
            "model": chosen.model.digest(),
            "runs": chosen.runs,
            "seed": chosen.seed,
            "holds": chosen.holds.number,
            "hold_s": chosen.holds.seconds,
            "range_m": chosen.holds.span,
            "settled_s": chosen.settled,
            "interval_level": prediction.LEVEL,
            "rows": [row.record() for row in self.rows],
            "rankings": [ranking.record() for ranking in self.rankings],
            "text": self.text,
        }

    def write(self, folder: Path) -> list[Path]:
        """Write JSON and picture into a folder; return the files."""
        folder.mkdir(parents=True, exist_ok=True)
        write_text(folder / JSON, json.dumps(self.record(), indent=1) + "\n")
        picture.write(self.rows, folder / PICTURE)
        return [folder / JSON, folder / PICTURE]


def compare(
    settings: Settings,
    measurements: Sequence[Measurement],
    progress: Callable[[str], None] = lambda line: None,
) -> Comparison:
    """Predict the figures of measurements and compare.

    Parameters
    ----------
    settings : Settings
        Plant, nominal model and runs.
    measurements : sequence of Measurement
        Lines of the table, checked before the first run.
    progress : callable
        Called with a line before the runs of each measurement.

    Raises
    ------
    ValueError
        If a controller is not in the catalogue, or a reference does not fit the plant.
    """
    entries = [prediction.entry_of(measured) for measured in measurements]
    given = _references(settings, measurements)
    rows: list[Row] = []
    for n, (measured, entry) in enumerate(zip(measurements, entries, strict=True), 1):
        progress(f"{n} of {len(measurements)}: {measured.controller}, {measured.condition.text}")
        found = prediction.predict(
            settings,
            measured.controller,
            measured.condition,
            given[measured.condition],
            tuple(measured.figures),
        )
        rows += _rows(measured, entry, found)
    return Comparison(settings, tuple(rows), tuple(_rankings(rows)))


def _references(
    settings: Settings, measurements: Iterable[Measurement]
) -> dict[Condition, list[Any]]:
    """Return the reference of each run by condition, checked."""
    figures: dict[Condition, set[str]] = defaultdict(set)
    for measured in measurements:
        figures[measured.condition] |= set(measured.figures)
    made, period = {}, settings.plant.control_period
    for condition, names in figures.items():
        file = condition.reference
        samples = None if file is None else references.read(file, period)
        made[condition] = prediction.references_of(settings, condition, samples)
        if "bias_mm" in names:
            prediction.check_holds(made[condition][0], period, settings.settled)
    return made


def _rows(measured: Measurement, entry: Any, found: Prediction) -> list[Row]:
    return [
        Row(
            measured.controller,
            measured.condition,
            name,
            found.mean(name),
            *found.interval(name),
            value,
            entry.knowledge,
            entry.preview,
        )
        for name, value in measured.figures.items()
    ]


def _rankings(rows: Iterable[Row]) -> list[Ranking]:
    """Return the ranking of each figure and condition with enough controllers."""
    groups: dict[tuple[str, Condition], list[Row]] = defaultdict(list)
    for row in rows:
        groups[row.figure, row.condition].append(row)
    made = []
    for (figure, condition), group in sorted(
        groups.items(), key=lambda item: list(FIGURES).index(item[0][0])
    ):
        if len(group) >= ranks.FEWEST:
            sides = [row.predicted for row in group], [row.measured for row in group]
            both = [ranks.correlation(kind, *sides) for kind in ("kendall", "spearman")]
            made.append(Ranking(figure, condition, len(group), *both))
    return made
