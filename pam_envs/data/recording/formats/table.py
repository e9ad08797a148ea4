"""Channels of CSV files with other columns than those of a recording."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from pam_envs.data.recording.columns import Sheet, read_header, read_sheet, refuse
from pam_envs.data.recording.formats.signals import Signal, unknown


@contextmanager
def open_table(path: Path) -> Iterator["TableLog"]:
    """Open a CSV file for its columns."""
    yield TableLog(read_sheet(path, read_header(path), (), "a table"))


class TableLog:
    """Columns of a CSV file."""

    def __init__(self, sheet: Sheet) -> None:
        self.sheet = sheet

    def names(self) -> Iterable[str]:
        """Return the names of the columns."""
        return self.sheet.cells

    def read(self, name: str) -> Signal:
        """Return a column, of words if it holds any; empty cells of numbers are NaN."""
        if name not in self.sheet.cells:
            raise unknown(name, self.names())
        values, _, problems = self.sheet.numbers(name)
        if problems and not any(_is_number(cell) for cell in self.sheet.cells[name]):
            return Signal(np.array(self.sheet.words(name)))
        if problems:
            refuse(self.sheet.where, *problems)
        return Signal(values)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
