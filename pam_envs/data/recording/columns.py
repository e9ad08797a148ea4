"""Columns of a file of measurements: header, cells and their faults."""

import csv
import dataclasses
import gzip
import itertools
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array
from pam_envs.wording import near, shown

SHOWN = 5
"""Largest number of rows that a message names."""
MOST_BYTES = 64_000_000
MOST_COLUMNS = 100
LONGEST_LABEL = 200
"""Largest number of characters of a name or a label."""
LARGEST = 1e20
"""Larger numbers are none of a measurement, and overflow in sums of powers."""

CONVERSIONS = {
    "s": {"ms": "divide by 1000", "us": "divide by 1e6", "min": "multiply by 60"},
    "bar": {
        "kpa": "divide by 100",
        "mpa": "multiply by 10",
        "pa": "divide by 1e5",
        "mbar": "divide by 1000",
        "psi": "divide by 14.504",
    },
    "mm": {
        "m": "multiply by 1000",
        "cm": "multiply by 10",
        "um": "divide by 1000",
        "in": "multiply by 25.4",
        "percent": "multiply by a hundredth of the rest length",
    },
    "N": {"kg": "multiply by 9.80665", "g": "multiply by 0.00980665", "kn": "multiply by 1000"},
    "C": {"k": "subtract 273.15", "f": "subtract 32 and divide by 1.8"},
    "kg": {"n": "divide by 9.80665", "g": "divide by 1000"},
}
"""Conversion to a unit of SI from another unit (lower case), in words."""


class RecordingError(ValueError):
    """A file of measurements that cannot be used; each of ``problems`` has rows and remedy."""

    def __init__(self, where: str, problems: Iterable[str]) -> None:
        self.where = where
        self.problems = tuple(problems)
        many = len(self.problems) > 1
        text = "".join(f"\n- {p}" for p in self.problems) if many else " " + self.problems[0]
        super().__init__(f"{where}:{text}")

    def __reduce__(self) -> "tuple[type[RecordingError], tuple[str, tuple[str, ...]]]":
        """Let the error travel between processes."""
        return type(self), (self.where, self.problems)


def refuse(where: str, *problems: str) -> NoReturn:
    """Raise a :class:`RecordingError`."""
    raise RecordingError(where, problems)


def rows_text(rows: Iterable[int]) -> str:
    """Return "row 4", "rows 4, 5 and 9", or the first of many with their number."""
    numbers = [int(row) for row in rows]
    if len(numbers) == 1:
        return f"row {numbers[0]}"
    if len(numbers) <= SHOWN:
        return f"rows {', '.join(map(str, numbers[:-1]))} and {numbers[-1]}"
    return f"rows {', '.join(map(str, numbers[:SHOWN]))} and {len(numbers) - SHOWN} more"


def span_text(first: int, last: int) -> str:
    """Return "rows 4 to 9"."""
    return f"row {first}" if first == last else f"rows {first} to {last}"


@dataclasses.dataclass(frozen=True)
class Sheet:
    """Cells of a file by column, without surrounding spaces; blank rows are left out.

    ``where`` is the file, for messages, and ``rows`` are those of the cells; the header is row 1.
    Columns of a file that is no text are arrays of numbers (NaN is an empty cell) or of words.
    """

    where: str
    cells: Mapping[str, "list[str] | NDArray[Any]"]
    rows: NDArray[np.int64]

    def words(self, column: str) -> list[str]:
        """Return the cells of a column as text."""
        cells = self.cells[column]
        if isinstance(cells, np.ndarray) and cells.dtype.kind == "f":
            return ["" if np.isnan(cell) else f"{cell:g}" for cell in cells]
        return [str(cell).strip() for cell in cells]

    def text(self, column: str) -> list[str]:
        """Return a column of words; none may be missing."""
        cells = self.words(column)
        empty = [int(r) for r, cell in zip(self.rows, cells, strict=True) if not cell]
        if empty:
            refuse(self.where, f"column {column} is empty in {rows_text(empty)}; fill the cells")
        return cells

    def numbers(self, column: str) -> tuple[Array, NDArray[np.bool_], list[str]]:
        """Return a column in the file's unit, its empty cells, and the problems with others.

        Empty and wrong cells are NaN.
        """
        cells = self.cells[column]
        if isinstance(cells, np.ndarray) and cells.dtype.kind == "f":
            return self._array(column, cells)
        empty = np.array([not cell for cell in cells], dtype=bool)
        try:
            values = np.array([cell or "nan" for cell in cells], dtype=np.float64)
            words: list[int] = []
        except ValueError:
            found = [_number(cell or "nan") for cell in cells]
            values = np.array([np.nan if value is None else value for value in found])
            words = [i for i, value in enumerate(found) if value is None]
        wrong = ~(np.abs(values) < LARGEST) & ~empty
        wrong[words] = True
        values[wrong] = np.nan
        at = np.flatnonzero(wrong)
        if not len(at):
            return values, empty, []
        first = cells[at[0]]
        hint = "write decimals with a point" if "," in first else "correct the cells"
        problem = f"column {column} holds no number in {rows_text(self.rows[at])}"
        return values, empty, [f"{problem} (the first is {shown(first)}); {hint}"]

    def _array(
        self, column: str, values: NDArray[Any]
    ) -> tuple[Array, NDArray[np.bool_], list[str]]:
        """Return an array of numbers as :meth:`numbers` does."""
        empty = np.isnan(values)
        wrong = ~(np.abs(values) < LARGEST) & ~empty
        if not wrong.any():
            return values, empty, []
        at = f"{rows_text(self.rows[wrong])} (the first is {values[wrong][0]:g})"
        return values, empty, [f"column {column} holds no number in {at}; correct the values"]


