"""Noise floor: scatter of a sensor's readings with everything else constant.

Three estimates, best first: differences between segments that repeat one another; the residual of a
straight line at the end of each hold; and the white part alone, from second differences while the
command is constant. A declared noise is compared with them. Repeats that differ by more than noise
are not used: the change between them is for the diagnosis to explain.
"""

import dataclasses
from collections.abc import Iterator, Mapping

import numpy as np
from scipy.linalg import toeplitz
from scipy.optimize import nnls

from pam_envs.arrays import Array, Indices
from pam_envs.data.recording.channels import Channel
from pam_envs.data.recording.recording import Recording, repeat_rows
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.audit.repeats import DISAGREE, Source, Trust, best, detrended

PAIR = ("contraction", "pressure")
"""Measured outputs of a single muscle."""
SETTLING = 1.5  # time after a change of the command that is not used [s]
SHORTEST, LONGEST = 1.0, 10.0  # used end of a hold [s]
WINDOWS = (1.0, 1.5, 2.5, 5.0, 10.0)  # lengths of the windows at the ends of holds [s]
CORRELATIONS = (0.1, 0.2, 0.4, 0.7, 1.2, 2.0)  # candidate correlation times of coloured noise [s]
TOLERANCE = 1.1  # misfit over the smallest one up to which a correlation time is used
SAME = 10.0  # largest difference of commands of one hold [Pa]
START = 2.0  # time at the start of a repeat that previous motion may influence [s]


@dataclasses.dataclass(frozen=True)
class ChannelFloor:
    """Noise of one channel."""

    value: float  # RMS noise of a sample [m] or [Pa]
    reading: float  # RMS noise of a single reading, above value if readings were averaged
    source: Source
    estimates: Mapping[str, float]  # by source
    declared: float | None
    warnings: tuple[str, ...] = ()


