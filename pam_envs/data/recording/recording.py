"""A recording of a rig: commands and sensor readings on even steps of time.

    time_s,segment,pressure_command_bar,pressure_bar,contraction_mm,load_N
    0.00,staircase,0.0,0.004,0.01,25.0

:func:`read_input` also takes settled readings without time, see :mod:`pam_envs.data.tables`.
"""

import dataclasses
import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array, Flags, Indices
from pam_envs.constants import BAR, MM
from pam_envs.data.recording import clock as clocks
from pam_envs.data.recording.channels import (
    MUSCLE,
    WIRINGS,
    Channel,
    Wiring,
    excitation,
    wiring_of,
)
from pam_envs.data.recording.columns import (
    LONGEST_LABEL,
    RecordingError,
    Sheet,
    read_header,
    refuse,
    rows_text,
)
from pam_envs.data.recording.formats.mapped import is_log, sheet_of
from pam_envs.data.rig_file import Rig
from pam_envs.data.tables import READINGS, ContractionTable, load_readings
from pam_envs.wording import near

__all__ = [
    "Recording",
    "RecordingError",
    "Rig",
    "check_rig",
    "load_readings",
    "load_recording",
    "read_input",
    "repeat_rows",
]


COLUMNS = (
    "time_s",
    "segment",
    "pressure_command_bar",
    "pressure_bar",
    "contraction_mm",
    "load_N",
    "temperature_C",
    "supply_pressure_bar",
    "force_N",
)
REQUIRED = ("time_s", "pressure_command_bar")
FIELDS = {
    "time_s": ("time", 1.0),
    "pressure_command_bar": ("command", BAR),
    "pressure_bar": ("pressure", BAR),
    "contraction_mm": ("contraction", MM),
    "load_N": ("load", 1.0),
    "temperature_C": ("temperature", 1.0),
    "supply_pressure_bar": ("supply", BAR),
    "force_N": ("force", 1.0),
}
"""The field of :class:`Recording` that a column becomes, and the column's unit in its own."""
FORGIVEN = ("temperature_C", "supply_pressure_bar", "force_N")
"""Columns of which a few cells may be empty."""
FORGIVEN_SHARE = 0.05
MEASURED = ("pressure", "contraction", "temperature", "supply", "force")
LEAST_ROWS = 10
MOST_SEGMENTS = 1000


