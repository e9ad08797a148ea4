"""Figures of the board. Matplotlib is imported when one is drawn."""

import io
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.board import accessors as views
from benchmarks.board import standings
from benchmarks.runs.rows import Row
from benchmarks.scoring import statistics

_FIXED: dict[str, Any] = {
    "svg.hashsalt": "benchmarks",
    "svg.fonttype": "none",
    "font.family": ["DejaVu Sans"],
    "font.size": 8.0,
}
POINTS = 60  # number of errors at which a performance profile is evaluated
MARKS = {"classical": "o", "residual": "D", "learned": "s"}
DRAWN = 8
"""Number of classical controllers that are drawn, the best of a track, with all learned ones."""


def track_figure(ordered: Sequence[Row]) -> str:
    """Return an SVG of a track: error against effort, performance profiles; equal bytes."""
    import matplotlib
    from matplotlib.figure import Figure

    drawn = drawn_rows(ordered)
    with matplotlib.rc_context(_FIXED):
        figure = Figure(figsize=(9.6, 3.6), layout="constrained")
        effort, share = figure.subplots(1, 2)
        _draw_effort(effort, drawn)
        _draw_profiles(share, drawn)
        effort.set_title(f"{views.published_split(drawn[0])} episodes", loc="left", fontsize=8.0)
        figure.legend(*share.get_legend_handles_labels(), loc="outside right center", frameon=False)
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    paths = re.sub(r' d="[^"]*"', _rounded, buffer.getvalue())
    return "\n".join(line.rstrip() for line in paths.splitlines()) + "\n"


def _rounded(path: re.Match[str]) -> str:
    """Return a path with its coordinates to a tenth of a pixel, on one line."""
    words = (f"{float(w):.1f}".removesuffix(".0") if "." in w else w for w in path[0].split())
    return " " + " ".join(words)


def drawn_rows(ordered: Sequence[Row]) -> list[Row]:
    """Return the rows of a track that are drawn, best first."""
    inside = standings.ordered(standings.listing(ordered).inside)
    best = [row["row"] for row in inside if views.is_classical(row)][:DRAWN]
    return [row for row in inside if not views.is_classical(row) or row["row"] in best]


def _style(number: int, row: Row) -> dict[str, Any]:
    return {"color": f"C{number % 10}", "linestyle": "-" if views.is_classical(row) else "--"}


def _draw_effort(axes: Any, drawn: Sequence[Row]) -> None:
    unit, factor = views.unit_of(drawn[0])
    for number, row in enumerate(drawn):
        head = views.interval(row)
        x, y = 1e-5 * views.mean_of(row, "pressure_travel"), factor * head.value
        bounds = factor * np.array([[head.value - head.low], [head.high - head.value]])
        mark, color = MARKS.get(row["controller"]["kind"], "s"), _style(number, row)["color"]
        given = np.maximum(bounds, 0.0)
        axes.errorbar(x, y, given, fmt=mark, markersize=5, linewidth=1, color=color)
    _plain_log(axes.yaxis)
    axes.set_xlabel("pressure travel [bar/s]")
    axes.set_ylabel(f"RMS [{unit}], mean and 95 % interval")


def _draw_profiles(axes: Any, drawn: Sequence[Row]) -> None:
    unit, factor = views.unit_of(drawn[0])
    scores = [views.scores(row) for row in drawn]
    values = np.concatenate([found.table.ravel() for found in scores])
    positive = values[np.isfinite(values) & (values > 0.0)]
    errors = np.ones(1)
    if len(positive):
        errors = np.geomspace(positive.min(), positive.max(), POINTS)
    for number, (row, found) in enumerate(zip(drawn, scores, strict=True)):
        shares = statistics.performance_profile(found.table, errors)
        band = statistics.profile_band(found.table, found.strata, errors)
        label, style = row["controller"]["name"], _style(number, row)
        axes.plot(factor * errors, 100.0 * shares, linewidth=1.1, label=label, **style)
        bounds = {"facecolor": style["color"], "alpha": 0.12, "linewidth": 0.0}
        axes.fill_between(factor * errors, *(100.0 * band), **bounds)
    _plain_log(axes.xaxis)
    axes.set_xlabel(f"RMS of an episode [{unit}]")
    axes.set_ylabel("episodes with at most this RMS [%], 95 % band")


def _plain_log(axis: Any) -> None:
    """Make an axis logarithmic, its ticks plain numbers."""
    from matplotlib import ticker

    axis.axes.set(**{f"{axis.axis_name}scale": "log"})
    axis.set_major_locator(ticker.LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(ticker.NullLocator())
    axis.axes.grid(True, linewidth=0.3)
