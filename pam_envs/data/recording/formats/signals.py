"""Channels of a log file: interface of all readers, limits and errors."""

import dataclasses
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array
from pam_envs.data.recording.columns import RecordingError, refuse
from pam_envs.wording import near, printable, shown

MOST_BYTES = 1_000_000_000
MOST_SAMPLES = 5_000_000
"""Largest number of values of a channel, all columns of its array together."""
MOST_NAMES = 5000
"""Largest number of channels that are listed."""
LISTED = 20
"""Largest number of channels that a message lists."""
LONGEST_CAUSE = 300
EXTRA = "formats"


class ChannelError(ValueError):
    """A channel that is missing or holds no readings."""


@dataclasses.dataclass(frozen=True)
class Signal:
    """Readings of a channel.

    Attributes
    ----------
    values : ndarray, shape (n,)
        Readings [unit of the file], or words.
    unit : str
        Unit that the file states; empty without one.
    time : ndarray of float or None, shape (n,)
        Clock of the channel [s], if it has its own.
    """

    values: NDArray[Any]
    unit: str = ""
    time: Array | None = None


class Log(Protocol):
    """An open log file."""

    def names(self) -> Iterable[str]:
        """Return the names of the channels."""

    def read(self, name: str) -> Signal:
        """Return a channel; ChannelError if there is none, or if it holds no readings."""


def check_size(path: Path) -> None:
    """Refuse a file, or a folder of files, that is too large; RecordingError."""
    try:
        files = [path] if path.is_file() else [p for p in path.iterdir() if p.is_file()]
        size = sum(file.stat().st_size for file in files)
    except OSError as error:
        refuse(str(path), f"cannot be read: {error.strerror or error}")
    if not size:
        refuse(str(path), "is empty; record again")
    if size > MOST_BYTES:
        refuse(
            str(path),
            f"has {size:,} bytes, more than {MOST_BYTES:,}; leave channels out, or split it",
        )


def check_count(name: str, count: int) -> None:
    """Refuse a channel with too many values; ChannelError."""
    if count > MOST_SAMPLES:
        raise ChannelError(
            f"channel {shown(name)} has {count:,} values, more than {MOST_SAMPLES:,}; average it "
            "to 100 to 1000 Hz, or split it"
        )


def column(name: str, values: Any, index: int | None, row: str) -> NDArray[Any]:
    """Return a one-dimensional array of numbers or words; ``index`` selects a column of a matrix.

    ``row`` is the syntax of that selection, for messages.
    """
    found = np.asarray(values)
    if found.ndim > 1 and index is None and max(found.shape, default=0) == found.size:
        found = found.ravel()
    if index is not None and found.ndim == 1:
        found = found[:, None]
    if index is not None and found.ndim == 2:
        if not 0 <= index < found.shape[1]:
            raise ChannelError(f"channel {shown(name)} has {found.shape[1]} columns")
        found = found[:, index]
    if found.ndim != 1:
        size = " x ".join(map(str, found.shape)) or "one value"
        raise ChannelError(f"channel {shown(name)} is of size {size}; select a column: {row}")
    if found.dtype.kind not in "bifuUSM":
        raise ChannelError(f"channel {shown(name)} holds no numbers ({found.dtype})")
    if found.dtype.kind == "M":
        seconds = (found - found[:1]) / np.timedelta64(1, "ns") * 1e-9
        return np.asarray(seconds, np.float64)
    if found.dtype.kind in "US":
        return np.asarray(found.astype(str))
    return np.asarray(found, np.float64)


def unknown(name: str, names: Iterable[str]) -> ChannelError:
    """Return the error on a channel that is not in the file, with the nearest or the first ones."""
    return ChannelError(f"no channel {shown(name)}{near(name, names, listing(names))}")


def listing(names: Iterable[str]) -> str:
    """Return "; the file holds a, b, c", with the first of many channels."""
    found = list(names)
    more = f" and {len(found) - LISTED:,} more" if len(found) > LISTED else ""
    shown_names = ", ".join(shown(name) for name in found[:LISTED])
    return f"; the file holds {shown_names}{more}" if found else "; the file holds no channel"


@contextmanager
def failures_named(where: str, kind: str) -> Iterator[None]:
    """Turn every failure of a library on a broken file into a :class:`RecordingError`."""
    try:
        yield
    except (RecordingError, ChannelError):
        raise
    except Exception as error:  # each library has errors of its own on broken files
        cause = printable(f"{type(error).__name__}: {error}")[:LONGEST_CAUSE]
        refuse(where, f"is not a readable {kind} file ({cause}); save it again")


def missing_package(where: str, kind: str, package: str) -> RecordingError:
    """Return the error on a format whose library is not installed."""
    return RecordingError(
        where,
        [f'{kind} needs the package {package}: pip install "pam-envs[{EXTRA}]"'],
    )
