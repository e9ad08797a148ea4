"""Picture of predicted against measured figures; imports matplotlib."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pam_envs.rig.comparison.figures import FIGURES
from pam_envs.rig.comparison.rows import Row

SIDE, DPI, COLUMNS = 4.2, 130, 3
BLUE, GREY = "#0072b2", "#9aa1ab"
ROOM = 1.35
"""Factor of the axes beyond the extreme figures."""


def write(rows: Sequence[Row], file: Path) -> None:
    """Write a picture with a panel for each figure.

    Raises
    ------
    ImportError
        Without matplotlib.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ImportError("a picture needs matplotlib: pip install 'pam-envs[plot]'") from error
    names = [name for name in FIGURES if any(row.figure == name for row in rows)]
    wide = min(COLUMNS, len(names))
    high = -(-len(names) // wide)
    figure = Figure(figsize=(SIDE * wide, SIDE * high), layout="constrained")
    panels = figure.subplots(high, wide, squeeze=False).ravel()
    for axes, name in zip(panels, names, strict=False):
        _panel(axes, name, [row for row in rows if row.figure == name])
    for axes in panels[len(names) :]:
        axes.set_visible(False)
    figure.savefig(file, dpi=DPI)


def _panel(axes: Any, name: str, rows: Sequence[Row]) -> None:
    """Draw predicted against measured values with prediction intervals and the identity."""
    drawn = [row for row in rows if math.isfinite(row.predicted)]
    values = [v for row in drawn for v in (row.predicted, row.high, row.measured)]
    values += [row.low for row in drawn if row.low > 0.0]
    positive = [v for v in values if v > 0.0] or [1.0]
    ends = min(positive) / ROOM, max(positive) * ROOM
    axes.plot(ends, ends, color=GREY, linewidth=1.0)
    for row in drawn:
        reach = [[row.predicted - max(row.low, ends[0])], [row.high - row.predicted]]
        axes.errorbar(row.measured, row.predicted, yerr=reach, fmt="o", color=BLUE, capsize=3)
        axes.annotate(
            f"{row.controller}, {row.condition.load:g} kg",
            (row.measured, row.predicted),
            xytext=(5, 5),
            textcoords="offset points",
            fontsize=7,
        )
    axes.set(xscale="log", yscale="log", xlim=ends, ylim=ends, aspect="equal", title=name)
    unit = FIGURES[name].unit
    axes.set(xlabel=f"measured [{unit}]", ylabel=f"predicted [{unit}]")
