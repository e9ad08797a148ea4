"""Figures of settled readings over pressure, by load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.diagnosis.arrays import Array
from pam_envs.diagnosis.figures import traces as tv
from pam_envs.diagnosis.figures.canvas import (
    BASE,
    EXTENDED,
    FLOOR,
    LEFT,
    LEGEND,
    MEASURED,
    MUTED,
    RIGHT,
    WIDTH,
    Canvas,
    Picture,
)
from pam_envs.diagnosis.figures.quantities import MINUS, TIMES, Report, changed, floor, short
from pam_envs.diagnosis.figures.traces import limits

PANELS = 4
"""Largest number of loads side by side."""
DASHED = (0, (3, 2))
TOP = LEGEND + 18.0


@dataclass(frozen=True)
class Curves:
    """``readings.curves`` of a report: cells in the order of the cycles, shape (C,)."""

    load: Array
    pressure: Array
    falling: NDArray[np.bool_]
    path: NDArray[np.int64]
    measured: Array
    readings: Array
    base: Array
    extended: Array
    effects: dict[str, Array]

    @classmethod
    def of(cls, found: Report) -> Curves:
        """Read the curves of a report [kg, bar, mm]."""
        return cls(
            load=_array(found["load_kg"]),
            pressure=_array(found["pressure_bar"]),
            falling=np.array(found["deflating"], dtype=bool),
            path=np.array(found["path"], dtype=np.int64),
            measured=_array(found["measured_mm"]),
            readings=np.atleast_2d(_array(found["readings_mm"])),
            base=_array(found["base_mm"]),
            extended=_array(found["extended_mm"]),
            effects={name: _array(v) for name, v in (found.get("effects_mm") or {}).items()},
        )

    @property
    def loads(self) -> list[float]:
        """Loads with a panel [kg], with the extremes."""
        loads = np.unique(self.load)
        return [float(v) for v in loads[tv.thin(np.arange(len(loads)), PANELS)]]

    def branches(self, load: float) -> list[NDArray[np.int64]]:
        """Return the rows of each branch of each cycle at a load, in order."""
        rows = np.flatnonzero(self.load == load)
        if not len(rows):
            return []
        turned = (np.diff(self.path[rows]) != 0) | (np.diff(self.falling[rows].astype(int)) != 0)
        return np.split(rows, np.flatnonzero(turned) + 1)


def _array(values: Any) -> Array:
    return np.array(values, dtype=float)


class Panels:
    """One panel for each load, with common limits."""

    def __init__(self, names: Sequence[str], label: str, height: float) -> None:
        gap = 20.0
        width = (WIDTH - LEFT - RIGHT - gap * (len(names) - 1)) / max(len(names), 2)
        self.canvas = Canvas(TOP + height + 40.0)
        self.axes = []
        for i, name in enumerate(names):
            left = LEFT + i * (width + gap)
            self.canvas.title(left, TOP - 8.0, short(name, int(width / 7.5)))
            ax = self.canvas.axes(left, TOP, width, height)
            ax.set_xlabel("pressure [bar]")
            ax.tick_params(labelleft=i == 0)
            if i == 0:
                ax.set_ylabel(label)
            self.axes.append(ax)


def cycles(report: Report, curves: Curves) -> Picture:
    """Draw measured and simulated cycles, a panel for each load."""
    panels = Panels([f"{load:g} kg" for load in curves.loads], "contraction [mm]", 300.0)
    both = changed(report)
    lines = [(curves.base, BASE)] + ([(curves.extended, EXTENDED)] if both else [])
    for ax, load in zip(panels.axes, curves.loads, strict=True):
        here = curves.load == load
        for row in curves.readings:
            ax.plot(curves.pressure[here], row[here], "o", color=MEASURED, markersize=4.5)
        for path in np.unique(curves.path[here]):
            rows = here & (curves.path == path)
            for values, colour in lines:
                ax.plot(curves.pressure[rows], values[rows], color=colour, linewidth=1.5)
        ax.set_ylim(limits([curves.readings, curves.base]))
    legend: list[tuple[str, str, dict[str, Any]]] = [
        ("dot", "readings", {"color": MEASURED, "markersize": 5}),
        ("line", f"simulation{' before' if both else ''}", {"color": BASE, "linewidth": 1.8}),
    ]
    if both:
        legend.append(("line", "simulation after", {"color": EXTENDED, "linewidth": 1.8}))
    panels.canvas.legend(legend)
    return panels.canvas.picture(
        "replay",
        f"contraction over pressure at {len(curves.loads)} loads, readings and simulation",
        "Inflation is the lower side of a loop, deflation the upper one; a good simulation passes "
        "through the dots.",
    )


def left_over(report: Report, curves: Curves) -> Picture:
    """Draw the mean readings less the simulation over pressure, a panel for each load."""
    panels = Panels([f"{load:g} kg" for load in curves.loads], "contraction [mm]", 210.0)
    both = changed(report)
    sides = [(curves.measured - curves.base, BASE)]
    sides += [(curves.measured - curves.extended, EXTENDED)] if both else []
    noise = floor(report, "contraction")
    box = limits([rest for rest, _ in sides], 0.1)
    for ax, load in zip(panels.axes, curves.loads, strict=True):
        ax.axhline(0.0, color=MUTED, linewidth=0.8)
        for edge in (-2.0, 2.0) if noise else ():
            ax.axhline(edge * (noise or 0.0), color=FLOOR, linewidth=1.4)
        for rest, colour in sides:
            _branches(ax, curves, load, rest, colour)
        ax.set_ylim(box)
    word = "before" if both else "simulated"
    legend = [("line", f"measured {MINUS} {word}", {"color": BASE, "linewidth": 1.8})]
    if both:
        legend.append(("line", f"measured {MINUS} after", {"color": EXTENDED, "linewidth": 1.8}))
    legend.append(("line", "deflating", {"color": MUTED, "linewidth": 1.5, "linestyle": DASHED}))
    if noise:
        legend.append(("line", f"±2 {TIMES} noise floor", {"color": FLOOR, "linewidth": 1.8}))
    panels.canvas.legend(legend)
    return panels.canvas.picture(
        "residual",
        "residual of the mean readings over pressure, by load and direction",
        "An offset of a panel is an error of the load, a gap between full and dashed line an error "
        "of the loop's width, a common bend an error of the static curve.",
    )


def _branches(ax: Any, curves: Curves, load: float, values: Array, colour: str) -> None:
    for rows in curves.branches(load):
        ax.plot(
            curves.pressure[rows],
            values[rows],
            color=colour,
            linewidth=1.5,
            linestyle=DASHED if curves.falling[rows[0]] else "solid",
            marker=".",
            markersize=5,
        )


def cell_effects(report: Report, curves: Curves) -> Picture | None:
    """Draw the contribution of each named cause over pressure, a line for each load."""
    causes = [c for c in report.get("causes") or [] if c["name"] in curves.effects][:3]
    if not causes:
        return None
    names = [c["name"].replace("_", " ") for c in causes]
    panels = Panels(names, "contraction [mm]", 220.0)
    shown = [curves.effects[c["name"]] for c in causes]
    shades = np.linspace(0.3, 1.0, len(curves.loads))
    for ax, values in zip(panels.axes, shown, strict=True):
        ax.axhline(0.0, color=MUTED, linewidth=0.8)
        for load, alpha in zip(curves.loads, shades, strict=True):
            for rows in curves.branches(load):
                dashes = DASHED if curves.falling[rows[0]] else "solid"
                style = {"color": EXTENDED, "alpha": alpha, "linewidth": 1.8}
                ax.plot(curves.pressure[rows], values[rows], linestyle=dashes, **style)
        ax.set_ylim(limits(shown))
    legend = [
        ("line", f"{load:g} kg", {"color": EXTENDED, "alpha": alpha, "linewidth": 2.2})
        for load, alpha in zip(curves.loads, shades, strict=True)
    ]
    dashed = ("line", "deflating", {"color": MUTED, "linewidth": 1.5, "linestyle": DASHED})
    panels.canvas.legend([*legend, dashed])
    return panels.canvas.picture(
        "effects",
        "contribution over pressure of " + ", ".join(c["name"] for c in causes),
        "The extended simulation less the same simulation with this one cause switched off.",
    )
