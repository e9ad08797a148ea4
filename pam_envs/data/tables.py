"""Settled readings without time: a quasi-static table, checked while reading.

    load_kg,pressure_bar,direction,repeat,contraction_mm
    2.55,0.5,inflating,1,0.31

The shipped table has 375 readings of a Festo MAS-10-N-100 (positioning2021, Tables 3 to 5): three
hanging loads, five cycles each, one cycle 0 to 6 bar and back in steps of 0.5 bar, a minute of rest
before each reading. Hysteresis makes a reading depend on those before it: the arrays keep their
order.
"""

import dataclasses
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array
from pam_envs.constants import BAR, MM
from pam_envs.data.recording.columns import RecordingError, Sheet, read_sheet, refuse, rows_text
from pam_envs.wording import shown

LOAD_TOLERANCE = 1e-6
"""Two loads [kg] closer than this are the same load."""
READINGS = ("load_kg", "pressure_bar", "direction", "repeat", "contraction_mm")
"""The columns of a table of settled readings."""
MOST_READINGS = 20_000
UP = ("inflating", "inflation", "up")
DOWN = ("deflating", "deflation", "down")
BOUNDS = {
    "load_kg": (0.0, 1000.0),
    "pressure_bar": (-1.0, 20.0),
    "repeat": (0, 100_000),
    "contraction_mm": (-1000.0, 1000.0),
}


@dataclasses.dataclass(frozen=True)
class ContractionTable:
    """Static contractions over pressure cycles under constant loads.

    All arrays have one entry per reading, shape (n,), and are read-only, sorted by load and
    repeat; a repeat is in the order of the cycle: pressure up, then down.

    Attributes
    ----------
    load_kg : ndarray of float
        Hanging mass [kg].
    inflating : ndarray of bool
        Whether the pressure had been raised to this reading; the reading at the turning point
        counts as inflating.
    pressure_pa : ndarray of float
        Gauge pressure [Pa].
    repeat : ndarray of int
        Number of the cycle at this load, from 1.
    contraction_m : ndarray of float
        Contraction [m] from the muscle's length at this load, without pressure, before the cycle.
    """

    load_kg: Array
    inflating: NDArray[np.bool_]
    pressure_pa: Array
    repeat: NDArray[np.int64]
    contraction_m: Array

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for field in dataclasses.fields(self):
            getattr(self, field.name).setflags(write=False)

    @property
    def loads(self) -> tuple[float, ...]:
        """The loads [kg], ascending."""
        return tuple(float(load) for load in np.unique(self.load_kg))

    def repeats(self, load: float) -> tuple[int, ...]:
        """Return the numbers of the cycles measured at ``load`` [kg]."""
        return tuple(int(number) for number in np.unique(self.repeat[self._at(load)]))

    def cycle(self, load: float, repeat: int) -> tuple[Array, Array]:
        """Return the pressures [Pa] and contractions [m] of one cycle, shape (m,), in their order.

        In the published tables m is 25: 0 to 6 bar and back to 0. Raises ValueError if there is no
        such load [kg] or repeat.
        """
        rows = self._at(load) & (self.repeat == repeat)
        if not rows.any():
            raise ValueError(
                f"no repeat {repeat!r} at {load:g} kg; the repeats there are {self.repeats(load)}"
            )
        return self.pressure_pa[rows], self.contraction_m[rows]

    def cycles(self, load: float) -> tuple[Array, Array]:
        """Return the path [Pa], shape (m,), and all contractions [m] at a load, (m, n_repeats)."""
        cycles = [self.cycle(load, repeat) for repeat in self.repeats(load)]
        return cycles[0][0], np.column_stack([contraction for _, contraction in cycles])

    def means(self, load: float) -> tuple[Array, Array]:
        """Return the path [Pa] and the contraction [m] averaged over the repeats, shape (m,)."""
        pressure, contraction = self.cycles(load)
        return pressure, contraction.mean(axis=1)

    def branch(self, load: float, inflating: bool) -> tuple[Array, Array]:
        """Return one branch of the loop at a load, both its ends included.

        The pressures [Pa] up to the turning point (``inflating``), or from it, in path order, and
        the contractions [m], shape (b, n_repeats).
        """
        pressure, contraction = self.cycles(load)
        top = int(np.argmax(pressure))
        part = slice(None, top + 1) if inflating else slice(top, None)
        return pressure[part], contraction[part]

    def without_repeat(self, repeat: int) -> "ContractionTable":
        """Return the table without one repeat of every load; ValueError without it or others."""
        kept = self.repeat != repeat
        if kept.all() or not kept.any():
            raise ValueError(
                f"leaving out repeat {repeat!r} leaves {int(kept.sum())} of {kept.size} readings; "
                f"choose one of several repeats, here {sorted(set(self.repeat.tolist()))}"
            )
        return ContractionTable(**{name: values[kept] for name, values in vars(self).items()})

    def _at(self, load: float) -> NDArray[np.bool_]:
        rows: NDArray[np.bool_] = np.abs(self.load_kg - load) < LOAD_TOLERANCE
        if not rows.any():
            known = ", ".join(f"{one:g}" for one in self.loads)
            raise ValueError(f"no readings at {load!r} kg; the loads of this table are {known} kg")
        return rows


