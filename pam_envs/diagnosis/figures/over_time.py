"""Figures over time: replay, residual, effect of each cause."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pam_envs.diagnosis.arrays import Array
from pam_envs.diagnosis.figures import quantities as tv
from pam_envs.diagnosis.figures.canvas import (
    BASE,
    EXTENDED,
    FLOOR,
    HELD,
    INK,
    INSIDE,
    LEFT,
    LEGEND,
    MEASURED,
    MUTED,
    RIGHT,
    RULE,
    Canvas,
    Entry,
    Picture,
    legend_of,
)
from pam_envs.diagnosis.figures.quantities import (
    CHANNELS,
    MINUS,
    TIMES,
    Report,
    View,
    floor,
    limits,
    short,
)

ROW = 14.0
"""Height of a row of segment names; gap between axes with a common time axis."""
BOTTOM = 40.0


def line(ax: Any, x: Array, y: Array, **style: Any) -> None:
    """Draw a line, thinned to the visible resolution."""
    ax.plot(*tv.envelope(x, y), **({"linewidth": 1.1, "solid_joinstyle": "round"} | style))


def models(ax: Any, view: View, channel: str, rows: slice, wide: float = 3.0) -> None:
    """Draw an output as measured and as simulated."""
    x = view.clock[rows]
    line(ax, x, view.measured[channel][rows], color=MEASURED, linewidth=wide)
    line(ax, x, view.base[channel][rows], color=BASE)
    if channel in view.extended:
        line(ax, x, view.extended[channel][rows], color=EXTENDED)


def model_legend(view: View) -> list[Entry]:
    """Return the legend of measured and simulated lines."""
    models = legend_of(bool(view.extended), "simulation", "simulation before", "simulation after")
    return [("line", "measured", {"color": MEASURED, "linewidth": 3.0}), *models]


def held_out_legend(view: View) -> list[Entry]:
    """Return the legend of the shading."""
    shaded = any(s.held_out for s in view.spans)
    return [("area", "held out", {"facecolor": HELD})] if shaded else []


def places(view: View) -> list[tuple[float, int, str, bool]]:
    """Return time, row, name and held-out flag of each segment whose name fits into two rows.

    Held-out segments have priority.
    """
    per_second = INSIDE / max(view.end - float(view.clock[0]), 1e-12)
    taken: list[list[tuple[float, float]]] = [[], []]
    found = []
    for span in sorted(view.spans, key=lambda s: (not s.held_out, s.start)):
        label = short(span.name, 18)
        left = (float(view.clock[span.start]) - float(view.clock[0])) * per_second
        right = left + 6.2 * len(label) + 8.0
        free = [r for r in (0, 1) if all(right <= a or b <= left for a, b in taken[r])]
        if free and right < INSIDE + RIGHT:
            taken[free[0]].append((left, right))
            found.append((float(view.clock[span.start]), free[0], label, span.held_out))
    return found


def strips(
    view: View, rows: Sequence[tuple[str, float]], gap: float = ROW, titles: Sequence[str] = ()
) -> tuple[Canvas, list[Any]]:
    """Return stacked axes over the whole recording, one for each label and height.

    Held-out segments are shaded, and named on the first axes.
    """
    names = places(view)
    above = ROW * (1 + max((row for _, row, _, _ in names), default=0))
    top = LEGEND + above + (gap - ROW)
    canvas = Canvas(top + sum(h for _, h in rows) + gap * (len(rows) - 1) + BOTTOM)
    axes: list[Any] = []
    for k, (label, height) in enumerate(rows):
        if titles:
            canvas.title(LEFT, top - (7.0 if k else 8.0 + above), titles[k])
        ax = canvas.axes(LEFT, top, INSIDE, height, axes[0] if axes else None)
        _shade(ax, view)
        ax.set_ylabel(label)
        ax.tick_params(labelbottom=k == len(rows) - 1)
        axes.append(ax)
        top += height + gap
    for time, row, name, held_out in names:
        style = {"fontsize": 10.5, "color": INK if held_out else MUTED}
        place = {"xytext": (3.0, 4.0 + (ROW - 1.0) * row), "textcoords": "offset points"}
        axes[0].annotate(name, (time, 1.0), xycoords=("data", "axes fraction"), **place, **style)
    axes[-1].set_xlabel("time [s]")
    return canvas, axes


def _shade(ax: Any, view: View) -> None:
    for span in view.spans:
        start = view.clock[span.start]
        stop = view.end if span.stop == len(view.clock) else view.clock[span.stop]
        if span.held_out:
            ax.axvspan(start, stop, color=HELD, linewidth=0, zorder=0)
        if span.start:
            ax.axvline(start, color=RULE, linewidth=0.8, zorder=0.5)
    ax.grid(axis="x", visible=False)
    ax.set_xlim(view.clock[0], view.end)


def replay(report: Report, view: View) -> Picture | None:
    """Draw measured and simulated outputs over the whole recording."""
    below = []
    if view.load is not None and np.nanmax(view.load) > np.nanmin(view.load):
        below.append(("load\n[N]", view.load))
    if view.temperature is not None:
        below.append(("temp.\n[°C]", view.temperature))
    rows = [(tv.unit_label(channel), 170.0) for channel in view.channels]
    canvas, axes = strips(view, [*rows, *((label, 52.0) for label, _ in below)])
    for channel, ax in zip(view.channels, axes, strict=False):
        models(ax, view, channel, slice(None))
    for (_, values), ax in zip(below, axes[len(rows) :], strict=True):
        line(ax, view.clock, values, color=INK)
        ax.set_ylim(limits([values], 0.15))
        ax.locator_params(axis="y", nbins=2)
    canvas.legend([*model_legend(view), *held_out_legend(view)])
    return canvas.picture(
        "replay",
        f"{' and '.join(view.channels)} over {len(view.spans)} segments, measured and simulated "
        f"before{' and after' if view.extended else ''} the extension",
        "A good simulation follows the wide grey line of the measurement; shaded segments were "
        "held out of every fit.",
    )


def zoom(report: Report, view: View) -> Picture | None:
    """Draw the worst part of each held-out segment."""
    spans = tv.one_of_each(view.spans, 3)
    if not spans:
        return None
    height, top = 165.0, LEGEND + 14.0
    canvas = Canvas(top + len(view.channels) * (height + ROW) - ROW + BOTTOM)
    error = view.residuals(view.channels[0])[0]
    windows = [tv.worst_window(view.clock, error, span, 20.0) for span in spans]
    grid = [
        canvas.row(len(spans), top + j * (height + ROW), height, 48.0, own=True)
        for j in range(len(view.channels))
    ]
    width = (INSIDE - 48.0 * (len(spans) - 1)) / len(spans)
    for (left, _), span in zip(grid[0], spans, strict=True):
        canvas.title(left, top - 6.0, short(span.name, int(width / 8.0)))
    for channel, row in zip(view.channels, grid, strict=True):
        row[0][1].set_ylabel(tv.unit_label(channel))
        for (_, ax), rows in zip(row, windows, strict=True):
            models(ax, view, channel, rows, 4.0)
            ax.margins(x=0.0, y=0.08)
            ax.tick_params(labelbottom=channel == view.channels[-1])
            if channel == view.channels[-1]:
                ax.set_xlabel("time [s]")
    canvas.legend(model_legend(view))
    return canvas.picture(
        "zoom",
        f"close-up of the held-out segments {', '.join(s.name for s in spans)}",
        "Up to 20 s of each kind of held-out segment, at the largest error of the simulation "
        "before the extension.",
    )


def residual(report: Report, view: View) -> Picture | None:
    """Draw the residual of each output over time, with the noise band."""
    canvas, axes = strips(view, [(tv.unit_label(channel), 150.0) for channel in view.channels])
    banded = False
    for channel, ax in zip(view.channels, axes, strict=True):
        shown = view.residuals(channel)
        for rest, colour in zip(shown, (BASE, EXTENDED), strict=False):
            line(ax, view.clock, rest, color=colour, linewidth=0.9)
        noise = floor(report, channel)
        if noise:
            banded = True
            shown.append(np.array([-2.5 * noise, 2.5 * noise]))
            for edge in (-2.0 * noise, 2.0 * noise):
                ax.axhline(edge, color=FLOOR, linewidth=1.4, zorder=4)
        ax.set_ylim(limits(shown))
    word = f"measured {MINUS}"
    both = bool(view.extended)
    entries = legend_of(both, f"{word} simulated", f"{word} before", f"{word} after")
    if banded:
        entries.append(("line", f"±2 {TIMES} noise floor", {"color": FLOOR, "linewidth": 1.8}))
    canvas.legend([*entries, *held_out_legend(view)])
    return canvas.picture(
        "residual",
        f"residual of {' and '.join(view.channels)} over time against the noise band",
        "A residual of noise alone fills the band between the green lines evenly; larger or slow "
        "variations are model error.",
    )


def effects(report: Report, view: View) -> Picture | None:
    """Draw the contribution of each named cause to the outputs."""
    rows = [
        (short(cause.get("title") or cause["name"], 60), channel, traces[channel])
        for cause in report.get("causes") or []
        for traces in [view.effects.get(cause["name"]) or {}]
        for channel in _seen(report, traces)
    ]
    if not rows:
        return None
    canvas, axes = strips(
        view,
        [(tv.unit_label(channel), 120.0) for _, channel, _ in rows],
        ROW + 16.0,
        [f"{title}: {channel}" for title, channel, _ in rows],
    )
    for (_, _, trace), ax in zip(rows, axes, strict=True):
        ax.axhline(0.0, color=MUTED, linewidth=0.8)
        line(ax, view.clock, trace, color=EXTENDED, linewidth=1.3)
    canvas.legend(
        [("line", "effect", {"color": EXTENDED, "linewidth": 1.8}), *held_out_legend(view)]
    )
    return canvas.picture(
        "effects",
        "contribution over time of " + ", ".join(c["name"] for c in report["causes"]),
        "The extended simulation less the same simulation with this one cause switched off.",
    )


def _seen(report: Report, effect: dict[str, Array]) -> list[str]:
    """Return the channels on which an effect exceeds a tenth of the noise, or is largest."""

    def size(channel: str) -> float:
        noise = floor(report, channel)
        rms = float(np.sqrt(np.nanmean(effect[channel] ** 2)))
        return rms / noise if noise else float(rms > 0)

    channels = [c for c in CHANNELS if c in effect]
    return [c for c in channels if size(c) >= 0.1] or sorted(channels, key=size)[-1:]