@dataclasses.dataclass(frozen=True)
class Recording:
    """Signals on even steps; sample k is read at ``time[k]``.

    Every array has shape (n,) and is read-only.

    Attributes
    ----------
    time : ndarray
        [s]; it starts again at a ``restart``.
    segment : ndarray of int
        Index into ``segments``.
    segments : tuple of str
        Labels, one experiment each, in the order of the recording.
    command : ndarray
        Setpoint of the pressure [Pa], in force from ``time[k]`` to ``time[k + 1]``.
    pressure, contraction : ndarray or None
        Measured gauge pressure [Pa] and contraction [m].
    load : ndarray
        External pull on the muscle [N].
    temperature, supply, force : ndarray or None
        [deg C], [Pa], [N].
    restart : ndarray of bool
        Restarts of the muscle from rest: the first sample, and each new segment whose time
        starts again.
    valve_closed : ndarray of bool
        Where the valve is shut, so that the command has no effect.
    period : float
        [s].
    source : str
        Where the recording comes from.
    digest : str
        Hash of the contents.
    filled : ndarray of bool
        Interpolated samples, where nothing was recorded between two segments under one command.
    row : ndarray of int
        Row of the file that a sample comes from (the header is row 1), for messages.
    notes : tuple of str
        Repairs made while reading.
    raw : Recording or None
        Before the averaging of a recording faster than 100 Hz.
    inputs, outputs : mapping of str to ndarray
        Channels of other plants than a single muscle, by name and in SI. ``command`` is then the
        accumulated travel of the inputs (:func:`pam_envs.data.recording.channels.excitation`).
    channels : mapping of str to Channel
        Columns and units of inputs and outputs.
    """

    time: Array
    segment: Indices
    segments: tuple[str, ...]
    command: Array
    pressure: Array | None
    contraction: Array | None
    load: Array
    temperature: Array | None
    supply: Array | None
    force: Array | None
    restart: Flags
    valve_closed: Flags
    period: float
    source: str
    digest: str
    filled: Flags
    row: Indices
    notes: tuple[str, ...] = ()
    raw: "Recording | None" = dataclasses.field(default=None, repr=False)
    inputs: Mapping[str, Array] = dataclasses.field(default_factory=dict, repr=False)
    outputs: Mapping[str, Array] = dataclasses.field(default_factory=dict, repr=False)
    channels: Mapping[str, Channel] = dataclasses.field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for values in (*self.inputs.values(), *self.outputs.values()):
            values.setflags(write=False)
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                value.setflags(write=False)

    @classmethod
    def from_arrays(
        cls,
        time: ArrayLike,
        command: ArrayLike,
        *,
        pressure: ArrayLike | None = None,
        contraction: ArrayLike | None = None,
        load: ArrayLike = 0.0,
        segment: Sequence[str] | None = None,
        temperature: ArrayLike | None = None,
        supply: ArrayLike | None = None,
        force: ArrayLike | None = None,
        valve_closed: Sequence[str] = (),
        source: str = "arrays",
    ) -> "Recording":
        """Make a recording of arrays in SI, checked as a file is.

        Parameters
        ----------
        time, command : array_like, shape (n,)
            [s], [Pa].
        pressure, contraction : array_like, shape (n,), optional
            [Pa], [m]; at least one.
        load : array_like, shape () or (n,)
            [N].
        segment : sequence of str, length n, optional
            Label of each sample; default: all belong to one segment ``"all"``.
        temperature, supply, force : array_like, shape (n,), optional
            [deg C], [Pa], [N].
        valve_closed : sequence of str
            Segments with the valve shut.
        source : str
            A name for messages, which count rows as in a file with a header.

        Raises
        ------
        RecordingError
            Naming column, rows and remedy.
        """
        given = {
            "time": time,
            "command": command,
            "pressure": pressure,
            "contraction": contraction,
            "temperature": temperature,
            "supply": supply,
            "force": force,
        }
        columns = {k: np.array(v, dtype=np.float64) for k, v in given.items() if v is not None}
        n = columns["time"].size
        columns["load"] = np.array(np.broadcast_to(np.asarray(load, np.float64), (n,)))
        labels = ["all"] * n if segment is None else [str(label) for label in segment]
        problems = [
            f"{name} has the shape {values.shape}, time has ({n},); give one value a sample"
            for name, values in columns.items()
            if values.shape != (n,)
        ]
        problems += [] if len(labels) == n else [f"{len(labels)} labels for {n} samples"]
        rows = np.arange(2, n + 2)
        problems = problems or [
            f"{name} is not finite in {rows_text(rows[~np.isfinite(values)])}; correct the values"
            for name, values in columns.items()
            if not np.isfinite(values).all()
        ]
        if pressure is None and contraction is None:
            problems.append("give at least one of pressure and contraction")
        if problems:
            refuse(source, *problems)
        return _recording(columns, labels, rows, [], tuple(valve_closed), source)

    @classmethod
    def of_channels(
        cls,
        time: ArrayLike,
        inputs: Mapping[str, ArrayLike],
        outputs: Mapping[str, ArrayLike],
        *,
        plant: str = "",
        channels: Sequence[Channel] = (),
        segment: Sequence[str] | None = None,
        valve_closed: Sequence[str] = (),
        source: str = "arrays",
    ) -> "Recording":
        """Make a recording of any plant from arrays in SI, checked as a file is.

        Parameters
        ----------
        time : array_like, shape (n,)
            [s].
        inputs, outputs : mapping of str to array_like, shape () or (n,)
            Recorded channels by name [SI].
        plant : str
            Family of the plant, which gives units and columns of the channels.
        channels : sequence of Channel, optional
            Units of the channels of a plant of your own; others are shown in SI.
        segment, valve_closed, source
            As of :meth:`from_arrays`.

        Raises
        ------
        RecordingError
            Naming channel, rows and remedy.
        """
        wiring = WIRINGS.get(plant) or Wiring((), tuple(channels))
        given = {"time": time, **inputs, **outputs}
        n = np.asarray(time).size
        columns = {
            name: np.array(np.broadcast_to(np.asarray(v, np.float64), (n,)))
            if np.ndim(v) == 0
            else np.array(v, np.float64)
            for name, v in given.items()
        }
        labels = ["all"] * n if segment is None else [str(label) for label in segment]
        rows = np.arange(2, n + 2)
        problems = [
            f"{name} has the shape {values.shape}, time has ({n},); give one value a sample"
            for name, values in columns.items()
            if values.shape != (n,)
        ]
        problems += [] if len(labels) == n else [f"{len(labels)} labels for {n} samples"]
        problems = problems or [
            f"{name} is not finite in {rows_text(rows[~np.isfinite(values)])}; correct the values"
            for name, values in columns.items()
            if not np.isfinite(values).all()
        ]
        twice = sorted(set(inputs) & set(outputs))
        problems += [f"{name} is both an input and an output; give it once" for name in twice]
        if not problems and not outputs:
            problems = ["there is no output; give at least one"]
        if plant in WIRINGS:
            known = {c.name: "input" for c in wiring.inputs}
            known |= {c.name: "output" for c in wiring.outputs}
            for kind, names in (("input", inputs), ("output", outputs)):
                problems += [
                    f"{name!r} is no {kind} of the plant {plant}"
                    + near(name, [k for k, v in known.items() if v == kind])
                    for name in names
                    if known.get(name) != kind
                ]
        if problems:
            refuse(source, *problems)
        return _of_plant(
            columns, tuple(inputs), tuple(outputs), wiring, labels, rows, [], valve_closed, source
        )

    def reading(self, channel: str) -> Any:
        """Return the readings of an output [SI], shape (n,), None if it was not recorded."""
        if self.outputs:
            return self.outputs.get(channel)
        return getattr(self, channel, None)

    def channel(self, name: str) -> Channel:
        """Return column and unit of a channel."""
        return self.channels.get(name) or MUSCLE.get(name) or Channel(name, name)

    def rows_of(self, label: str) -> Indices:
        """Return the samples of a segment at which something was recorded."""
        if label not in self.segments:
            raise ValueError(f"no segment {label!r}{near(label, self.segments)}")
        mine = (self.segment == self.segments.index(label)) & ~self.filled
        return np.flatnonzero(mine).astype(np.int64)


