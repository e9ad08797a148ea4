"""Channels of HDF5 files: ``group/dataset``, ``group/dataset[2]``, ``group/table/field``."""

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pam_envs.data.recording.formats.signals import (
    MOST_NAMES,
    ChannelError,
    Signal,
    check_count,
    column,
    failures_named,
    missing_package,
    unknown,
)
from pam_envs.wording import shown

KIND = "HDF5"
COLUMN = re.compile(r"(.*)\[(\d{1,6})\]")
UNIT_KEYS = ("units", "unit")


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """Open a file with h5py, read-only."""
    try:
        import h5py
    except ImportError as error:
        raise missing_package(str(path), KIND, "h5py") from error
    with failures_named(str(path), KIND), h5py.File(path, "r") as file:
        yield file


@contextmanager
def open_hdf5(path: Path) -> Iterator["Hdf5Log"]:
    """Open a file for its channels."""
    with opened(path) as file:
        yield Hdf5Log(file)


class Hdf5Log:
    """Datasets of an open HDF5 file."""

    def __init__(self, file: Any) -> None:
        self.file = file

    def names(self) -> Iterable[str]:
        """Return the paths of the datasets, and of the fields of tables."""
        return list(self._walk())

    def _walk(self) -> Iterator[str]:
        found: list[str] = []

        def visit(name: str, item: Any) -> bool | None:
            fields = getattr(getattr(item, "dtype", None), "names", None)
            if fields:
                found.extend(f"{name}/{field}" for field in fields)
            elif hasattr(item, "dtype"):
                found.append(name)
            return True if len(found) >= MOST_NAMES else None

        self.file.visititems(visit)
        yield from found

    def read(self, name: str) -> Signal:
        """Return a dataset, a column of one, or a field of a table."""
        match = COLUMN.fullmatch(name)
        path, index = (match[1], int(match[2])) if match else (name, None)
        item, field = self.find(path.strip("/")), None
        if item is None:
            above, _, field = path.strip("/").rpartition("/")
            item = self.find(above)
            if item is None or field not in (item.dtype.names or ()):
                raise unknown(name, self.names())
        self.check(item, name)
        values = item[field] if field else item[()]
        if values.dtype.kind == "O":
            values = item.asstr()[()].astype(str)
        stated = next((item.attrs[key] for key in UNIT_KEYS if key in item.attrs), "")
        unit = stated.decode("utf-8", "replace") if isinstance(stated, bytes) else str(stated)
        return Signal(column(name, values, index, f"{path}[0]"), unit)

    def find(self, path: str) -> Any:
        """Return a dataset, or None."""
        item = self.file.get(path) if path else None
        return item if hasattr(item, "dtype") else None

    def check(self, item: Any, name: str) -> None:
        """Refuse a dataset that is too large, or whose values are in another file."""
        check_count(name, item.size or 0)
        if item.is_virtual or item.external or item.file.filename != self.file.filename:
            raise ChannelError(
                f"channel {shown(name)} is stored in another file; copy its values into this one"
            )
