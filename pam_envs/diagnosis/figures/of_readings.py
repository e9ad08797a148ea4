"""Figures of settled readings over pressure, by load."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from pam_envs.arrays import Array, Indices
from pam_envs.diagnosis.figures import canvas as cv
from pam_envs.diagnosis.figures import quantities as tv

PANELS = 4  # largest number of loads side by side
DASHED = (0, (3, 2))
TOP = cv.LEGEND + 18.0
DEFLATING: cv.Entry = (
    "line",
    "deflating",
    {"color": cv.MUTED, "linewidth": 1.5, "linestyle": DASHED},
)


class Curves:
    """``readings.curves`` of a report [kg, bar, mm]: cells in the order of the cycles, (C,)."""

    def __init__(self, found: tv.Report) -> None:
        keys = ("load_kg", "pressure_bar", "measured_mm", "base_mm", "extended_mm")
        self.load, self.pressure, self.measured, self.base, self.extended = (
            np.array(found[key], dtype=float) for key in keys
        )
        self.falling, self.path = np.array(found["deflating"]), np.array(found["path"])
        self.readings = np.atleast_2d(np.array(found["readings_mm"], dtype=float))
        effects = found.get("effects_mm") or {}
        self.effects = {name: np.array(v, dtype=float) for name, v in effects.items()}

    @property
    def loads(self) -> list[float]:
        """Loads with a panel [kg], with the extremes."""
        loads = np.unique(self.load)
        return [float(v) for v in loads[tv.thin(np.arange(len(loads)), PANELS)]]

    def branches(self, load: float) -> Iterator[tuple[Indices, Any]]:
        """Yield the rows and the line style of each branch of each cycle at a load, in order."""
        rows = np.flatnonzero(self.load == load)
        turned = (np.diff(self.path[rows]) != 0) | (np.diff(self.falling[rows].astype(int)) != 0)
        for branch in np.split(rows, np.flatnonzero(turned) + 1):
            yield branch, DASHED if self.falling[branch[0]] else "solid"

    def draw(self, ax: Any, load: float, values: Array, **style: Any) -> None:
        """Draw values over pressure at a load, dashed at deflation."""
        for rows, dashes in self.branches(load):
            ax.plot(self.pressure[rows], values[rows], linestyle=dashes, **style)


def panels(names: Sequence[str], height: float) -> tuple[cv.Canvas, list[Any]]:
    """Return a canvas with one panel a name."""
    canvas = cv.Canvas(TOP + height + 40.0)
    row = canvas.row(len(names), TOP, height, 20.0, 2)
    for name, (left, ax) in zip(names, row, strict=True):
        width = 72.0 * canvas.figure.get_figwidth() * ax.get_position().width
        canvas.title(left, TOP - 8.0, tv.short(name, int(width / 7.5)))
        ax.set_xlabel("pressure [bar]")
    row[0][1].set_ylabel("contraction [mm]")
    return canvas, [ax for _, ax in row]


def cycles(report: tv.Report, curves: Curves) -> cv.Picture:
    """Draw measured and simulated cycles, a panel for each load."""
    canvas, axes = panels([f"{load:g} kg" for load in curves.loads], 300.0)
    both = tv.changed(report)
    lines = [(curves.base, cv.BASE), (curves.extended, cv.EXTENDED)][: 1 + both]
    for ax, load in zip(axes, curves.loads, strict=True):
        here = curves.load == load
        for row in curves.readings:
            ax.plot(curves.pressure[here], row[here], "o", color=cv.MEASURED, markersize=4.5)
        for path in np.unique(curves.path[here]):
            rows = here & (curves.path == path)
            for values, colour in lines:
                ax.plot(curves.pressure[rows], values[rows], color=colour, linewidth=1.5)
        ax.set_ylim(tv.limits([curves.readings, curves.base]))
    simulated = cv.legend_of(both, "simulation", "simulation before", "simulation after")
    canvas.legend([("dot", "readings", {"color": cv.MEASURED, "markersize": 5}), *simulated])
    return canvas.picture(
        "replay",
        f"contraction over pressure at {len(curves.loads)} loads, readings and simulation",
        "Inflation is the lower side of a loop, deflation the upper one; a good simulation passes "
        "through the dots.",
    )


def left_over(report: tv.Report, curves: Curves) -> cv.Picture:
    """Draw the mean readings less the simulation over pressure, a panel for each load."""
    canvas, axes = panels([f"{load:g} kg" for load in curves.loads], 210.0)
    both, noise = tv.changed(report), tv.floor(report, "contraction")
    rests = [curves.measured - curves.base, curves.measured - curves.extended][: 1 + both]
    box = tv.limits(rests, 0.1)
    for ax, load in zip(axes, curves.loads, strict=True):
        ax.axhline(0.0, color=cv.MUTED, linewidth=0.8)
        for edge in (-2.0 * noise, 2.0 * noise) if noise else ():
            ax.axhline(edge, color=cv.FLOOR, linewidth=1.4)
        for rest, colour in zip(rests, (cv.BASE, cv.EXTENDED), strict=False):
            curves.draw(ax, load, rest, color=colour, linewidth=1.5, marker=".", markersize=5)
        ax.set_ylim(box)
    word = f"measured {tv.MINUS}"
    legend = [
        *cv.legend_of(both, f"{word} simulated", f"{word} before", f"{word} after"),
        DEFLATING,
    ]
    if noise:
        legend.append(("line", f"±2 {tv.TIMES} noise floor", {"color": cv.FLOOR, "linewidth": 1.8}))
    canvas.legend(legend)
    return canvas.picture(
        "residual",
        "residual of the mean readings over pressure, by load and direction",
        "An offset of a panel is an error of the load, a gap between full and dashed line an error "
        "of the loop's width, a common bend an error of the static curve.",
    )


def cell_effects(report: tv.Report, curves: Curves) -> cv.Picture | None:
    """Draw the contribution of each named cause over pressure, a line for each load."""
    causes = [c for c in report.get("causes") or [] if c["name"] in curves.effects][:3]
    if not causes:
        return None
    canvas, axes = panels([c["name"].replace("_", " ") for c in causes], 220.0)
    shown = [curves.effects[c["name"]] for c in causes]
    shades = dict(zip(curves.loads, np.linspace(0.3, 1.0, len(curves.loads)), strict=True))
    for ax, values in zip(axes, shown, strict=True):
        ax.axhline(0.0, color=cv.MUTED, linewidth=0.8)
        for load, alpha in shades.items():
            curves.draw(ax, load, values, color=cv.EXTENDED, alpha=alpha, linewidth=1.8)
        ax.set_ylim(tv.limits(shown))
    legend: list[cv.Entry] = [
        ("line", f"{load:g} kg", {"color": cv.EXTENDED, "alpha": alpha, "linewidth": 2.2})
        for load, alpha in shades.items()
    ]
    canvas.legend([*legend, DEFLATING])
    return canvas.picture(
        "effects",
        "contribution over pressure of " + ", ".join(c["name"] for c in causes),
        "The extended simulation less the same simulation with this one cause switched off.",
    )