def load_recording(path: str | Path, rig: Rig | None = None) -> Recording:
    """Read a recording from a CSV file or a log file, put on even steps.

    Parameters
    ----------
    path : str or Path
        Columns as in ``docs/recording.md``, in any order; or a file whose channels the rig maps to
        these columns (``docs/formats.md``).
    rig : Rig, optional
        Names the segments with the valve shut, which must exist.

    Raises
    ------
    RecordingError
        With all problems, naming column, rows and remedy.
    """
    if rig is not None and rig.plant in WIRINGS:
        return _load_of_plant(path, rig)
    sheet = sheet_of(path, rig.channels if rig else {}, COLUMNS, REQUIRED, "a recording")
    if not {"pressure_bar", "contraction_mm"} & set(sheet.cells):
        text = "give at least one of the columns pressure_bar and contraction_mm"
        if "force_N" in sheet.cells:
            text += "; force_N is not supported as the only output"
        refuse(sheet.where, text)
    n = len(sheet.rows)
    labels = sheet.text("segment") if "segment" in sheet.cells else ["all"] * n
    columns, notes = _columns(sheet)
    recording = _recording(
        columns, labels, sheet.rows, notes, rig.valve_closed if rig else (), str(path)
    )
    if rig is not None:
        problems = check_rig(recording, rig)
        if problems:
            refuse(str(path), *problems)
    return recording


