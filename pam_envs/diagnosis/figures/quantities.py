"""Quantities of a report, and time series in display units: spans, windows, envelopes."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array

UNITS = {"contraction": ("mm", 1e-3), "pressure": ("bar", 1e5)}
"""Unit of each output of a single muscle, and the unit in SI."""


@dataclass(frozen=True)
class Span:
    """Consecutive rows of one segment, from ``start`` to ``stop`` (exclusive)."""

    name: str
    start: int
    stop: int
    held_out: bool

    @property
    def rows(self) -> slice:
        """The rows as a slice."""
        return slice(self.start, self.stop)


@dataclass(frozen=True)
class View:
    """Time series in display units (mm, bar, N, deg C), all of shape (T,), by channel."""

    clock: Array  # time since the start without pauses between parts of a recording [s]
    spans: tuple[Span, ...]
    measured: dict[str, Array]
    base: dict[str, Array]
    extended: dict[str, Array]  # empty without an extension
    effects: dict[str, dict[str, Array]]  # contributions of causes
    command: Array | None
    load: Array | None
    temperature: Array | None
    units: Mapping[str, tuple[str, float]]
    drive: tuple[str, Array] | None  # label and values of the driving signal, if it is no output

    @property
    def channels(self) -> tuple[str, ...]:
        """Measured and simulated outputs, the motion first."""
        return tuple(c for c in self.units if c in self.measured and c in self.base)

    @property
    def end(self) -> float:
        """End of the last row [s]."""
        return float(2.0 * self.clock[-1] - self.clock[-2])

    def residuals(self, channel: str) -> list[Array]:
        """Return measured less simulated, in display units, before and after an extension."""
        models = [model for model in (self.base, self.extended) if channel in model]
        return [self.measured[channel] - model[channel] for model in models]

    @classmethod
    def of(cls, traces: Any) -> "View":
        """Convert the time series of a diagnosis from SI to display units."""
        segment = np.asarray(traces.segment, dtype=np.int64)
        command = _optional(traces.command)
        units = dict(getattr(traces, "units", None) or UNITS)
        base, extended = _shown(traces.base, units), _shown(traces.extended, units)
        if all(c in base and np.array_equal(extended[c], base[c], True) for c in extended):
            extended = {}  # no extension
        return cls(
            clock=elapsed(np.asarray(traces.time)),
            spans=spans_of(segment, traces.segments, np.asarray(traces.held_out, dtype=bool)),
            measured=_shown(traces.measured, units),
            base=base,
            extended=extended,
            effects={name: _shown(effect, units) for name, effect in traces.effects.items()},
            command=None if command is None else command / UNITS["pressure"][1],
            load=_optional(traces.load),
            temperature=_optional(traces.temperature),
            units=units,
            drive=getattr(traces, "drive", None),
        )


def _optional(values: Any) -> Array | None:
    if values is None:
        return None
    array = np.asarray(values, dtype=float)
    return array if np.isfinite(array).any() else None


def _shown(
    outputs: Mapping[str, Any] | None, units: Mapping[str, tuple[str, float]]
) -> dict[str, Array]:
    found = {c: _optional((outputs or {}).get(c)) for c in units}
    return {c: array / units[c][1] for c, array in found.items() if array is not None}


def elapsed(time: Array) -> Array:
    """Return the time since the start without jumps where the time [s] restarts at a segment."""
    if len(time) < 2:
        return np.zeros(len(time))
    steps = np.diff(time)
    period = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 1.0
    steps = np.where((steps <= 0) | (steps > 10 * period), period, steps)
    return np.concatenate([[0.0], np.cumsum(steps)])


def spans_of(
    segment: NDArray[np.int64], names: tuple[str, ...], held_out: NDArray[np.bool_]
) -> tuple[Span, ...]:
    """Return the runs of equal segment, in order."""
    if not len(segment):
        return ()
    edges = np.flatnonzero(np.diff(segment)) + 1
    starts = np.concatenate([[0], edges])
    stops = np.concatenate([edges, [len(segment)]])
    return tuple(
        Span(names[segment[a]], int(a), int(b), bool(held_out[a:b].mean() > 0.5))
        for a, b in zip(starts, stops, strict=True)
    )


def envelope(x: Array, y: Array, points: int = 2400) -> tuple[Array, Array]:
    """Return at most ``points`` points that look like ``y`` over ``x``: the extremes of bins."""
    width = -(-2 * len(y) // points)
    if width <= 2:
        return x, y
    bins = -(-len(y) // width)
    padded = np.full(bins * width, np.nan)
    padded[: len(y)] = y
    table = padded.reshape(bins, width)
    gap = np.isnan(table)
    low = np.argmin(np.where(gap, np.inf, table), axis=1)
    high = np.argmax(np.where(gap, -np.inf, table), axis=1)
    pairs = np.sort(np.stack([low, high], axis=1), axis=1) + np.arange(bins)[:, None] * width
    rows = np.minimum(pairs.ravel(), len(y) - 1)
    return x[rows], y[rows]


def thin(rows: NDArray[np.int64], most: int) -> NDArray[np.int64]:
    """Return at most ``most`` of the rows, evenly spaced."""
    if len(rows) <= most:
        return rows
    return rows[np.linspace(0, len(rows) - 1, most).round().astype(np.int64)]


def along(x: Array, y: Array, span: Span, most: int) -> NDArray[np.int64]:
    """Return at most ``most`` rows of a span, evenly spaced along the curve y over x."""
    rows = np.arange(span.start, span.stop)
    if len(rows) <= most:
        return rows
    ways = [np.abs(np.diff(v[span.rows], prepend=v[span.start])) for v in (x, y)]
    step = sum(w / max(float(np.nansum(w)), 1e-12) for w in map(np.nan_to_num, ways))
    way = np.cumsum(step + 0.5 / len(rows))
    return rows[np.unique(np.searchsorted(way, np.linspace(way[0], way[-1], most)))]


def worst_window(clock: Array, error: Array, span: Span, seconds: float) -> slice:
    """Return the part of a span, at most ``seconds`` long, with the largest squared error."""
    n = span.stop - span.start
    step = (clock[span.stop - 1] - clock[span.start]) / max(n - 1, 1)
    width = n if step <= 0 else min(n, round(seconds / step))
    if width >= 0.7 * n:
        return span.rows
    power = np.concatenate([[0.0], np.cumsum(np.nan_to_num(error[span.rows]) ** 2)])
    start = span.start + int(np.argmax(power[width:] - power[:-width]))
    return slice(start, start + width)


def one_of_each(spans: tuple[Span, ...], most: int) -> list[Span]:
    """Return the first held-out span of each name, the longest ones if there are too many."""
    first: dict[str, Span] = {}
    for span in spans:
        if span.held_out and span.stop - span.start > 1:
            first.setdefault(span.name, span)
    chosen = sorted(first.values(), key=lambda s: s.start - s.stop)[:most]
    return sorted(chosen, key=lambda s: s.start)


def loop_spans(view: View, drive: Array, most: int = 3) -> list[Span]:
    """Return the spans with the widest loops, of different loads first."""
    spans = [s for s in view.spans if s.stop - s.start > 20]

    turn = direction(drive)

    def width(span: Span) -> float:
        part = drive[span.rows]
        if not np.isfinite(part).any():
            return 0.0
        low, high = np.nanpercentile(part, [2.0, 98.0])
        moving = float(np.mean(turn[span.rows] != 0))  # few for steps, which are no loops
        return float(high - low) * np.sqrt(moving)

    def load(span: Span) -> float:
        return 0.0 if view.load is None else round(float(np.nanmean(view.load[span.rows])), 1)

    ranked = sorted(spans, key=lambda s: (-round(width(s), 1), not s.held_out, s.start))
    ranked = [s for s in ranked if width(s) > 0.3 * width(ranked[0]) > 0.0]
    chosen: list[Span] = []
    for fresh in (True, False):
        for span in ranked:
            known = {load(s) for s in chosen}
            if len(chosen) < most and span not in chosen and (load(span) not in known) == fresh:
                chosen.append(span)
    return sorted(chosen, key=lambda s: s.start)


def unit_label(view: View, channel: str) -> str:
    """Return "contraction [mm]" or "pressure [bar]"."""
    return f"{channel.replace('_', ' ')} [{view.units[channel][0]}]"


def limits(values: Iterable[Array], margin: float = 0.06) -> tuple[float, float]:
    """Return axis limits for all finite values."""
    parts = [v[np.isfinite(v)] for v in values]
    whole = np.concatenate(parts) if parts else np.zeros(0)
    if not len(whole):
        return -1.0, 1.0
    low, high = float(whole.min()), float(whole.max())
    room = margin * (high - low) or 1.0
    return low - room, high + room


def direction(drive: Array, period_rows: int = 5) -> NDArray[np.int64]:
    """Return 1 for a rising, -1 for a falling and 0 for a constant signal, shape (T,)."""
    if len(drive) < 3:
        return np.zeros(len(drive), dtype=np.int64)
    filled = np.nan_to_num(drive, nan=float(np.nanmean(drive)))
    kernel = np.ones(2 * period_rows + 1) / (2 * period_rows + 1)
    smooth = np.convolve(np.pad(filled, period_rows, mode="edge"), kernel, mode="valid")
    slope = np.gradient(smooth)
    dead = 0.02 * float(np.nanpercentile(np.abs(slope), 95.0))
    return np.where(slope > dead, 1, np.where(slope < -dead, -1, 0))


def binned(x: Array, y: Array, bins: int = 14) -> tuple[Array, Array]:
    """Return means of x and y in bins of x with enough points."""
    good = np.isfinite(x) & np.isfinite(y)
    x, y = x[good], y[good]
    if len(x) < 2 * bins or np.ptp(x) <= 0:
        return np.empty(0), np.empty(0)
    place = np.minimum(((x - x.min()) / np.ptp(x) * bins).astype(np.int64), bins - 1)
    count = np.bincount(place, minlength=bins)
    keep = count >= max(5, 0.004 * len(x))
    with np.errstate(invalid="ignore", divide="ignore"):
        means = np.bincount(place, x, bins) / count, np.bincount(place, y, bins) / count
    return means[0][keep], means[1][keep]


Report = Mapping[str, Any]
MINUS, TIMES = "\N{MINUS SIGN}", "\N{MULTIPLICATION SIGN}"


def value(quantity: Any) -> float | None:
    """Return the value of a quantity, itself if it is a number."""
    found = quantity.get("value") if isinstance(quantity, Mapping) else quantity
    return None if found is None else float(found)


def floor(report: Report, channel: str) -> float | None:
    """Return the noise floor of a channel [mm or bar]."""
    return value((report.get("noise_floor") or {}).get(channel))


def changed(report: Report) -> bool:
    """Return whether the report compares two simulations."""
    after = report.get("error_after")
    return bool(report.get("causes")) or bool(after and after != report.get("error_before"))


def reported(quantities: Mapping[str, Any] | None) -> list[str]:
    """Return the channels in a report."""
    return [c for c, found in (quantities or {}).items() if found]


def gain_to_floor(report: Report) -> float | None:
    """Return the gain of a model that leaves only noise, or None if it is unknown."""
    errors = report.get("error_before") or {}
    ratios = [errors[c].get("times_floor") for c in reported(errors)]
    total = sum(2.0 * float(np.log(r)) for r in ratios if r)
    return total if total > 0 else None


def short(text: str, most: int) -> str:
    """Return a text of at most ``most`` characters."""
    return text if len(text) <= most else text[: most - 1] + "…"


def written(number: float) -> str:
    """Return a number with two decimals and a typographic minus."""
    return f"{number:.2f}".replace("-", MINUS) if round(number, 2) else "0.00"
