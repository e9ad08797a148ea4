"""Table of static forces of a muscle over pressure and contraction.

pressure_bar,contraction_mm,force_N
2.0,0.0,148.0
2.0,10.0,61.5
"""

import dataclasses
from pathlib import Path

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import BAR, MM
from pam_envs.data.recording.columns import read_header, refuse, rows_text
from pam_envs.data.recording.formats.mapped import is_log, sheet_of
from pam_envs.data.rig_file import Rig

COLUMNS = ("pressure_bar", "contraction_mm", "force_N")
UNITS = {"pressure_bar": BAR, "contraction_mm": MM, "force_N": 1.0}
LEAST_ROWS = 8
LEAST_LEVELS = 3
"""Least number of pressures and of contractions."""


@dataclasses.dataclass(frozen=True)
class ForceTable:
    """Readings of a load cell at held lengths and pressures, shape (n,) each, in SI.

    Attributes
    ----------
    pressure, contraction, force : ndarray
        Gauge pressure [Pa], rest length minus length [m] and pull [N]; a force of 0 is a slack
        muscle.
    source : str
        Origin of the table.
    """

    pressure: Array
    contraction: Array
    force: Array
    source: str


def is_force_table(path: str | Path, rig: Rig) -> bool:
    """Return whether a file, with the columns that a rig maps, is a table of static forces."""
    if is_log(path) and not rig.channels:
        return False
    return set(COLUMNS) == set(rig.channels or read_header(path))


def load_force_table(path: str | Path, rig: Rig) -> ForceTable:
    """Read a table of static forces.

    Raises
    ------
    RecordingError
        With all problems, naming column, rows and remedy.
    """
    sheet = sheet_of(path, rig.channels, COLUMNS, COLUMNS, "a table of forces")
    found, problems = {}, []
    for name in COLUMNS:
        values, empty, wrong = sheet.numbers(name)
        problems += wrong
        if empty.any() and not wrong:
            at = rows_text(sheet.rows[empty])
            problems.append(f"column {name} is empty in {at}; fill the cells or leave the rows out")
        found[name] = values * UNITS[name]
    if problems:
        refuse(sheet.where, *problems)
    pressure, contraction, force = (found[name] for name in COLUMNS)
    if len(force) < LEAST_ROWS:
        problems.append(f"{len(force)} rows are too few; give at least {LEAST_ROWS}")
    for name, values, unit in (
        ("pressure_bar", pressure, "pressures"),
        ("contraction_mm", contraction, "contractions"),
    ):
        levels = len(np.unique(values[force > 0.0]))
        if levels < LEAST_LEVELS:
            problems.append(
                f"column {name} has {levels} different values with a force above 0 N; give at "
                f"least {LEAST_LEVELS} {unit}"
            )
    if force.min() < 0.0:
        at = rows_text(sheet.rows[force < 0.0])
        problems.append(f"force_N is below 0 N in {at}; a muscle pulls: give the pull as positive")
    if problems:
        refuse(sheet.where, *problems)
    return ForceTable(pressure, contraction, force, str(path))