def read_input(path: str | Path, rig: Rig | None = None) -> Recording | ContractionTable:
    """Read a recording or a table of settled readings, according to its columns."""
    if is_log(path) or (rig is not None and rig.channels):
        return load_recording(path, rig)
    header = set(read_header(path))
    if rig is not None and rig.plant in WIRINGS:
        return load_recording(path, rig)
    if header & set(READINGS) and not header & (set(COLUMNS) - set(READINGS)):
        return load_readings(path)
    return load_recording(path, rig)


def _columns(sheet: Sheet) -> tuple[dict[str, Array], list[str]]:
    """Return the columns that are numbers, by field and in SI, and the repairs."""
    columns, notes, problems = {}, [], []
    for name in [name for name in FIELDS if name in sheet.cells]:
        values, empty, wrong = sheet.numbers(name)
        problems += wrong
        if empty.any() and not wrong:
            where = rows_text(sheet.rows[empty])
            if name in FORGIVEN and empty.mean() < FORGIVEN_SHARE:
                notes.append(f"column {name} is empty in {where}; interpolated")
                there = np.flatnonzero(~empty)
                values = np.interp(np.arange(len(values)), there, values[there])
            else:
                remedy = "fill the cells or leave the rows out"
                if name in FORGIVEN:
                    most = f"fewer than {FORGIVEN_SHARE:.0%} may be"
                    remedy = f"{most}; fill the cells or leave the column out"
                problems.append(f"column {name} is empty in {where}; {remedy}")
        field, unit = FIELDS[name]
        columns[field] = values * unit
    if problems:
        refuse(sheet.where, *problems)
    if "load" not in columns:
        columns["load"] = np.zeros(len(sheet.rows))
        notes.append("there is no column load_N; the load is taken as 0 N throughout")
    return columns, notes


def _load_of_plant(path: str | Path, rig: Rig) -> Recording:
    """Read a recording of a plant other than a single muscle."""
    known = ("time_s", "segment", *(c.column for c in WIRINGS[rig.plant].channels.values()))
    sheet = sheet_of(path, rig.channels, known, ("time_s",), "a recording")
    wiring = wiring_of(rig.plant, sheet.cells)
    fields = {c.column: c for c in (*wiring.inputs, *wiring.outputs)}
    n, problems, columns = len(sheet.rows), [], {}
    for name in ("time_s", *fields):
        if name not in sheet.cells:
            continue
        values, wrong = sheet.complete(name)
        problems += wrong
        found = fields.get(name)
        columns[found.name if found else "time"] = values * (found.scale if found else 1.0)
    commands = [c for c in wiring.inputs if c.name in wiring.measured]
    lacking = [c for c in commands if c.name not in columns]
    # without any command the measured pressures drive the plant
    pressures = [fields[c] for c in fields if fields[c].name in wiring.measured.values()]
    needed = lacking if len(lacking) < len(commands) else []
    if lacking and not needed:
        needed = [c for c in pressures if c.name not in columns]
    problems += [
        f"row 1: a recording of the plant {rig.plant} needs the column {c.column}"
        + ("" if c in lacking else ", or commands: " + ", ".join(k.column for k in commands))
        for c in needed
    ]
    inputs = tuple(c.name for c in wiring.inputs if c.name in columns)
    outputs = tuple(c.name for c in wiring.outputs if c.name in columns)
    free = set(outputs) - (set(wiring.measured.values()) if lacking else set())
    if not problems and not free:
        listed = ", ".join(c.column for c in wiring.outputs)
        problems = [f"row 1: give at least one output that is not an input: {listed}"]
    if problems:
        refuse(sheet.where, *problems)
    labels = sheet.text("segment") if "segment" in sheet.cells else ["all"] * n
    recording = _of_plant(
        columns, inputs, outputs, wiring, labels, sheet.rows, [], rig.valve_closed, str(path)
    )
    problems = check_rig(recording, rig)
    if problems:
        refuse(str(path), *problems)
    return recording