def load_readings(path: str | Path) -> ContractionTable:
    """Read settled readings; the repeats may take different paths, with any number of reversals.

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
    required = [name for name in READINGS if name != "repeat"]
    sheet = read_sheet(path, READINGS, required, "a table of readings")
    if len(sheet.rows) > MOST_READINGS:
        refuse(sheet.where, f"there are {len(sheet.rows)} readings; give at most {MOST_READINGS}")
    numbers = _numbers(sheet)
    inflating = _directions(sheet)
    order = np.lexsort((numbers["repeat"], numbers["load_kg"]))
    table = ContractionTable(
        load_kg=numbers["load_kg"][order],
        inflating=inflating[order],
        pressure_pa=BAR * numbers["pressure_bar"][order],
        repeat=numbers["repeat"][order].astype(np.int64),
        contraction_m=MM * numbers["contraction_mm"][order],
    )
    _check_order(table, sheet.rows[order], sheet.where)
    return table


def load_contraction_table(path: str | Path | None = None) -> ContractionTable:
    """Read a table of which all repeats at a load are one cycle over the same pressures.

    ``path`` is a file as for :func:`load_readings`; default: the published 375 readings. Raises
    RecordingError, a ValueError, with all problems, naming column, rows and remedy.
    """
    source = resources.files(__package__) / "mas10_contraction.csv" if path is None else path
    table = load_readings(Path(str(source)))
    fault = _path_fault(table)
    if fault:
        raise RecordingError(str(source), [fault])
    return table


def one_path(table: ContractionTable) -> bool:
    """Return whether all repeats at a load went up once and down once, over the same pressures."""
    return not _path_fault(table)


def _path_fault(table: ContractionTable) -> str:
    """Return the fault of the paths of a table in a sentence, or an empty string."""
    for load in table.loads:
        path, _ = table.cycle(load, table.repeats(load)[0])
        for repeat in table.repeats(load):
            pressure, _ = table.cycle(load, repeat)
            top = int(np.argmax(pressure))
            where = f"load {load:g} kg, repeat {repeat}"
            if np.any(np.diff(pressure[: top + 1]) <= 0.0) or np.any(
                np.diff(pressure[top:]) >= 0.0
            ):
                return (
                    f"{where}: the pressures must rise along the inflation rows and then fall "
                    "along the deflation rows; put the rows in the order of the readings, each "
                    "pressure once per direction"
                )
            if not np.array_equal(pressure, path):
                return (
                    f"{where}: its pressures differ from those of the load's first repeat; "
                    "measure every repeat at the same pressures, in the same order"
                )
    return ""


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
            f"column direction holds {shown(words[wrong[0]])} and the like in "
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
