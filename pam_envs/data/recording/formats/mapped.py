"""Sheet of a log file: channels by the mapping of RIG.yaml, in the columns' units, on one clock."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array
from pam_envs.data.channel_sources import ChannelSource
from pam_envs.data.recording.clock import GAP
from pam_envs.data.recording.columns import Sheet, column_hint, read_sheet, refuse
from pam_envs.data.recording.formats.hdf5 import open_hdf5
from pam_envs.data.recording.formats.matlab import open_matlab
from pam_envs.data.recording.formats.ros2 import open_bag
from pam_envs.data.recording.formats.signals import (
    MOST_NAMES,
    ChannelError,
    Log,
    Signal,
    check_size,
    listing,
)
from pam_envs.data.recording.formats.table import open_table
from pam_envs.data.recording.formats.tdms import open_tdms
from pam_envs.data.recording.formats.units import conversion, known, unit_of
from pam_envs.wording import shown

OPENERS: dict[str, Callable[[Path], AbstractContextManager[Log]]] = {
    ".mat": open_matlab,
    ".h5": open_hdf5,
    ".hdf5": open_hdf5,
    ".tdms": open_tdms,
    ".mcap": open_bag,
    ".db3": open_bag,
    ".csv": open_table,
    ".gz": open_table,
}
"""Readers by the suffix of a file; a folder is a bag of ROS 2."""
TIME = "time_s"
HELD = ("segment", "load_N", "payload_kg")
"""Columns that hold their value between two samples, as all commands do."""
LABELS = "segment"


def is_log(path: str | Path) -> bool:
    """Return whether a file has a format other than CSV."""
    where = Path(path)
    opener = OPENERS.get(where.suffix.lower())
    return where.is_dir() or opener not in (None, open_table)


def sheet_of(
    path: str | Path,
    sources: Mapping[str, ChannelSource],
    columns: Sequence[str],
    required: Sequence[str],
    what: str,
) -> Sheet:
    """Read the columns of a file: those of a CSV file itself, or those mapped by ``sources``.

    Raises
    ------
    RecordingError
        As :func:`read_mapped` and :func:`pam_envs.data.recording.columns.read_sheet`.
    """
    if sources or is_log(path):
        return read_mapped(path, sources, columns, required, what)
    return read_sheet(path, columns, required, what)


def read_mapped(
    path: str | Path,
    channels: Mapping[str, ChannelSource],
    columns: Sequence[str],
    required: Sequence[str],
    what: str,
) -> Sheet:
    """Read the mapped channels of a log file.

    ``columns`` are the known columns of ``what`` is read ("a recording"), ``required`` those that
    must be mapped; the time may be the clock of a channel. Row k of the sheet is sample k - 1 of
    the clock.

    Raises
    ------
    RecordingError
        With all problems, naming channel and remedy.
    """
    where = Path(path)
    check_size(where)
    opener = open_bag if where.is_dir() else OPENERS.get(where.suffix.lower())
    if opener is None:
        refuse(str(path), f"unknown format {where.suffix!r}; known: {', '.join(OPENERS)}")
    with opener(where) as log:
        if not channels:
            names = listing(name for name, _ in zip(log.names(), range(MOST_NAMES), strict=False))
            refuse(str(path), f"RIG.yaml has no channels: map columns to channels of it{names}")
        problems = [
            f"channels.{name}: unknown column{column_hint(name, columns)}"
            for name in channels
            if name not in columns
        ]
        signals: dict[str, Signal] = {}
        for name in () if problems else channels:
            try:
                signals[name] = _signal(log, name, channels[name])
            except ChannelError as error:
                problems.append(f"channels.{name}: {error}")
        # checked only here, since a missing column is most often a misspelt one
        missing = [] if problems else [n for n in required if n not in channels and n != TIME]
        problems += [f"{what} needs the column {n}; map it under channels" for n in missing]
        if problems:
            refuse(str(path), *problems)
        constants = {n: signals.pop(n) for n in [*signals] if not channels[n].source}
        try:
            cells = on_one_clock(signals) if TIME in columns else in_rows(signals)
        except ChannelError as error:
            refuse(str(path), str(error))
    n = len(next(iter(cells.values())))
    cells |= {name: np.full(n, signal.values[0]) for name, signal in constants.items()}
    return Sheet(str(path), cells, np.arange(2, n + 2, dtype=np.int64))


def _signal(log: Log, name: str, channel: ChannelSource) -> Signal:
    """Return the readings of a column in its unit."""
    found = log.read(channel.source) if channel.source else Signal(np.array([channel.value]))
    if not len(found.values):
        raise ChannelError(f"channel {shown(channel.source)} is empty")
    if name == LABELS:
        return found
    if found.values.dtype.kind == "U":
        raise ChannelError(f"channel {shown(channel.source)} holds words, not numbers")
    factor, shift = converted(name, channel, found.unit)
    readings = channel.scale * found.values + channel.offset
    return Signal(factor * readings + shift, "", found.time)


def converted(name: str, channel: ChannelSource, stated: str) -> tuple[float, float]:
    """Return factor and shift from readings to the unit of a column.

    The unit is that of RIG.yaml, that which the file states, or that of the column. A unit of the
    file for numbers that are scaled is that of the sensor, and not used.
    """
    own = name.rpartition("_")[2]
    target, there = unit_of(own), unit_of(stated)
    if target is None:
        return 1.0, 0.0
    if not channel.unit:
        if channel.scaled or not stated:
            return 1.0, 0.0
        if there is None or there.quantity != target.quantity:
            raise ChannelError(
                f"the file states the unit {shown(stated)} for {shown(channel.source)}, which is "
                f"no {target.quantity}; give its unit: {known(target.quantity)}"
            )
        return conversion(there, target)
    given = unit_of(channel.unit)
    if given is None or given.quantity != target.quantity:
        raise ChannelError(
            f"unit {shown(channel.unit)} is no {target.quantity}; give one of "
            f"{known(target.quantity)}, or scale and offset to {own}"
        )
    other = there is not None and there.quantity == given.quantity and there != given
    if other and not channel.scaled:
        raise ChannelError(
            f"the file states the unit {shown(stated)} for {shown(channel.source)}, RIG.yaml "
            f"{shown(channel.unit)}; correct it, or leave unit out"
        )
    return conversion(given, target)


def in_rows(signals: Mapping[str, Signal]) -> dict[str, NDArray[Any]]:
    """Return the columns of a table without time, which need equally many values."""
    if not signals:
        raise ChannelError("every column is a constant; map a measured column")
    first = next(iter(signals))
    for name, signal in signals.items():
        if len(signal.values) != len(signals[first].values):
            raise ChannelError(
                f"{name} has {len(signal.values)} values, {first} has "
                f"{len(signals[first].values)}; map channels of the same rows"
            )
    return {name: signal.values for name, signal in signals.items()}


def on_one_clock(signals: Mapping[str, Signal]) -> dict[str, NDArray[Any]]:
    """Return the time [s] and all columns on it.

    The clock is a mapped time, for columns with as many values; otherwise that of the first column
    with a clock of its own, from the time at which every column has a value. Measured columns are
    interpolated, but not over gaps (NaN); commands, labels and loads hold their value.
    """
    if TIME in signals:
        time = signals[TIME].values
        for name, signal in signals.items():
            if len(signal.values) != len(time):
                raise ChannelError(
                    f"{name} has {len(signal.values)} values, {TIME} has {len(time)}; map channels "
                    "of one clock, or leave time_s out if each channel has a clock of its own"
                )
        return {name: signal.values for name, signal in signals.items()}
    for name, signal in signals.items():
        if signal.time is None:
            raise ChannelError(f"{name} has no clock of its own; map {TIME} to a channel")
        if np.any(np.diff(signal.time) < 0.0) or not np.isfinite(signal.time).all():
            raise ChannelError(f"the clock of {name} runs backwards; map {TIME} to a channel")
    if not signals:
        raise ChannelError(f"every column is a constant; map {TIME} and a measured column")
    clocks: dict[str, Array] = {name: _clock(signal) for name, signal in signals.items()}
    base = next(iter(clocks.values()))
    start = max(clock[0] for clock in clocks.values())
    end = min(base[-1], *(clock[-1] for n, clock in clocks.items() if not held(n)))
    time = base[(base >= start) & (base <= end)]
    if not len(time):
        spans = ", ".join(f"{n} from {c[0]:.6g} to {c[-1]:.6g} s" for n, c in clocks.items())
        raise ChannelError(f"the clocks of the channels do not overlap ({spans}); record together")
    made = {name: _resampled(name, s.values, clocks[name], time) for name, s in signals.items()}
    return {TIME: time - time[0], **made}


def held(name: str) -> bool:
    """Return whether a column holds its value between two samples."""
    return name in HELD or "command" in name


def _clock(signal: Signal) -> Array:
    assert signal.time is not None
    return signal.time


def _resampled(name: str, values: NDArray[Any], clock: Array, time: Array) -> NDArray[Any]:
    """Return values of a column on another clock."""
    left = np.clip(np.searchsorted(clock, time, side="right") - 1, 0, len(clock) - 1)
    if held(name) or values.dtype.kind == "U":
        return values[left]
    right = np.minimum(left + 1, len(clock) - 1)
    width = clock[right] - clock[left]
    usual = float(np.median(np.diff(clock))) if len(clock) > 1 else np.inf
    lost = (width > GAP * usual) & (time > clock[left])
    return np.where(lost, np.nan, np.interp(time, clock, values))