def _of_plant(
    columns: dict[str, Array],
    inputs: tuple[str, ...],
    outputs: tuple[str, ...],
    wiring: Wiring,
    labels: Sequence[str],
    rows: Indices,
    notes: list[str],
    valve_closed: Sequence[str],
    source: str,
) -> Recording:
    """Return channels by name [SI] as a recording."""
    driven = {n: columns[n] for n in inputs}
    measured = {
        o: columns[o] for i, o in wiring.measured.items() if i not in driven and o in columns
    }
    moved = excitation(driven, len(rows)) + excitation(measured, len(rows), noisy=True)
    made = {**columns, "command": moved, "load": np.zeros(len(rows))}
    return _recording(
        made, labels, rows, notes, tuple(valve_closed), source, inputs, outputs, wiring.channels
    )


def _recording(
    columns: dict[str, Array],
    labels: Sequence[str],
    rows: Indices,
    notes: list[str],
    valve_closed: tuple[str, ...],
    source: str,
    inputs: tuple[str, ...] = (),
    outputs: tuple[str, ...] = (),
    channels: Mapping[str, Channel] | None = None,
) -> Recording:
    """Return columns of a file (by field, in SI) as a recording."""
    if len(rows) < LEAST_ROWS:
        refuse(source, f"{len(rows)} rows are too few; give at least {LEAST_ROWS}")
    segments = tuple(dict.fromkeys(labels))
    if len(segments) > MOST_SEGMENTS:
        refuse(source, f"there are {len(segments)} segments; give at most {MOST_SEGMENTS}")
    if any(len(label) > LONGEST_LABEL for label in segments):
        refuse(source, f"a segment's label has more than {LONGEST_LABEL} characters; shorten it")
    index = {label: i for i, label in enumerate(segments)}
    segment = np.array([index[label] for label in labels], dtype=np.int64)
    problems = returns(segment, segments, rows)
    clock, wrong = clocks.read_clock(columns["time"], columns["command"], segment, segments, rows)
    if clock is None or problems:
        refuse(source, *problems, *wrong)
    grid = clocks.make_grid(columns["time"], clock)
    notes = notes + _mended(grid, rows) + load_changes(columns["load"], segment, segments, rows)
    shut = np.isin(segment, [index[label] for label in valve_closed if label in index])
    measured: dict[str, Any] = {
        name: grid.linear(columns[name]) if name in columns and not outputs else None
        for name in MEASURED
    }
    even = Recording(
        time=grid.time,
        segment=segment[grid.held],
        segments=segments,
        command=columns["command"][grid.held],
        load=columns["load"][grid.held],
        **measured,
        restart=grid.restart,
        valve_closed=shut[grid.held],
        period=clock.period,
        source=source,
        digest="",
        filled=grid.filled,
        row=rows[grid.left],
        notes=tuple(notes),
        inputs={name: columns[name][grid.held] for name in inputs},
        outputs={name: grid.linear(columns[name]) for name in outputs},
        channels=channels or {},
    )
    thinned = _thinned(even, clocks.block_size(clock.period))
    return dataclasses.replace(thinned, digest=_digest(thinned))


def _mended(grid: clocks.Grid, rows: Indices) -> list[str]:
    notes = []
    if grid.moved:
        notes.append("the samples are not evenly spaced; measured values were interpolated")
    if len(grid.missing):
        notes.append(f"samples are missing after {rows_text(rows[grid.missing])}; interpolated")
    starts = grid.filled & ~np.r_[False, grid.filled[:-1]]
    for row in rows[grid.left[starts]]:
        notes.append(f"nothing was recorded after row {row}; the command is taken as held")
    return notes


