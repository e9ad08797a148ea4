"""Channels of MATLAB files in MATLAB's syntax: ``log.signals(2).values(:,1)``.

Files up to version 7.2 are read with scipy, those of version 7.3, which are HDF5, with h5py.
Objects (``timeseries``, ``timetable``, ``table``) have a form that MATLAB does not publish.
"""

import re
import struct
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from pam_envs.data.recording.columns import refuse
from pam_envs.data.recording.formats.hdf5 import Hdf5Log, opened
from pam_envs.data.recording.formats.signals import (
    MOST_BYTES,
    ChannelError,
    Log,
    Signal,
    check_count,
    column,
    failures_named,
    listing,
)
from pam_envs.wording import near, shown

KIND = "MATLAB"
STEP = re.compile(r"\.?([A-Za-z]\w*)|\((\d{1,6})\)|(?:\(:,(\d{1,6})\)$)")
HEADER, COMPRESSED, ORDER = 128, 15, slice(126, 128)
PIECE = 1 << 20  # bytes that are read or decompressed at once
OBJECT = (
    "is an object (timeseries, timetable, table or another class), which MATLAB stores in a form "
    "that it does not publish; save plain arrays, for example t = ts.Time; x = ts.Data"
)


def steps_of(name: str) -> list[tuple[str, Any]]:
    """Return the fields, indices and the column of a name, with indices from 1.

    ``log.x(2)(:,3)`` is ``[("field", "log"), ("field", "x"), ("index", 2), ("column", 3)]``.
    """
    plain, at = name.replace(" ", ""), 0
    found: list[tuple[str, Any]] = []
    while at < len(plain):
        match = STEP.match(plain, at)
        if match is None or (not found and match[1] is None):
            raise ChannelError(
                f"{shown(name)} is no channel of a MATLAB file; write log.signals(2).values(:,1)"
            )
        word, index, columns = match.groups()
        kind = "field" if word else "index" if index else "column"
        found.append((kind, word or int(index or columns)))
        at = match.end()
    if any(kind != "field" and place < 1 for kind, place in found):
        raise ChannelError(f"{shown(name)} has the index 0; indices of MATLAB start at 1")
    return found


@contextmanager
def open_matlab(path: Path) -> Iterator[Log]:
    """Open a file of any version for its channels."""
    with path.open("rb") as file:
        head = file.read(HEADER)
    if head.startswith(b"MATLAB 7.3") or head.startswith(b"\x89HDF"):
        with opened(path) as data, failures_named(str(path), KIND):
            yield Matlab73Log(data)
        return
    if head.startswith(b"MATLAB 5"):
        check_inflated(path, "<" if head[ORDER] == b"IM" else ">")
    with failures_named(str(path), KIND):
        yield MatlabLog(path)


def check_inflated(path: Path, order: str) -> None:
    """Refuse a file whose variables are too large once decompressed; RecordingError."""
    total = 0
    with path.open("rb") as file:
        file.seek(HEADER)
        while len(tag := file.read(8)) == 8:
            kind, size = struct.unpack(f"{order}II", tag)
            if kind != COMPRESSED:
                file.seek(size, 1)
                continue
            end, data = file.tell() + size, zlib.decompressobj()
            try:
                while not data.eof and (piece := file.read(min(PIECE, end - file.tell()))):
                    total += len(data.decompress(piece, PIECE))
                    while data.unconsumed_tail and total <= MOST_BYTES:
                        total += len(data.decompress(data.unconsumed_tail, PIECE))
                    if total > MOST_BYTES:
                        refuse(
                            str(path),
                            f"has more than {MOST_BYTES:,} bytes of variables; leave some out",
                        )
            except zlib.error as error:
                refuse(str(path), f"is not a readable MATLAB file ({error}); save it again")
            file.seek(end)