def read_header(path: str | Path) -> tuple[str, ...]:
    """Return the names of a file's columns; RecordingError if it cannot be read or is empty."""
    where = str(path)
    lines = _lines(Path(path), where)
    _, cells = next(_cells(lines[:1], where), (1, []))
    header = tuple(cell.strip() for cell in cells)
    if len(header) > MOST_COLUMNS:
        refuse(where, f"row 1: there are {len(header)} columns; give at most {MOST_COLUMNS}")
    return header


def read_sheet(path: str | Path, known: Sequence[str], required: Sequence[str], what: str) -> Sheet:
    """Read a CSV file with some of the ``known`` columns, in any order, and all ``required`` ones.

    Names end in their unit if there is one; ``what`` describes the file in messages ("a
    recording"). Raises RecordingError for unknown, doubled or missing columns, and rows of the
    wrong length.
    """
    where = str(path)
    lines = _lines(Path(path), where)
    header = read_header(path)
    if len(header) == 1 and ";" in header[0]:
        refuse(where, "the cells are separated by ';'; save with ',' and with decimal points")
    problems = [
        f"row 1: unknown column {shown(name)}{column_hint(name, known)}"
        for name in header
        if name not in known
    ]
    problems += [f"row 1: the column {n} appears twice" for n in known if header.count(n) > 1]
    if not problems:  # a missing column is most often a misspelt one
        problems = [f"row 1: {what} needs the column {n}" for n in required if n not in header]
    if problems:
        refuse(where, *problems)
    return _sheet(lines, header, where)


def _sheet(lines: list[str], header: tuple[str, ...], where: str) -> Sheet:
    below = itertools.islice(_cells(lines, where), 1, None)
    filled = [(row, cells) for row, cells in below if any(c.strip() for c in cells)]
    ragged = [(row, len(cells)) for row, cells in filled if len(cells) != len(header)]
    if ragged:
        at = rows_text(row for row, _ in ragged)
        refuse(where, f"{len(header)} cells a row are needed, got {ragged[0][1]} in {at}")
    rows, table = [row for row, _ in filled], [cells for _, cells in filled]
    if not table:
        refuse(where, "there are no rows below the header; give at least one")
    columns = zip(*table, strict=True)
    cells_of = {
        n: [cell.strip() for cell in column] for n, column in zip(header, columns, strict=True)
    }
    return Sheet(where, cells_of, np.array(rows, dtype=np.int64))


def _cells(lines: list[str], where: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the last line of each row, from 1, and its cells."""
    reader = csv.reader(lines)
    try:
        for cells in reader:
            yield reader.line_num, cells
    except csv.Error as error:
        refuse(where, f"is not CSV: {error}; look for a quote that is not closed")


def column_hint(name: str, known: Iterable[str]) -> str:
    """Return the likely name and unit of an unknown column."""
    columns = list(known)
    if not name:
        return f"; name it or take it out, known: {', '.join(columns)}"
    stem, _, unit = name.rpartition("_")
    for column in columns:
        base, _, expected = column.rpartition("_")
        if expected not in CONVERSIONS:
            continue
        if name.lower() == base.lower():
            return f"; give {column}, with the unit in the name"
        if stem.lower() == base.lower() and unit != expected:
            recipe = CONVERSIONS[expected].get(unit.lower())
            return f"; give {column} instead" + (f": {recipe}" if recipe else "")
    return near(name, columns)


def _lines(path: Path, where: str) -> list[str]:
    """Return the lines of a CSV file, which may be compressed with gzip."""
    # utf-8-sig: spreadsheets put a byte order mark before the first column's name.
    try:
        with gzip.open(path) if path.suffix == ".gz" else path.open("rb") as file:
            data = file.read(MOST_BYTES + 1)
        if len(data) > MOST_BYTES:
            refuse(
                where,
                f"has more than {MOST_BYTES:,} bytes; average it to 100 Hz, or split it into files",
            )
        text = data.decode("utf-8-sig")
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        refuse(where, f"is not a complete gzip file ({error}); compress the CSV again")
    except OSError as error:
        refuse(where, f"cannot be read: {error.strerror or error}")
    except UnicodeDecodeError as error:
        refuse(where, f"is not text in UTF-8 ({error.reason}); save it as CSV in UTF-8")
    if not text:
        refuse(where, "is empty; row 1 must name the columns")
    return text.splitlines()


def _number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None