def _thinned(recording: Recording, size: int) -> Recording:
    """Return a recording averaged over blocks of ``size`` samples."""
    if size == 1:
        return recording
    n, starts = len(recording.time), np.flatnonzero(recording.restart)
    at = clocks.block_places(n, starts, size)
    middle = clocks.block_places(n, starts, size, (size - 1) // 2)
    means: dict[str, Any] = {
        name: None if values is None else clocks.block_means(values, starts, size)
        for name, values in ((name, getattr(recording, name)) for name in MEASURED)
    }
    names = ("time", "segment", "load", "restart", "valve_closed", "filled", "row")
    kept: dict[str, Any] = {name: getattr(recording, name)[at] for name in names}
    note = f"{1 / recording.period:g} Hz is faster than needed; every {size} samples were averaged"
    return dataclasses.replace(
        recording,
        command=recording.command[middle],
        **means,
        **kept,
        inputs={name: values[middle] for name, values in recording.inputs.items()},
        outputs={
            name: clocks.block_means(values, starts, size)
            for name, values in recording.outputs.items()
        },
        period=size * recording.period,
        notes=(*recording.notes, note),
        raw=recording,
    )


def _digest(recording: Recording) -> str:
    """Return a hash over the signals, not over where they come from."""
    made = hashlib.sha256("\0".join(recording.segments).encode())
    for field in dataclasses.fields(recording):
        value = getattr(recording, field.name)
        if isinstance(value, np.ndarray) and field.name != "row":
            made.update(field.name.encode() + np.ascontiguousarray(value).tobytes())
    for name, values in (*recording.inputs.items(), *recording.outputs.items()):
        made.update(name.encode() + np.ascontiguousarray(values).tobytes())
    return made.hexdigest()[:16]


def check_rig(recording: Recording, rig: Rig) -> list[str]:
    """Return declared properties of segments that contradict the recording, as sentences."""
    named = [label for group in rig.repeats for label in group]
    lost = [label for label in (*named, *rig.valve_closed) if label not in recording.segments]
    if lost:
        return [
            f"the rig names the segment {label!r}, which the recording lacks"
            f"{near(label, recording.segments)}"
            for label in dict.fromkeys(lost)
        ]
    problems = []
    for group in rig.repeats:
        lengths = {label: len(recording.rows_of(label)) for label in group}
        if max(lengths.values()) - min(lengths.values()) >= 3:
            listed = ", ".join(f"{label!r} has {n}" for label, n in lengths.items())
            problems.append(
                f"segments that repeat one another must be equally long: {listed} samples; cut "
                "them alike, or take them out of repeats"
            )
    return problems


def repeat_rows(recording: Recording, rig: Rig) -> list[list[Indices]]:
    """Return the samples of each group's segments, cut to equal length.

    Sample i of a segment was taken under the same command as sample i of the others.
    """
    groups = []
    for group in rig.repeats:
        rows = [recording.rows_of(label) for label in group]
        n = min(len(mine) for mine in rows)
        groups.append([mine[:n] for mine in rows])
    return groups


def returns(segment: Indices, segments: Sequence[str], rows: Indices) -> list[str]:
    """Return the segments that appear in several places, as sentences."""
    first = np.flatnonzero(np.r_[True, np.diff(segment) != 0])
    again = [i for i in first if np.any(segment[:i] == segment[i])]
    labels = list(dict.fromkeys(segments[segment[i]] for i in again))
    return [
        f"segment {label!r} starts again in "
        f"{rows_text(rows[i] for i in again if segments[segment[i]] == label)}; give each stretch "
        f"a label of its own, for example {label + '_2'!r}"
        for label in labels
    ]


def load_changes(
    load: Array, segment: Indices, segments: Sequence[str], rows: Indices
) -> list[str]:
    """Return where the load changes inside a segment, as sentences."""
    changed = (np.diff(load) != 0.0) & (np.diff(segment) == 0)
    if not changed.any():
        return []
    at = np.flatnonzero(changed) + 1
    names = ", ".join(repr(segments[i]) for i in dict.fromkeys(segment[at].tolist()))
    return [
        f"the load changes inside segment {names} at {rows_text(rows[at])}; if load_N is the "
        "reading of a load cell, call the column force_N and give the hanging load as load_N"
    ]
