"""Clock of a recording: gaps and jitter, and resampling to even steps."""

import dataclasses
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from pam_envs.arrays import Array, Flags, Indices
from pam_envs.data.recording.columns import rows_text

SLOWEST = 0.2
"""Longest period [s] at which the motion of a muscle is still seen."""
FASTEST = 0.01
"""Shortest period [s] that is worth replaying; faster recordings are averaged to it or above."""
FINEST = 1e-4
"""Shortest period [s] of a recording."""
MOST_STEPS = 3_000_000
"""Largest number of even steps of a recording."""
GAP = 3.0
"""Periods without a sample that make a gap."""
LONGEST_GAP = 600.0
"""Longest time [s] between two segments over which a command can be taken as held."""
HELD = 500.0
"""Commands [Pa] closer than this are the same."""
ON_GRID = 0.1
"""Periods by which a sample may miss an even step and still be taken as on it."""


@dataclasses.dataclass(frozen=True)
class Clock:
    """Mean period [s] of the samples.

    ``restart`` marks rows, shape (n,), at which the muscle restarts from rest, ``gap`` those
    after which nothing was recorded for a while, with the command held.
    """

    period: float
    restart: Flags
    gap: Flags


def runs_of(restart: Flags) -> list[slice]:
    """Return the samples of each run between restarts (T,), of which the first one is True."""
    starts = np.flatnonzero(restart).tolist()
    return [slice(a, b) for a, b in pairwise([*starts, len(restart)])]


def read_clock(
    time: Array, command: Array, segment: Indices, segments: Sequence[str], rows: Indices
) -> tuple[Clock | None, list[str]]:
    """Check time [s] and command [Pa] of a recording; return its clock, or None and the problems.

    All arrays have the shape (n,): ``segment`` is an index into the labels ``segments``, ``rows``
    are those of the file. A problem is a sentence with rows and remedy.
    """
    step = np.diff(time)
    new = np.diff(segment) != 0
    restart = np.r_[True, new & (step < 0.0)]
    stuck = (step <= 0.0) & ~restart[1:]
    if stuck.any():
        at = np.flatnonzero(stuck)
        return None, [
            f"time_s does not increase inside a segment at {rows_text(rows[at + 1])} (the first "
            f"from {time[at[0]]:g} s to {time[at[0] + 1]:g} s); sort the rows, or give rows that "
            "start from rest with their own clock a new segment"
        ]
    inside = step[~new]
    if not len(inside):
        return None, ["no segment has two rows; give the samples of one experiment one label"]
    period = _period(time, inside, restart)
    problems = _pace(period) or _length(time, restart, period)
    if problems:
        return None, problems
    problems = _paces(step, new, segment, segments, period)
    gap = np.r_[(step > GAP * period) & ~restart[1:], False]
    problems += _gaps(time, command, gap, np.r_[new, False], segment, segments, rows, period)
    return (None if problems else Clock(period, restart, gap)), problems


def _period(time: Array, inside: Array, restart: Flags) -> float:
    """Return the mean step: the slope of time over the count of steps, lost ones included.

    The median alone would be 17 ms for samples at 60 Hz whose times are rounded to milliseconds.
    """
    usual = float(inside[inside < 1.5 * np.median(inside)].mean())
    counts = np.round(np.diff(time) / usual)
    whole = (counts <= GAP) & ~restart[1:]
    stretch = np.r_[0, np.cumsum(~whole)]
    places = np.r_[0.0, np.cumsum(np.where(whole, counts, 0.0))]
    size = np.bincount(stretch)
    x = places - (np.bincount(stretch, places) / size)[stretch]
    y = time - (np.bincount(stretch, time) / size)[stretch]
    return float(np.round(np.sum(x * y) / np.sum(x * x), 9))


def _pace(period: float) -> list[str]:
    if not period >= FINEST:
        return [
            f"one sample every {period:g} s is faster than {1 / FINEST:,.0f} Hz; average the "
            "samples to 100 to 1000 Hz"
        ]
    if period <= SLOWEST * (1.0 + 1e-6):
        return []
    sentence = (
        f"one sample every {period:g} s does not show how the muscle moves; sample at 20 to 100 Hz "
        f"(at least {1 / SLOWEST:g} Hz), or give settled readings as a quasi-static table "
        "(load_kg, pressure_bar, direction, repeat, contraction_mm)"
    )
    if 1.0 <= period <= 200.0:
        sentence += ". Steps like these are often milliseconds: then divide time_s by 1000"
    return [sentence]


def _length(time: Array, restart: Flags, period: float) -> list[str]:
    starts = np.flatnonzero(restart)
    steps = float(np.sum(time[np.r_[starts[1:] - 1, len(time) - 1]] - time[starts])) / period
    if steps <= MOST_STEPS:
        return []
    return [
        f"the rows span {steps:,.0f} periods of {period:g} s, and at most {MOST_STEPS:,} are read; "
        "average the samples to 100 Hz, or split the recording"
    ]


def _paces(
    step: Array, new: Flags, segment: Indices, segments: Sequence[str], period: float
) -> list[str]:
    """Return the problems with segments sampled at different rates."""
    for i, label in enumerate(segments):
        mine = step[~new & (segment[1:] == i)]
        if len(mine) and abs(np.median(mine) / period - 1.0) > 0.2:
            return [
                f"segment {label!r} is sampled every {np.median(mine):g} s, the recording on "
                f"average every {period:g} s; record all segments at one rate"
            ]
    return []


