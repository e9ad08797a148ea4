"""Figures of the board and of single episodes. Matplotlib is imported when one is drawn."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks.metrics import headline_of
from benchmarks.rows import shown

COLOURS = {
    "nothing": "#7f7f7f",
    "tables": "#e69f00",
    "nominal model": "#0072b2",
    "true model": "#009e73",
}
"""Colour of what a controller knows (a palette that colour-blind readers can tell apart)."""

_FIXED: dict[str, Any] = {
    "svg.hashsalt": "benchmarks",
    "svg.fonttype": "path",
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
}


def error_against_effort(ordered: Sequence[Mapping[str, Any]]) -> str:
    """Return an SVG of headline error against pressure travel, the same bytes for equal rows.

    Parameters
    ----------
    ordered : sequence of rows
        Of one track.
    """
    import matplotlib
    from matplotlib.figure import Figure

    unit, _ = shown(ordered[0]["scenarios"]["content"])
    with matplotlib.rc_context(_FIXED):
        figure = Figure(figsize=(6.4, 4.0), layout="constrained")
        axes = figure.add_subplot()
        for row in ordered:
            _point(axes, row)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("pressure travel [bar/s]")
        axes.set_ylabel(f"RMS error [{unit}], mean and 95 % interval")
        axes.grid(True, which="both", linewidth=0.3)
        known = {row["controller"]["knowledge"] for row in ordered}
        for knowledge in (k for k in COLOURS if k in known):
            axes.plot([], [], "o", color=COLOURS[knowledge], label=f"knows {knowledge}")
        axes.legend(frameon=False)
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return "\n".join(line.rstrip() for line in buffer.getvalue().splitlines()) + "\n"


def _point(axes: Any, row: Mapping[str, Any]) -> None:
    content = row["scenarios"]["content"]
    head, effort = row["aggregate"][headline_of(content)], row["aggregate"]["pressure_travel"]
    _, factor = shown(content)
    x, y = max(1e-5 * effort["mean"], 1e-3), max(factor * head["mean"], 1e-4)
    bounds = factor * np.array([[head["mean"] - head["low"]], [head["high"] - head["mean"]]])
    colour = COLOURS.get(row["controller"]["knowledge"], "#000000")
    axes.errorbar(x, y, np.maximum(bounds, 0.0), fmt="o", markersize=4, color=colour, linewidth=1)
    axes.annotate(
        row["controller"]["name"], (x, y), textcoords="offset points", xytext=(5, 3), fontsize=6
    )


def episode_figure(signals: Mapping[str, Any], set_points: Any, title: str) -> Any:
    """Return a figure of an episode: tracking, error, pressures, and the loop they make.

    Parameters
    ----------
    signals : mapping of (n,) array
        Recorded ``info``, SI.
    set_points : (n,) array [Pa]
    title : str
    """
    from matplotlib.figure import Figure

    t, bar, mm = signals["time"], 1e-5, 1e3
    figure = Figure(figsize=(10.0, 6.0), layout="constrained")
    grid = figure.add_gridspec(3, 2, width_ratios=[2.0, 1.0], height_ratios=[2.0, 1.0, 1.2])
    track = figure.add_subplot(grid[0, 0])
    error = figure.add_subplot(grid[1, 0], sharex=track)
    pressures = figure.add_subplot(grid[2, 0], sharex=track)
    loop = figure.add_subplot(grid[:, 1])
    track.plot(t, mm * signals["reference"], color="0.3", linestyle="--", label="reference")
    track.plot(t, mm * signals["output"], color="#0072b2", label="output")
    track.set_ylabel("contraction [mm]")
    track.legend(frameon=False, ncols=2)
    error.plot(t, mm * (signals["output"] - signals["reference"]), color="#d55e00")
    error.axhline(0.0, color="0.7", linewidth=0.6)
    error.set_ylabel("error [mm]")
    pressures.plot(t, bar * set_points, color="0.6", linewidth=0.8, label="set-point")
    pressures.plot(t, bar * signals["state/pressure"], color="#009e73", label="pressure")
    pressures.plot(t, bar * signals["state/drive"], color="#cc79a7", linewidth=0.8, label="drive")
    pressures.set_ylabel("pressure [bar]")
    pressures.set_xlabel("time [s]")
    pressures.legend(frameon=False, ncols=3)
    loop.plot(bar * signals["state/pressure"], mm * signals["output"], color="#0072b2")
    loop.set_xlabel("pressure [bar]")
    loop.set_ylabel("contraction [mm]")
    loop.set_title("loop")
    figure.suptitle(title)
    return figure