@dataclasses.dataclass(frozen=True)
class Floor:
    """Noise of the recorded channels."""

    channels: Mapping[str, ChannelFloor]

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings of all channels."""
        return tuple(text for floor in self.channels.values() for text in floor.warnings)

    def __getitem__(self, channel: str) -> ChannelFloor:
        """Return the noise of a recorded channel."""
        if channel not in self.channels:
            raise KeyError(f"{channel} was not recorded")
        return self.channels[channel]


def noise_floor(recording: Recording, rig: Rig | None = None) -> Floor:
    """Estimate the noise of the measured outputs, in SI, from repeats, holds or innovations."""
    rig = rig or Rig()
    declared = {"contraction": rig.contraction_noise, "pressure": rig.pressure_noise}
    known = rig.noise if recording.outputs else declared
    return Floor(
        {
            channel: _channel(recording, rig, channel, known.get(channel))
            for channel in outputs_of(recording)
        }
    )


def outputs_of(recording: Recording) -> list[str]:
    """Return the names of the recorded outputs."""
    return list(recording.outputs) or [n for n in PAIR if getattr(recording, n) is not None]


def _channel(recording: Recording, rig: Rig, channel: str, declared: float | None) -> ChannelFloor:
    values = recording.reading(channel)
    shown = recording.channel(channel)
    differences = _differences(recording, rig, values)
    ends = [values[rows] for rows in hold_ends(recording)]
    found = {
        "repeats": _scatter(differences) / np.sqrt(2.0),
        "holds": _hold_scatter(ends, recording.period),
        "innovations": white_noise(recording, values),
    }
    least = 1e-9 * float(np.ptp(values))
    estimates = {name: float(v) for name, v in found.items() if np.isfinite(v) and v > least}
    second = round(1.0 / recording.period)
    trust = Trust.of(differences, ends, second, found["innovations"])
    source = best(estimates, declared, trust)
    rounding = float(resolution(values) / np.sqrt(12.0))  # not visible in a hold
    value = max(estimates.get(source, declared or 0.0), rounding)
    reading = estimates.get(source, 0.0)
    raw_values = None if recording.raw is None else recording.raw.reading(channel)
    if (
        recording.raw is not None and raw_values is not None
    ):  # averaging only reduces the white part
        more = white_noise(recording.raw, raw_values) ** 2
        less = white_noise(recording, values) ** 2
        reading = float(np.sqrt(reading**2 + max(0.0, more - less)))
    warnings = (
        *_weak(shown, estimates, source, declared),
        *_misdeclared(shown, reading, source, declared, rounding),
    )
    return ChannelFloor(value, reading, source, estimates, declared, warnings)


def resolution(values: Array) -> float:
    """Return the common step between neighbouring values (n,), in their unit; 0 without one."""
    levels = np.unique(values)
    if len(levels) < 3:
        return float(levels[-1] - levels[0])
    steps = np.diff(levels)
    steps = steps[steps > 1e-9 * (levels[-1] - levels[0])]
    least = float(np.quantile(steps, 0.1))
    counts = steps / least
    whole = np.abs(counts - np.round(counts)) < 0.05
    return least if whole.mean() > 0.95 else 0.0


def _weak(
    channel: Channel, estimates: Mapping[str, float], source: Source, declared: float | None
) -> list[str]:
    """Return warnings on a noise floor from a weaker source than intended."""
    unit, scale = channel.unit, channel.scale
    if source != "repeats" and "repeats" in estimates:
        value = declared if source == "declared" else estimates[source]
        assert value is not None
        what = "declared is" if source == "declared" else f"the {source} scatter by"
        return [
            f"{channel.name}: the repeats differ by more than noise, by "
            f"{estimates['repeats'] / scale:.3g} {unit}, while {what} {value / scale:.3g} {unit}; "
            "the muscle or the rig changed between the repeats, so they are not used"
        ]
    if not estimates:
        more = "the declared noise is used" if declared is not None else "declare the sensor's"
        return [f"{channel.name}: no noise can be seen in the recording; {more}"]
    return []


def _misdeclared(
    channel: Channel, reading: float, source: Source, declared: float | None, rounding: float
) -> list[str]:
    if declared is None or reading == 0.0:
        return []
    unit, scale = channel.unit, channel.scale
    ratio = reading / float(np.hypot(declared, rounding))
    if 1.0 / DISAGREE <= ratio <= DISAGREE:
        return []
    return [
        f"{channel.name}: the declared noise is {declared / scale:.3g} {unit}, the {source} say "
        f"{reading / scale:.3g} {unit} ({ratio:.2g} times); check the sensor or RIG.yaml"
    ]


def _differences(recording: Recording, rig: Rig, values: Array) -> list[Array]:
    """Return the differences between repeated segments, without large offsets."""
    found = []
    for group in repeat_rows(recording, rig):
        n = len(group[0])
        skipped = min(int(START / recording.period), n // 10)
        for i, one in enumerate(group):
            for other in group[:i]:
                difference = (values[one] - values[other])[skipped:]
                middle = float(np.median(difference))
                large = abs(middle) > 0.5 * half_width(difference)  # than slow noise would cause
                if np.ptp(difference) > 0.0:  # otherwise a copy
                    found.append(difference - middle if large else difference)
    return found


def half_width(values: Array) -> float:
    """Return half the distance between the quantiles of one standard deviation."""
    low, high = np.quantile(values, [0.1587, 0.8413])
    return float(0.5 * (high - low))


def _scatter(pieces: list[Array]) -> float:
    """Return the standard deviation without far outliers."""
    if not pieces:
        return float("nan")
    joined = np.concatenate(pieces)
    width = half_width(joined)
    if width > 0.0:
        joined = joined[np.abs(joined) <= 4.0 * width]
    return float(np.sqrt(np.mean(joined**2)))


def holds(recording: Recording) -> Iterator[Indices]:
    """Yield the samples of each stretch of constant command or closed valve."""
    shut, segment = recording.valve_closed, recording.segment
    changed = (np.abs(np.diff(recording.command)) > SAME) & ~(shut[1:] & shut[:-1])
    changed |= (np.diff(recording.load) != 0.0) | (shut[1:] != shut[:-1])
    changed |= recording.restart[1:] | (recording.filled[1:] != recording.filled[:-1])
    changed |= shut[1:] & (segment[1:] != segment[:-1])
    for rows in np.split(np.arange(len(segment)), np.flatnonzero(changed) + 1):
        if not recording.filled[rows[0]]:
            yield rows


def hold_ends(recording: Recording) -> list[Indices]:
    """Return the samples of the settled second half of each sufficiently long hold."""
    ends = []
    for rows in holds(recording):
        seconds = len(rows) * recording.period
        used = min(seconds - max(SETTLING, 0.5 * seconds), LONGEST)
        if used >= SHORTEST - 1e-9:
            ends.append(rows[-round(used / recording.period) :])
    return ends


def _hold_scatter(ends: list[Array], period: float) -> float:
    """Return the RMS noise at the ends of holds, without those that are still moving."""
    if not ends:
        return float("nan")
    variances = np.array([np.sum(detrended(end) ** 2) / (len(end) - 2) for end in ends])
    quiet = variances <= 4.0 * np.median(variances)
    kept = [end for end, good in zip(ends, quiet, strict=True) if good]
    plain = float(np.sqrt(np.mean(variances[quiet])))
    return max(plain, _coloured(kept, period))


def _coloured(ends: list[Array], period: float) -> float:
    """Return the RMS of white plus first-order coloured noise from detrended pieces.

    Detrending removes most of the slow part. The expected autocovariance of the rest is linear in
    the two variances for each candidate correlation time; windows of several lengths are combined.
    """
    windows = _windows(ends, period)
    if not windows:
        return 0.0
    lags = {n: np.r_[0, np.unique(np.geomspace(1, n // 2, 10).astype(int))] for n in windows}
    weights = np.concatenate([np.full(len(lags[n]), np.sqrt(len(windows[n]) * n)) for n in windows])
    seen = np.concatenate([_autocovariance(windows[n], lags[n]) for n in windows])
    white = np.concatenate([_expected(np.eye(n), lags[n]) for n in windows])
    fits = []
    for time in CORRELATIONS:
        slow = np.concatenate(
            [_expected(toeplitz(np.exp(-period / time * np.arange(n))), lags[n]) for n in windows]
        )
        sides = np.column_stack([white, slow]) * weights[:, None]
        parts, misfit = nnls(sides, seen * weights)
        fits.append((misfit, float(np.sqrt(parts.sum()))))
    enough = TOLERANCE * min(misfit for misfit, _ in fits)
    return float(np.mean([value for misfit, value in fits if misfit <= enough]))


def _windows(ends: list[Array], period: float) -> dict[int, list[Array]]:
    """Return the detrended ends of holds, cut to a few lengths, by length."""
    sizes = [round(seconds / period) for seconds in WINDOWS]
    windows: dict[int, list[Array]] = {}
    for end in ends:
        n = max((size for size in sizes if size <= len(end) + 1e-9), default=0)
        if n >= 10:
            windows.setdefault(n, []).append(detrended(end[-n:]))
    return dict(sorted(windows.items()))


def _autocovariance(pieces: list[Array], lags: Indices) -> Array:
    n = len(pieces[0])
    return np.array([np.mean([p[: n - h] @ p[h:] / (n - h) for p in pieces]) for h in lags])


def _expected(covariance: Array, lags: Indices) -> Array:
    """Return the expected autocovariance at some lags after detrending."""
    n = len(covariance)
    x = np.column_stack([np.ones(n), np.arange(n) - 0.5 * (n - 1)])
    x /= np.linalg.norm(x, axis=0)
    left = covariance - x @ (x.T @ covariance)
    left -= (left @ x) @ x.T
    return np.array([np.trace(left, offset=int(h)) / (n - h) for h in lags])


def white_noise(recording: Recording, values: Array) -> float:
    """Return the RMS of the white part of a channel, from its calmest third."""
    size = max(25, round(1.0 / recording.period))
    n = len(values) // size * size
    if n < 3 * size:
        size, n = len(values), len(values)
    windows = np.arange(n).reshape(-1, size)
    before = np.r_[windows[:1], windows[:-1]]  # recent motion has not settled
    moved = np.ptp(recording.command[np.hstack([before, windows])], axis=1)
    broken = recording.restart[windows[:, 1:]].any(axis=1) | recording.filled[windows].any(axis=1)
    whole = np.flatnonzero(~broken)
    if not len(whole):
        return float("nan")
    quiet = whole[moved[whole] <= np.quantile(moved[whole], 1 / 3)]
    second = np.diff(values[windows[quiet]], 2, axis=1).ravel()
    return _scatter([second - np.median(second)]) / np.sqrt(6.0)
