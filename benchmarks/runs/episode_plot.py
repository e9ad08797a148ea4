"""Figure of one episode. Matplotlib is imported when it is drawn."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np


def episode_figure(
    signals: Mapping[str, Any],
    set_points: Mapping[str, Any],
    title: str,
    shown: tuple[str, float] = ("mm", 1e3),
) -> Any:
    """Return a figure of an episode: tracking, error, setpoints and output over pressure.

    The last is left out if the pressure of a single muscle is not recorded.

    Parameters
    ----------
    signals : mapping of (n,) array
        Recorded ``info``, SI.
    set_points : mapping of (n,) array
        By name, SI: pressures, or angles.
    title : str
    shown : tuple of str and float
        Unit of the output, and its factor from SI.
    """
    from matplotlib.figure import Figure

    t, (unit, factor) = signals["time"], shown
    figure = Figure(figsize=(10.0, 6.0), layout="constrained")
    grid = figure.add_gridspec(3, 2, width_ratios=[2.0, 1.0], height_ratios=[2.0, 1.0, 1.2])
    columns = 0 if "state/pressure" in signals else slice(None)
    track = figure.add_subplot(grid[0, columns])
    error = figure.add_subplot(grid[1, columns], sharex=track)
    inputs = figure.add_subplot(grid[2, columns], sharex=track)
    track.plot(t, factor * signals["reference"], color="0.3", linestyle="--", label="reference")
    track.plot(t, factor * signals["output"], color="#0072b2", label="output")
    track.set_ylabel(f"output [{unit}]")
    track.legend(frameon=False, ncols=2)
    error.plot(t, factor * (signals["output"] - signals["reference"]), color="#d55e00")
    error.axhline(0.0, color="0.7", linewidth=0.6)
    error.set_ylabel(f"error [{unit}]")
    _draw_inputs(inputs, signals, set_points)
    if "state/pressure" in signals:
        loop = figure.add_subplot(grid[:, 1])
        loop.plot(1e-5 * signals["state/pressure"], factor * signals["output"], color="#0072b2")
        loop.set_xlabel("pressure [bar]")
        loop.set_ylabel(f"output [{unit}]")
        loop.set_title("loop")
    figure.suptitle(title)
    return figure


def _draw_inputs(axes: Any, signals: Mapping[str, Any], set_points: Mapping[str, Any]) -> None:
    """Draw set-points, and of a single muscle its pressure and drive."""
    angles = all(name.startswith("angle") for name in set_points)
    unit, factor = ("deg", np.rad2deg(1.0)) if angles else ("bar", 1e-5)
    single = {"color": "0.6"} if len(set_points) == 1 else {}
    for name, asked in set_points.items():
        label = "set-point" if single else name.replace("_set_point", "")
        axes.plot(signals["time"], factor * asked, linewidth=0.8, label=label, **single)
    for name, color, width in (("pressure", "#009e73", 1.5), ("drive", "#cc79a7", 0.8)):
        if f"state/{name}" in signals:
            pressure = 1e-5 * signals[f"state/{name}"]
            axes.plot(signals["time"], pressure, color=color, linewidth=width, label=name)
    axes.set_ylabel(f"{'angle' if angles else 'pressure'} [{unit}]")
    axes.set_xlabel("time [s]")
    axes.legend(frameon=False, ncols=3)
