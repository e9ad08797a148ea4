"""Figures over pressure: hysteresis loops and scatter of the residual."""

from __future__ import annotations

import numpy as np

from pam_envs.diagnosis.figures import quantities as tv
from pam_envs.diagnosis.figures.canvas import (
    BASE,
    EXTENDED,
    FALLING,
    LEGEND,
    MEASURED,
    MUTED,
    PAPER,
    RISING,
    Canvas,
    Picture,
    dots,
)
from pam_envs.diagnosis.figures.over_time import model_legend
from pam_envs.diagnosis.figures.quantities import UNITS, Report, View, limits, short

PANELS = 3
"""Number of loops side by side."""
CLOUD = 1100
"""Largest number of points of each colour."""


def scatter(report: Report, view: View) -> Picture | None:
    """Draw the residual against pressure, coloured by direction."""
    drive = view.base.get("pressure", view.command)
    if drive is None or np.nanmax(drive) <= np.nanmin(drive):
        return None
    height, top = 190.0, LEGEND + 16.0
    canvas = Canvas(top + len(view.channels) * (height + 16.0) + 26.0)
    turn = tv.direction(drive)
    for j, channel in enumerate(view.channels):
        shown = view.residuals(channel)
        box = limits([np.nanpercentile(rest, [0.05, 99.95]) for rest in shown], 0.1)
        panels = canvas.row(len(shown), top + j * (height + 16.0), height, 20.0, 2)
        panels[0][1].set_ylabel(f"{channel} residual [{UNITS[channel][0]}]")
        for i, (rest, (left, ax)) in enumerate(zip(shown, panels, strict=True)):
            for sign, colour in ((1, RISING), (-1, FALLING)):
                rows = np.flatnonzero((turn == sign) & np.isfinite(rest))
                some = tv.thin(rows, CLOUD)
                dots(ax, drive[some], rest[some], colour)
                mean = tv.binned(drive[rows], rest[rows])
                ax.plot(*mean, color=PAPER, linewidth=4.6, zorder=3)
                ax.plot(*mean, color=colour, linewidth=2.4, zorder=4)
            ax.set_ylim(box)
            ax.set_xlim(limits([drive], 0.02))
            ax.tick_params(labelbottom=channel == view.channels[-1])
            if j == 0 and len(shown) > 1:
                canvas.title(left, top - 8.0, ("before", "after")[i])
            if channel == view.channels[-1]:
                ax.set_xlabel("pressure [bar]")
    canvas.legend(
        [
            ("dot", "inflating", {"color": RISING, "markersize": 7}),
            ("dot", "deflating", {"color": FALLING, "markersize": 7}),
            ("line", "mean at that pressure", {"color": MUTED, "linewidth": 2.4}),
        ]
    )
    return canvas.picture(
        "scatter",
        f"residual of {' and '.join(view.channels)} against pressure, by direction of motion",
        "Separate lines show a simulated loop that is too wide or too narrow, parallel bends an "
        "error of the static curve; two flat lines at zero show neither.",
    )


def loops(report: Report, view: View) -> Picture | None:
    """Draw one output over the pressure that drives it, in up to three segments."""
    output = view.channels[0]
    over_pressure = output == "contraction" and "pressure" in view.base
    drive = view.base["pressure"] if over_pressure else view.command
    spans = [] if drive is None else tv.loop_spans(view, drive, PANELS)
    if drive is None or not spans:
        return None
    height, top = 270.0, LEGEND + 30.0
    canvas = Canvas(top + height + 40.0)
    box = limits([side[output][s.rows] for side in (view.measured, view.base) for s in spans])
    panels = canvas.row(len(spans), top, height, 22.0, PANELS)
    panels[0][1].set_ylabel(tv.unit_label(output))
    for span, (left, ax) in zip(spans, panels, strict=True):
        rows = tv.along(drive, view.base[output], span, 900)
        for side, colour, wide in (
            (view.measured, MEASURED, 3.0),
            (view.base, BASE, 1.3),
            (view.extended, EXTENDED, 1.3),
        ):
            if output in side:
                over = side.get("pressure", drive) if over_pressure else drive
                style = {"color": colour, "linewidth": wide, "solid_joinstyle": "round"}
                ax.plot(over[rows], side[output][rows], **style)
        ax.set_ylim(box)
        ax.set_xlabel("pressure [bar]" if over_pressure else "commanded pressure [bar]")
        canvas.title(left, LEGEND + 8.0, short(span.name, 28))
        load = "" if view.load is None else f"{np.nanmean(view.load[span.rows]):.3g} N, "
        note = load + ("held out" if span.held_out else "fitted")
        canvas.text(left, LEGEND + 23.0, note, color=MUTED, fontsize=11.0)
    canvas.legend(model_legend(view))
    return canvas.picture(
        "loops",
        f"{output} over pressure in {', '.join(s.name for s in spans)}",
        "Inflation is the lower side of a loop, deflation the upper one. A good model stays within "
        "the grey line of the measurement, in width and at the corners.",
    )