class MatlabLog:
    """Variables of a file up to version 7.2."""

    def __init__(self, path: Path) -> None:
        from scipy.io import whosmat

        self.path = path
        self.variables = [name for name, _, _ in whosmat(path)]
        self.held: dict[str, Any] = {}

    def names(self) -> Iterable[str]:
        """Return the names of the variables that are loaded, to the last field, and of others."""
        made = [path for name, value in self.held.items() for path in leaves(name, value)]
        return [*made, *(name for name in self.variables if name not in self.held)]

    def read(self, name: str) -> Signal:
        """Return an array of a variable."""
        from scipy.io import loadmat

        (_, root), *steps = steps_of(name)
        if root not in self.variables:
            hint = near(root, self.variables, listing(self.names()))
            raise ChannelError(f"no channel {shown(name)}{hint}")
        if root not in self.held:
            loaded = loadmat(self.path, variable_names=[root], simplify_cells=True)
            self.held[root] = loaded.get(root)
        found, index = self.held[root], None
        for kind, place in steps:
            if kind == "column":
                index = place - 1
            elif kind == "field":
                if not isinstance(found, dict) or place not in found:
                    raise _no_field(name, place, found if isinstance(found, dict) else ())
                found = found[place]
            else:
                found = _element(name, found, place)
        if found is None or type(found).__name__ in {"MatlabOpaque", "MatlabObject"}:
            raise ChannelError(f"channel {shown(name)} {OBJECT}")
        if isinstance(found, (dict, list)):
            raise ChannelError(f"channel {shown(name)} is no array{_inside(name, found)}")
        found = np.asarray(found)
        check_count(name, found.size)
        return Signal(column(name, found, index, f"{name}(:,1)"))


class Matlab73Log:
    """Variables of a file of version 7.3."""

    def __init__(self, file: Any) -> None:
        self.file = file
        self.plain = Hdf5Log(file)

    def names(self) -> Iterable[str]:
        """Return the names of the arrays."""
        return [n.replace("/", ".") for n in self.plain.names() if not n.startswith("#")]

    def read(self, name: str) -> Signal:
        """Return an array of a variable."""
        import h5py

        found, among, index = self.file, None, None
        for kind, place in steps_of(name):
            if kind == "column":
                index = place - 1
            elif kind == "field":
                if not isinstance(found, h5py.Group) or place not in found:
                    raise _no_field(name, place, found if isinstance(found, h5py.Group) else ())
                found = found[place]
                if among is not None:  # an array of structs holds references in each field
                    found, among = self._element(name, found, among), None
            elif isinstance(found, h5py.Group):
                among = place
            else:
                found = self._element(name, found, place)
        if isinstance(found, h5py.Group):
            raise ChannelError(f"channel {shown(name)} is no array{_inside(name, found)}")
        if "MATLAB_object_decode" in found.attrs:
            raise ChannelError(f"channel {shown(name)} {OBJECT}")
        self.plain.check(found, name)
        if "MATLAB_empty" in found.attrs:
            raise ChannelError(f"channel {shown(name)} is empty")
        if h5py.check_ref_dtype(found.dtype):
            raise ChannelError(f"channel {shown(name)} is no array; select one: {name}(1)")
        return Signal(column(name, found[()].T, index, f"{name}(:,1)"))

    def _element(self, name: str, found: Any, place: int) -> Any:
        import h5py

        if not h5py.check_ref_dtype(getattr(found, "dtype", np.dtype(float))):
            if place == 1:
                return found
            raise ChannelError(f"no element ({place}) in {shown(name)}")
        if place > found.size:
            raise ChannelError(f"no element ({place}) in {shown(name)}; it has {found.size}")
        return self.file[found[()].ravel()[place - 1]]


def leaves(name: str, value: Any, depth: int = 0) -> Iterator[str]:
    """Yield the names of the arrays of a variable."""
    if isinstance(value, dict) and depth < 10:
        for field, inner in value.items():
            yield from leaves(f"{name}.{field}", inner, depth + 1)
    elif isinstance(value, list) and depth < 10:
        for k, inner in enumerate(value[:10]):
            yield from leaves(f"{name}({k + 1})", inner, depth + 1)
    else:
        yield name


def _element(name: str, found: Any, place: int) -> Any:
    """Return an element of an array of structs or of cells, or the only one."""
    many = isinstance(found, list) or (isinstance(found, np.ndarray) and found.dtype == object)
    if not many and place == 1:
        return found
    if not many or place > len(found):
        raise ChannelError(f"no element ({place}) in {shown(name)}")
    return found[place - 1]


def _no_field(name: str, field: str, fields: Iterable[str]) -> ChannelError:
    return ChannelError(f"no field {shown(field)} in {shown(name)}{near(field, fields)}")


def _inside(name: str, found: Any) -> str:
    """Return a hint at the fields of a struct, or at the elements of an array of structs."""
    if isinstance(found, list):
        return f"; select an element: {name}(1)"
    return f"; select one of its fields: {', '.join(list(found)[:20])}"
