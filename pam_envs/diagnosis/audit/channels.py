"""Checks of a measured channel: stuck, clipped, coarse, with spikes or copied stretches.

Each check returns sentences with rows of the file.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from pam_envs.arrays import Array, Flags
from pam_envs.data.recording.channels import Channel
from pam_envs.data.recording.columns import rows_text, span_text
from pam_envs.data.recording.recording import Recording
from pam_envs.diagnosis.audit.noise import half_width, resolution

STILL_SECONDS = 2.0
ANSWER_SECONDS = 1.0  # time in which a reading may lag behind the command [s]
STILL_COMMAND = 0.5e5  # change of the command [Pa] above which a constant reading may be stuck
TURNING = 1.5e5
"""Reversal of the command [Pa] below which a contraction may be constant due to friction."""
CLIPPED_ROWS = 20
SPIKE = 10.0
COPIED_ROWS = 50
COPIED_CHANGES = 0.5  # least share of samples of a copied stretch that differ from the previous one
COARSE = 2.0  # ratio of resolution to RMS noise above which rounding hides the noise


def _display(recording: Recording, channel: str) -> tuple[str, str, float]:
    """Return column and unit of a channel, and the unit in SI."""
    found: Channel = recording.channel(channel)
    return found.column, found.unit, found.scale


def runs(same: Flags) -> Iterator[tuple[int, int]]:
    """Yield first and last sample of runs of equal samples; ``same[i]`` compares i and i + 1."""
    edges = np.diff(np.r_[False, same, False].astype(np.int8))
    for first, last in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        yield int(first), int(last)


def stuck(recording: Recording, channel: str) -> tuple[list[str], list[str]]:
    """Return problems and warnings on readings that are constant while the command changes.

    A muscle may be at rest below its threshold and at reversals of the pressure; for a sensor at
    the end of its range see :func:`clipped`.
    """
    column, unit, scale = _display(recording, channel)
    values = recording.reading(channel)
    free = ~recording.valve_closed & ~recording.filled
    same = (np.diff(values) == 0.0) & free[1:] & free[:-1] & ~recording.restart[1:]
    wait = round(ANSWER_SECONDS / recording.period)
    problems, warnings = [], []
    for first, last in runs(same):
        if (last - first) * recording.period <= STILL_SECONDS:
            continue
        moved = np.ptp(recording.command[first : last + 1 - wait])
        if moved <= STILL_COMMAND:
            continue
        text = (
            f"{column} is constant at {values[first] / scale:.6g} {unit} in "
            f"{span_text(recording.row[first], recording.row[last])} while the command moves by "
            f"{moved / 1e5:.2g} bar"
        )
        turning = not channel.startswith("pressure") and moved <= TURNING
        if turning or _at_its_end(values, recording.command, first, last + 1 - wait):
            warnings.append(f"{text}: friction, a threshold or the end of its range holds it")
        else:
            problems.append(f"{text}: the sensor was stuck; leave the rows out or record again")
    return _first(problems), _first(warnings)


def _at_its_end(values: Array, command: Array, first: int, end: int) -> bool:
    """Return whether readings are at an end of their range with the command on the same side."""
    usual = np.median(np.r_[command[:first], command[end:]]) if end - first < len(values) else 0.0
    lowest, highest = values.min(), values.max()
    below = values[first] == lowest < highest and command[first:end].max() <= usual
    return bool(below or (values[first] == highest > lowest and command[first:end].min() >= usual))


def clipped(recording: Recording, channel: str) -> list[str]:
    """Return warnings on readings cut off at the top or bottom of a sensor's range."""
    column, unit, scale = _display(recording, channel)
    values = recording.reading(channel)
    if np.ptp(values) == 0.0:
        return []
    same = (np.diff(values) == 0.0) & ~recording.restart[1:] & ~recording.filled[1:]
    found = list(runs(same))
    warnings = []
    for extreme, end in ((values.max(), "upper"), (values.min(), "lower")):
        at = [(a, b) for a, b in found if values[a] == extreme]
        inner = max((b - a for a, b in found if values.min() < values[a] < values.max()), default=0)
        longest = max(at, key=lambda ab: ab[1] - ab[0], default=(0, -1))
        length = longest[1] - longest[0] + 1
        # readings coarser than their noise are constant anywhere, clipped ones only at the end
        if length >= CLIPPED_ROWS and length > 3 * (inner + 1):
            rows = int(np.sum(values == extreme))
            warnings.append(
                f"{column} reads exactly {extreme / scale:.6g} {unit} in {rows} rows, without a "
                f"break in {span_text(recording.row[longest[0]], recording.row[longest[1]])}: the "
                f"sensor is cut off at the {end} end of its range; widen the range"
            )
    return warnings


