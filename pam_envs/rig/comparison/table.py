"""Table of measured closed-loop figures of a rig: one line per controller and condition.

``controller`` is a name of the catalogue. Optional columns of the condition are ``load_kg`` and
``reference``, a CSV file relative to the table. The other columns are figures of
:data:`~pam_envs.rig.comparison.figures.FIGURES`; an empty cell has not been measured. Lines that
start with ``#`` are comments.
"""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pam_envs.rig.comparison.figures import FIGURES
from pam_envs.wording import near, shown

CONTROLLER, LOAD, REFERENCE = "controller", "load_kg", "reference"
HEAVIEST = 5.0
"""Largest load [kg] of the environment."""


@dataclass(frozen=True)
class Condition:
    """Condition of a measurement: load [kg], and file of the reference or None."""

    load: float
    reference: Path | None = None

    @property
    def text(self) -> str:
        """Condition in words."""
        file = "" if self.reference is None else f", {self.reference.name}"
        return f"{self.load:g} kg{file}"


@dataclass(frozen=True)
class Measurement:
    """Measured figures of a controller in a condition.

    Attributes
    ----------
    line : int
        Line of the table.
    figures : mapping of float
        By the names of the columns, in their units.
    """

    line: int
    controller: str
    condition: Condition
    figures: Mapping[str, float]


def read(path: Path, load: float, reference: Path | None = None) -> list[Measurement]:
    """Return the measurements of a table.

    Parameters
    ----------
    path : Path
        CSV file.
    load : float
        Load [kg] of lines without one.
    reference : Path, optional
        File of the reference of lines without one.

    Raises
    ------
    ValueError
        If a column is unknown, a cell is no admissible number, a line has no figure, or two lines
        have the same controller and condition.
    """
    with open(path, encoding="utf-8-sig", newline="") as file:
        lines = [(n, line) for n, line in enumerate(file, 1) if line.strip(" \t\r\n,;")]
    kept = [(n, line) for n, line in lines if not line.lstrip().startswith("#")]
    if len(kept) < 2:
        raise ValueError(f"{path} has {len(kept)} lines; it needs a header and one per controller")
    rows = list(csv.reader([line for _, line in kept], skipinitialspace=True))
    header = [name.strip() for name in rows[0]]
    _check_header(path, header)
    made: list[Measurement] = []
    for (line, _), cells in zip(kept[1:], rows[1:], strict=True):
        where = f"{path}, line {line}"
        if len(cells) != len(header):
            raise ValueError(f"{where} has {len(cells)} cells and the header {len(header)}")
        values = {name: cell.strip() for name, cell in zip(header, cells, strict=True)}
        made.append(_measurement(where, line, values, path.parent, Condition(load, reference)))
        for other in made[:-1]:
            if (other.controller, other.condition) == (made[-1].controller, made[-1].condition):
                raise ValueError(
                    f"{where}: {other.controller} at {other.condition.text} is on line "
                    f"{other.line} already; give the mean of repeated measurements"
                )
    return made


def _check_header(path: Path, header: Sequence[str]) -> None:
    known = (CONTROLLER, LOAD, REFERENCE, *FIGURES)
    for name in header:
        if name not in known:
            raise ValueError(f"{path}: column {shown(name)} is not known{near(name, known)}")
        if header.count(name) > 1:
            raise ValueError(f"{path}: column {name!r} occurs twice; keep one")
    if CONTROLLER not in header:
        raise ValueError(f"{path} has no column {CONTROLLER!r}; it names controllers of pam-envs")
    if not set(header) & set(FIGURES):
        raise ValueError(f"{path} has no figure; add a column of {', '.join(FIGURES)}")


def _measurement(
    where: str, line: int, values: Mapping[str, str], folder: Path, usual: Condition
) -> Measurement:
    """Return the measurement of a line."""
    if not values[CONTROLLER]:
        raise ValueError(f"{where} has no controller; name one, or remove the line")
    figures = {
        name: _number(where, name, values[name], 0.0, 1e6) for name in FIGURES if values.get(name)
    }
    if not figures:
        raise ValueError(f"{where} has no figure; remove the line, or fill in a cell")
    own, file = values.get(LOAD), values.get(REFERENCE)
    load = _number(where, LOAD, own, 0.0, HEAVIEST) if own else usual.load
    condition = Condition(load, folder / file if file else usual.reference)
    return Measurement(line, values[CONTROLLER], condition, figures)


def _number(where: str, name: str, cell: str, low: float, high: float) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        raise ValueError(
            f"{where}: {name} = {shown(cell)} must be a number from {low:g} to {high:g}; "
            "correct it, or leave the cell empty if it was not measured"
        )
    return value
