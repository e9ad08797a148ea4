"""Settled readings of any rig, without time: a quasi-static table.

    load_kg,pressure_bar,direction,repeat,contraction_mm
    2.55,0.5,inflating,1,0.31

The repeats may take different paths, and a cycle may reverse any number of times, unlike in the
published table (:mod:`pam_envs.data.tables`).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pam_envs.data.recording.columns import Sheet, read_sheet, refuse, rows_text
from pam_envs.data.tables import BAR, MM, ContractionTable, sorted_table

Array = NDArray[np.float64]

READINGS = ("load_kg", "pressure_bar", "direction", "repeat", "contraction_mm")
"""The columns of a table of settled readings."""
REQUIRED = ("load_kg", "pressure_bar", "direction", "contraction_mm")
UP = ("inflating", "inflation", "up")
DOWN = ("deflating", "deflation", "down")
BOUNDS = {
    "load_kg": (0.0, 1000.0),
    "pressure_bar": (-1.0, 20.0),
    "repeat": (0, 100_000),
    "contraction_mm": (-1000.0, 1000.0),
}


def load_readings(path: str | Path) -> ContractionTable:
    """Read settled readings.

    Parameters
    ----------
    path : str or Path
        A CSV file with the columns of :data:`READINGS` in any order, ``repeat`` optional; each
        repeat's rows in the order in which they were taken.

    Returns
    -------
    ContractionTable
        In SI, sorted by load and repeat; ``cycles``, ``means`` and ``branch`` need
        :func:`one_path`.

    Raises
    ------
    RecordingError
        With all problems, naming column, rows and remedy.
    """
    sheet = read_sheet(path, READINGS, REQUIRED, "a table of readings")
    numbers = _numbers(sheet)
    inflating = _directions(sheet)
    numbers["pressure_bar"] *= BAR
    numbers["contraction_mm"] *= MM
    table = sorted_table(numbers, inflating)
    order = np.lexsort((numbers["repeat"], numbers["load_kg"]))
    _check_order(table, sheet.rows[order], sheet.where)
    return table


def one_path(table: ContractionTable) -> bool:
    """Return whether all repeats at a load went up once and down once, over the same pressures."""
    for load in table.loads:
        path, _ = table.cycle(load, table.repeats(load)[0])
        top = int(np.argmax(path))
        if np.any(np.diff(path[: top + 1]) <= 0.0) or np.any(np.diff(path[top:]) >= 0.0):
            return False
        others = (table.cycle(load, repeat)[0] for repeat in table.repeats(load))
        if not all(np.array_equal(path, other) for other in others):
            return False
    return True


def _numbers(sheet: Sheet) -> dict[str, Array]:
    numbers, problems = {}, []
    for name, (low, high) in BOUNDS.items():
        if name not in sheet.cells:
            numbers[name] = np.ones(len(sheet.rows))
            continue
        values, empty, wrong = sheet.numbers(name)
        problems += wrong
        if empty.any():
            at = rows_text(sheet.rows[empty])
            problems.append(f"column {name} is empty in {at}; fill the cells or leave the rows out")
        outside = (values < low) | (values > high)
        if name == "repeat":
            outside |= np.isfinite(values) & (values != np.round(values))
        if outside.any():
            first = values[outside][0]
            kind = "a whole number from" if name == "repeat" else "a number from"
            problems.append(
                f"column {name} holds {first:g} and the like in {rows_text(sheet.rows[outside])}; "
                f"{kind} {low:g} to {high:g} is needed: correct the cells or their unit"
            )
        numbers[name] = values
    if problems:
        refuse(sheet.where, *problems)
    return numbers


def _directions(sheet: Sheet) -> NDArray[np.bool_]:
    words = [word.lower() for word in sheet.text("direction")]
    wrong = [i for i, word in enumerate(words) if word not in UP + DOWN]
    if wrong:
        refuse(
            sheet.where,
            f"column direction holds {words[wrong[0]]!r} and the like in "
            f"{rows_text(sheet.rows[wrong])}; write inflating or deflating (or up, down)",
        )
    return np.array([word in UP for word in words], dtype=bool)


def _check_order(table: ContractionTable, rows: NDArray[np.int64], where: str) -> None:
    """Raise where a pressure moves against the direction of its row."""
    same = (np.diff(table.load_kg) == 0.0) & (np.diff(table.repeat) == 0)
    step = np.where(table.inflating[1:], 1.0, -1.0) * np.diff(table.pressure_pa)
    wrong = same & (step < 0.0)
    if wrong.any():
        refuse(
            where,
            f"the pressure moves against the direction in {rows_text(rows[1:][wrong])}; within a "
            "load and repeat, put the rows in the order of the readings",
        )
