"""Figures of time series: replay, residual, effect of each cause, and loops over pressure."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pam_envs.arrays import Array
from pam_envs.diagnosis.figures import canvas as cv
from pam_envs.diagnosis.figures import quantities as tv

ROW = 14.0  # height of a row of segment names; gap between axes with a common time axis
BOTTOM = 40.0
PANELS = 3  # number of loops side by side
CLOUD = 1100  # largest number of points of each colour


def line(ax: Any, x: Array, y: Array, **style: Any) -> None:
    """Draw a line, thinned to the visible resolution."""
    ax.plot(*tv.envelope(x, y), **({"linewidth": 1.1, "solid_joinstyle": "round"} | style))


def models(ax: Any, view: tv.View, channel: str, rows: slice, wide: float = 3.0) -> None:
    """Draw an output as measured and as simulated."""
    x = view.clock[rows]
    line(ax, x, view.measured[channel][rows], color=cv.MEASURED, linewidth=wide)
    line(ax, x, view.base[channel][rows], color=cv.BASE)
    if channel in view.extended:
        line(ax, x, view.extended[channel][rows], color=cv.EXTENDED)


def model_legend(view: tv.View) -> list[cv.Entry]:
    """Return the legend of measured and simulated lines."""
    models = cv.legend_of(
        bool(view.extended), "simulation", "simulation before", "simulation after"
    )
    return [("line", "measured", {"color": cv.MEASURED, "linewidth": 3.0}), *models]


def held_out_legend(view: tv.View) -> list[cv.Entry]:
    """Return the legend of the shading."""
    shaded = any(s.held_out for s in view.spans)
    return [("area", "held out", {"facecolor": cv.HELD})] if shaded else []


def places(view: tv.View) -> list[tuple[float, int, str, bool]]:
    """Return time, row, name and flag of segments that fit into two rows, held-out ones first."""
    per_second = cv.INSIDE / max(view.end - float(view.clock[0]), 1e-12)
    taken: list[list[tuple[float, float]]] = [[], []]
    found = []
    for span in sorted(view.spans, key=lambda s: (not s.held_out, s.start)):
        label = tv.short(span.name, 18)
        left = (float(view.clock[span.start]) - float(view.clock[0])) * per_second
        right = left + 6.2 * len(label) + 8.0
        free = [r for r in (0, 1) if all(right <= a or b <= left for a, b in taken[r])]
        if free and right < cv.INSIDE + cv.RIGHT:
            taken[free[0]].append((left, right))
            found.append((float(view.clock[span.start]), free[0], label, span.held_out))
    return found


def strips(
    view: tv.View, rows: Sequence[tuple[str, float]], gap: float = ROW, titles: Sequence[str] = ()
) -> tuple[cv.Canvas, list[Any]]:
    """Return stacked axes over the recording by label and height, held-out segments shaded."""
    names = places(view)
    above = ROW * (1 + max((row for _, row, _, _ in names), default=0))
    top = cv.LEGEND + above + (gap - ROW)
    canvas = cv.Canvas(top + sum(h for _, h in rows) + gap * (len(rows) - 1) + BOTTOM)
    axes: list[Any] = []
    for k, (label, height) in enumerate(rows):
        if titles:
            canvas.title(cv.LEFT, top - (7.0 if k else 8.0 + above), titles[k])
        ax = canvas.axes(cv.LEFT, top, cv.INSIDE, height, axes[0] if axes else None)
        _shade(ax, view)
        ax.set_ylabel(label)
        ax.tick_params(labelbottom=k == len(rows) - 1)
        axes.append(ax)
        top += height + gap
    for time, row, name, held_out in names:
        style = {"fontsize": 10.5, "color": cv.INK if held_out else cv.MUTED}
        place = {"xytext": (3.0, 4.0 + (ROW - 1.0) * row), "textcoords": "offset points"}
        axes[0].annotate(name, (time, 1.0), xycoords=("data", "axes fraction"), **place, **style)
    axes[-1].set_xlabel("time [s]")
    return canvas, axes


def _shade(ax: Any, view: tv.View) -> None:
    for span in view.spans:
        start = view.clock[span.start]
        stop = view.end if span.stop == len(view.clock) else view.clock[span.stop]
        if span.held_out:
            ax.axvspan(start, stop, color=cv.HELD, linewidth=0, zorder=0)
        if span.start:
            ax.axvline(start, color=cv.RULE, linewidth=0.8, zorder=0.5)
    ax.grid(axis="x", visible=False)
    ax.set_xlim(view.clock[0], view.end)


def replay(report: tv.Report, view: tv.View) -> cv.Picture | None:
    """Draw measured and simulated outputs over the whole recording."""
    below = []
    if view.load is not None and np.nanmax(view.load) > np.nanmin(view.load):
        below.append(("load\n[N]", view.load))
    if view.temperature is not None:
        below.append(("temp.\n[°C]", view.temperature))
    rows = [(tv.unit_label(view, channel), 170.0) for channel in view.channels]
    canvas, axes = strips(view, [*rows, *((label, 52.0) for label, _ in below)])
    for channel, ax in zip(view.channels, axes, strict=False):
        models(ax, view, channel, slice(None))
    for (_, values), ax in zip(below, axes[len(rows) :], strict=True):
        line(ax, view.clock, values, color=cv.INK)
        ax.set_ylim(tv.limits([values], 0.15))
        ax.locator_params(axis="y", nbins=2)
    canvas.legend([*model_legend(view), *held_out_legend(view)])
    return canvas.picture(
        "replay",
        f"{' and '.join(view.channels)} over {len(view.spans)} segments, measured and simulated "
        f"before{' and after' if view.extended else ''} the extension",
        "A good simulation follows the wide grey line of the measurement; shaded segments were "
        "held out of every fit.",
    )


def zoom(report: tv.Report, view: tv.View) -> cv.Picture | None:
    """Draw the worst part of each held-out segment."""
    spans = tv.one_of_each(view.spans, 3)
    if not spans:
        return None
    height, top = 165.0, cv.LEGEND + 14.0
    canvas = cv.Canvas(top + len(view.channels) * (height + ROW) - ROW + BOTTOM)
    error = view.residuals(view.channels[0])[0]
    windows = [tv.worst_window(view.clock, error, span, 20.0) for span in spans]
    grid = [
        canvas.row(len(spans), top + j * (height + ROW), height, 48.0, own=True)
        for j in range(len(view.channels))
    ]
    width = (cv.INSIDE - 48.0 * (len(spans) - 1)) / len(spans)
    for (left, _), span in zip(grid[0], spans, strict=True):
        canvas.title(left, top - 6.0, tv.short(span.name, int(width / 8.0)))
    for channel, row in zip(view.channels, grid, strict=True):
        row[0][1].set_ylabel(tv.unit_label(view, channel))
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


def residual(report: tv.Report, view: tv.View) -> cv.Picture | None:
    """Draw the residual of each output over time, with the noise band."""
    canvas, axes = strips(
        view, [(tv.unit_label(view, channel), 150.0) for channel in view.channels]
    )
    banded = False
    for channel, ax in zip(view.channels, axes, strict=True):
        shown = view.residuals(channel)
        for rest, colour in zip(shown, (cv.BASE, cv.EXTENDED), strict=False):
            line(ax, view.clock, rest, color=colour, linewidth=0.9)
        noise = tv.floor(report, channel)
        if noise:
            banded = True
            shown.append(np.array([-2.5 * noise, 2.5 * noise]))
            for edge in (-2.0 * noise, 2.0 * noise):
                ax.axhline(edge, color=cv.FLOOR, linewidth=1.4, zorder=4)
        ax.set_ylim(tv.limits(shown))
    word = f"measured {tv.MINUS}"
    both = bool(view.extended)
    entries = cv.legend_of(both, f"{word} simulated", f"{word} before", f"{word} after")
    if banded:
        entries.append(
            ("line", f"±2 {tv.TIMES} noise floor", {"color": cv.FLOOR, "linewidth": 1.8})
        )
    canvas.legend([*entries, *held_out_legend(view)])
    return canvas.picture(
        "residual",
        f"residual of {' and '.join(view.channels)} over time against the noise band",
        "A residual of noise alone fills the band between the green lines evenly; larger or slow "
        "variations are model error.",
    )


def effects(report: tv.Report, view: tv.View) -> cv.Picture | None:
    """Draw the contribution of each named cause to the outputs."""
    rows = [
        (tv.short(cause.get("title") or cause["name"], 60), channel, traces[channel])
        for cause in report.get("causes") or []
        for traces in [view.effects.get(cause["name"]) or {}]
        for channel in _seen(report, view, traces)
    ]
    if not rows:
        return None
    canvas, axes = strips(
        view,
        [(tv.unit_label(view, channel), 120.0) for _, channel, _ in rows],
        ROW + 16.0,
        [f"{title}: {channel}" for title, channel, _ in rows],
    )
    for (_, _, trace), ax in zip(rows, axes, strict=True):
        ax.axhline(0.0, color=cv.MUTED, linewidth=0.8)
        line(ax, view.clock, trace, color=cv.EXTENDED, linewidth=1.3)
    canvas.legend(
        [("line", "effect", {"color": cv.EXTENDED, "linewidth": 1.8}), *held_out_legend(view)]
    )
    return canvas.picture(
        "effects",
        "contribution over time of " + ", ".join(c["name"] for c in report["causes"]),
        "The extended simulation less the same simulation with this one cause switched off.",
    )


def _seen(report: tv.Report, view: tv.View, effect: dict[str, Array]) -> list[str]:
    """Return the channels on which an effect exceeds a tenth of the noise, or is largest."""

    def size(channel: str) -> float:
        noise = tv.floor(report, channel)
        rms = float(np.sqrt(np.nanmean(effect[channel] ** 2)))
        return rms / noise if noise else float(rms > 0)

    channels = [c for c in view.units if c in effect]
    return [c for c in channels if size(c) >= 0.1] or sorted(channels, key=size)[-1:]


def scatter(report: tv.Report, view: tv.View) -> cv.Picture | None:
    """Draw the residual against pressure, coloured by direction."""
    label, drive = view.drive or ("pressure [bar]", view.base.get("pressure", view.command))
    if drive is None or np.nanmax(drive) <= np.nanmin(drive):
        return None
    height, top = 190.0, cv.LEGEND + 16.0
    canvas = cv.Canvas(top + len(view.channels) * (height + 16.0) + 26.0)
    turn = tv.direction(drive)
    for j, channel in enumerate(view.channels):
        shown = view.residuals(channel)
        box = tv.limits([np.nanpercentile(rest, [0.05, 99.95]) for rest in shown], 0.1)
        panels = canvas.row(len(shown), top + j * (height + 16.0), height, 20.0, 2)
        panels[0][1].set_ylabel(f"{channel} residual [{view.units[channel][0]}]")
        for i, (rest, (left, ax)) in enumerate(zip(shown, panels, strict=True)):
            for sign, colour in ((1, cv.RISING), (-1, cv.FALLING)):
                rows = np.flatnonzero((turn == sign) & np.isfinite(rest))
                some = tv.thin(rows, CLOUD)
                cv.dots(ax, drive[some], rest[some], colour)
                mean = tv.binned(drive[rows], rest[rows])
                ax.plot(*mean, color=cv.PAPER, linewidth=4.6, zorder=3)
                ax.plot(*mean, color=colour, linewidth=2.4, zorder=4)
            ax.set_ylim(box)
            ax.set_xlim(tv.limits([drive], 0.02))
            ax.tick_params(labelbottom=channel == view.channels[-1])
            if j == 0 and len(shown) > 1:
                canvas.title(left, top - 8.0, ("before", "after")[i])
            if channel == view.channels[-1]:
                ax.set_xlabel(label)
    canvas.legend(
        [
            ("dot", "inflating", {"color": cv.RISING, "markersize": 7}),
            ("dot", "deflating", {"color": cv.FALLING, "markersize": 7}),
            ("line", "mean at that pressure", {"color": cv.MUTED, "linewidth": 2.4}),
        ]
    )
    return canvas.picture(
        "scatter",
        f"residual of {' and '.join(view.channels)} against "
        f"{label.partition(' [')[0]}, by direction of motion",
        "Separate lines show a simulated loop that is too wide or too narrow, parallel bends an "
        "error of the static curve; two flat lines at zero show neither.",
    )


def loops(report: tv.Report, view: tv.View) -> cv.Picture | None:
    """Draw one output over the pressure that drives it, in up to three segments."""
    output = view.channels[0]
    over_pressure = output == "contraction" and "pressure" in view.base
    label = "pressure [bar]" if over_pressure else "commanded pressure [bar]"
    drive = view.base["pressure"] if over_pressure else view.command
    if view.drive is not None:
        label, drive = view.drive
    spans = [] if drive is None else tv.loop_spans(view, drive, PANELS)
    if drive is None or not spans:
        return None
    height, top = 270.0, cv.LEGEND + 30.0
    canvas = cv.Canvas(top + height + 40.0)
    box = tv.limits([side[output][s.rows] for side in (view.measured, view.base) for s in spans])
    panels = canvas.row(len(spans), top, height, 22.0, PANELS)
    panels[0][1].set_ylabel(tv.unit_label(view, output))
    for span, (left, ax) in zip(spans, panels, strict=True):
        rows = tv.along(drive, view.base[output], span, 900)
        for side, colour, wide in (
            (view.measured, cv.MEASURED, 3.0),
            (view.base, cv.BASE, 1.3),
            (view.extended, cv.EXTENDED, 1.3),
        ):
            if output in side:
                over = side.get("pressure", drive) if over_pressure else drive
                style = {"color": colour, "linewidth": wide, "solid_joinstyle": "round"}
                ax.plot(over[rows], side[output][rows], **style)
        ax.set_ylim(box)
        ax.set_xlabel(label)
        canvas.title(left, cv.LEGEND + 8.0, tv.short(span.name, 28))
        load = "" if view.load is None else f"{np.nanmean(view.load[span.rows]):.3g} N, "
        note = load + ("held out" if span.held_out else "fitted")
        canvas.text(left, cv.LEGEND + 23.0, note, color=cv.MUTED, fontsize=11.0)
    canvas.legend(model_legend(view))
    return canvas.picture(
        "loops",
        f"{output} over pressure in {', '.join(s.name for s in spans)}",
        "Inflation is the lower side of a loop, deflation the upper one. A good model stays within "
        "the grey line of the measurement, in width and at the corners.",
    )