def _gaps(
    time: Array,
    command: Array,
    gap: Flags,
    new: Flags,
    segment: Indices,
    segments: Sequence[str],
    rows: Indices,
    period: float,
) -> list[str]:
    problems = []
    inside = np.flatnonzero(gap & ~new)
    for i in inside[:5]:
        lost = time[i + 1] - time[i]
        problems.append(
            f"nothing was recorded for {lost:g} s ({lost / period:.0f} periods) between rows "
            f"{rows[i]} and {rows[i + 1]}, inside segment {segments[segment[i]]!r}; give the "
            "rows after it a label and, if they start from rest, their own clock, or leave them out"
        )
    if len(inside) > 5:
        problems.append(f"there are {len(inside) - 5} more gaps inside segments")
    for i in np.flatnonzero(gap & new):
        lost = time[i + 1] - time[i]
        between = f"the {lost:g} s between rows {rows[i]} and {rows[i + 1]}, before segment "
        between += repr(segments[segment[i + 1]])
        if abs(command[i + 1] - command[i]) > HELD:
            problems.append(
                f"the command changes in {between}, from {command[i] / 1e5:g} to "
                f"{command[i + 1] / 1e5:g} bar, and nothing was recorded; record without a break, "
                "or let the segment start from rest with time_s at 0"
            )
        elif lost > LONGEST_GAP:
            problems.append(
                f"nothing was recorded in {between}: more than {LONGEST_GAP:g} s; let the segment "
                "start from rest with time_s at 0"
            )
    return problems


@dataclasses.dataclass(frozen=True)
class Grid:
    """Even steps of time [s], shape (m,), and the rows that each is made of.

    ``held`` is the row whose command, label and load are in force, ``left`` and ``right`` are those
    on both sides and ``share`` is the weight of the right one. ``filled`` are steps inside a gap,
    ``missing`` rows after which single samples were missing; values were interpolated if samples
    ``moved``.
    """

    time: Array
    held: Indices
    left: Indices
    right: Indices
    share: Array
    restart: Flags
    filled: Flags
    missing: Indices
    moved: bool

    def linear(self, values: Array) -> Array:
        """Return a measured column on the even steps."""
        there = values[self.left]
        return np.where(self.share > 0.0, there + self.share * (values[self.right] - there), there)


def make_grid(time: Array, clock: Clock) -> Grid:
    """Put the rows of a recording on even steps.

    A run (from one start at rest to the next) whose samples all lie near even steps keeps its
    values; otherwise measured values are interpolated. A held value changes at the nearest step, so
    that on average it is neither early nor late.
    """
    starts = np.flatnonzero(clock.restart).tolist()
    ends = [*starts[1:], len(time)]
    runs = [_run(time, clock, a, b) for a, b in zip(starts, ends, strict=True)]
    fields = [field.name for field in dataclasses.fields(Grid) if field.name != "moved"]
    joined = {name: np.concatenate([getattr(run, name) for run in runs]) for name in fields}
    return Grid(**joined, moved=any(run.moved for run in runs))


def _run(time: Array, clock: Clock, start: int, end: int) -> Grid:
    place = (time[start:end] - time[start]) / clock.period
    near = np.round(place)
    moved = bool(np.any(np.abs(place - near) > ON_GRID) or np.any(np.diff(near) < 1.0))
    if not moved:
        place = near
    steps = np.arange(int(np.floor(place[-1] + 1e-6)) + 1, dtype=np.float64)
    left = np.searchsorted(place, steps + 1e-9, side="right") - 1
    right = np.minimum(left + 1, len(place) - 1)
    width = np.where(right > left, place[right] - place[left], 1.0)
    share = (steps - place[left]) / width
    held = np.searchsorted(place, steps + 0.5, side="left") - 1
    held = np.where(held < left, left, held)
    lost = np.r_[np.diff(place) > 1.5, False] & ~clock.gap[start:end]
    return Grid(
        time=time[start] + clock.period * steps,
        held=start + held,
        left=start + left,
        right=start + right,
        share=np.where(share < 1e-9, 0.0, share),
        restart=steps == 0.0,
        filled=clock.gap[start:end][left] & (steps > place[left] + 0.5),
        missing=start + np.flatnonzero(lost),
        moved=moved,
    )


def block_size(period: float) -> int:
    """Return how many samples make one of 50 to 100 Hz; 1 for a recording that is not faster."""
    return max(1, int(np.ceil(FASTEST / period * (1.0 - 1e-3))))


def block_means(values: Array, starts: Indices, size: int) -> Array:
    """Return means of values (n,) over blocks centred on every ``size``-th sample of each run.

    ``starts`` are the first samples of the runs.
    """
    weights = np.ones(size) if size % 2 else np.r_[0.5, np.ones(size - 1), 0.5]
    pieces = []
    for run in np.split(values, starts[1:]):
        total = np.convolve(run, weights)[len(weights) // 2 :][: len(run)]
        count = np.convolve(np.ones(len(run)), weights)[len(weights) // 2 :][: len(run)]
        pieces.append((total / count)[::size])
    return np.concatenate(pieces)


def block_places(n: int, starts: Indices, size: int, offset: int = 0) -> Indices:
    """Return the samples of the blocks of :func:`block_means`, or those ``offset`` after them."""
    ends = np.r_[starts[1:], n]
    return np.concatenate(
        [
            np.minimum(np.arange(a, b, size) + offset, b - 1)
            for a, b in zip(starts, ends, strict=True)
        ]
    )