def coarse(recording: Recording, channel: str, noise: float) -> list[str]:
    """Return a warning if the resolution of the readings hides the noise (RMS, SI)."""
    column, unit, scale = _display(recording, channel)
    step = resolution(recording.reading(channel))
    if step <= COARSE * noise or step == 0.0:
        return []
    return [
        f"{column} is recorded in steps of {step / scale:.3g} {unit}, coarser than its noise of "
        f"{noise / scale:.3g} {unit}; effects below a step cannot be seen: record more digits"
    ]


def spikes(recording: Recording, channel: str) -> list[str]:
    """Return a warning on single readings far from neighbours that agree with one another."""
    column, _, _ = _display(recording, channel)
    values = recording.reading(channel)
    if len(values) < 7:
        return []
    here = values[2:-2]
    off = here - 0.5 * (values[1:-3] + values[3:-1])
    floor = max(0.5 * resolution(values), 1e-4 * np.ptp(values))  # where there is no noise
    limit = SPIKE * max(half_width(off), floor)
    size = np.abs(off)
    apart = np.abs(values[3:-1] - values[1:-3])
    before = np.abs(values[1:-3] - values[:-4])
    after = np.abs(values[4:] - values[3:-1])
    lone = (size > limit) & (np.maximum(np.maximum(before, after), apart) < 0.4 * size)
    at = np.flatnonzero(lone) + 2
    at = at[~recording.restart[np.minimum(at + 1, len(values) - 1)] & ~recording.restart[at]]
    if not len(at):
        return []
    return [
        f"{column} jumps for a single sample by more than {SPIKE:g} times its scatter in "
        f"{rows_text(recording.row[at])}; correct these readings"
    ]


def copies(recording: Recording, noise: Mapping[str, float]) -> list[str]:
    """Return a warning if a stretch of readings occurs twice: a copy, not a measurement."""
    fine = [
        values
        for values, rms in ((recording.reading(name), rms) for name, rms in noise.items())
        if resolution(values) <= COARSE * rms
    ]
    if not fine:
        return []
    columns = np.column_stack(fine)
    changes = np.r_[True, np.any(np.diff(columns, axis=0) != 0.0, axis=1)]
    best = (0, 0, 0)
    for lag in _lags(columns, changes):
        same = np.all(columns[lag:] == columns[:-lag], axis=1)
        for a, b in runs(same[1:] & same[:-1]):
            length = b - a + 1
            if length >= COPIED_ROWS and changes[a : b + 1].mean() >= COPIED_CHANGES:
                best = max(best, (length, -a, lag))
    length, first, lag = best[0], -best[1], best[2]
    if not length:
        return []
    row = recording.row
    one = span_text(row[first], row[first + length - 1])
    two = span_text(row[first + lag], row[first + lag + length - 1])
    return [
        f"the readings of {one} occur again in {two}, digit by digit: noise never repeats, so one "
        "of them is a copy (or there is no noise, as in a simulation); remove it, or the noise is "
        "underestimated"
    ]


def _lags(columns: Array, changes: Flags, size: int = COPIED_ROWS // 2) -> list[int]:
    """Return distances at which stretches of ``size`` samples recur.

    A copied stretch of twice that length contains one of the stretches that start at multiples of
    ``size``, whose hashes are searched among those of all stretches.
    """
    n = len(columns)
    if n < 2 * size:
        return []
    bits = (columns + 0.0).view(np.uint64)
    factors = np.random.default_rng(0).integers(1, 2**63, (size, columns.shape[1]), np.uint64) | 1
    codes = np.zeros(n - size + 1, np.uint64)
    for i in range(size):
        for j in range(columns.shape[1]):
            piece = bits[i : n - size + 1 + i, j]
            codes += (piece ^ (piece >> np.uint64(29))) * factors[i, j]
    moving = np.convolve(changes, np.ones(size, int), "valid") >= COPIED_CHANGES * size
    order = np.argsort(codes, kind="stable")
    low = np.searchsorted(codes[order], codes[::size], "left")
    high = np.searchsorted(codes[order], codes[::size], "right")
    lags: dict[int, int] = {}
    for start, a, b in zip(range(0, n - size + 1, size), low, high, strict=True):
        if b - a < 2 or not moving[start]:
            continue
        for other in order[a : min(b, a + 8)].tolist():
            if other != start:
                lag = abs(other - start)
                lags[lag] = lags.get(lag, 0) + 1
    return sorted(lags, key=lambda lag: -lags[lag])[:20]


def _first(sentences: list[str], shown: int = 3) -> list[str]:
    """Return the first sentences and the number of further ones."""
    if len(sentences) <= shown:
        return sentences
    return [*sentences[:shown], f"and {len(sentences) - shown} more stretches like these"]
