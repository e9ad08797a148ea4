"""Figures of a report's numbers: residual structure, rivals, errors by kind of segment."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from pam_envs.diagnosis.arrays import Array
from pam_envs.diagnosis.figures.canvas import (
    BASE,
    DASHES,
    EXTENDED,
    FLOOR,
    GREY,
    INK,
    LEGEND,
    MUTED,
    RIGHT,
    RISING,
    RULE,
    WIDTH,
    Canvas,
    Entry,
    Picture,
    legend_of,
)
from pam_envs.diagnosis.figures.quantities import (
    UNITS,
    Report,
    changed,
    floor,
    gain_to_floor,
    reported,
    short,
    value,
    written,
)

AGAINST = {
    "direction": "direction of motion",
    "rate": "rate of pressure",
    "pressure": "pressure",
    "load": "load",
    "time_since_reversal": "time since reversal",
    "time": "time since start",
    "temperature": "temperature",
    "cycle": "cycle number",
}
MOST_RIVALS = 14
LIMIT = {"color": FLOOR, "linewidth": 1.6, "linestyle": DASHES}
NOISE_FLOOR: Entry = ("line", "noise floor", LIMIT)


class Columns:
    """Names of rows on the left, one panel for each channel."""

    def __init__(self, names: Sequence[str], channels: Sequence[str], step: float) -> None:
        self.left, gap, top = 205.0, 46.0, LEGEND + 20.0
        width = (WIDTH - self.left - RIGHT - gap * (len(channels) - 1)) / len(channels)
        if len(channels) == 1:
            width = 0.72 * width
        height = step * len(names) + 10.0
        self.canvas = Canvas(top + height + 42.0)
        self.place = np.arange(float(len(names)))
        self.place[-1] += 0.3
        self.axes = {}
        for i, channel in enumerate(channels):
            left = self.left + i * (width + gap)
            self.canvas.title(left, top - 8.0, channel)
            ax = self.canvas.axes(left, top, width, height)
            ax.set_ylim(self.place[-1] + 0.6, -0.6)
            ax.set_yticks(self.place, names)
            ax.tick_params(labelleft=i == 0)
            ax.axhline(self.place[-1] - 0.65, color=RULE, linewidth=0.8)
            self.axes[channel] = ax


def structure(report: Report) -> Picture | None:
    """Draw the share of the residual that each variable explains."""
    sides = report.get("residual_structure") or {}
    before, after = sides.get("before") or {}, sides.get("after") or {}
    channels = reported(before)
    if not channels:
        return None
    names = [
        n for n in AGAINST if any((before[c].get("r2") or {}).get(n) is not None for c in channels)
    ]
    panels = Columns([*(AGAINST[n] for n in names), "all of these together"], channels, 26.0)
    both, most = changed(report), 0.1
    for channel, ax in panels.axes.items():
        bars = [(before, -0.19 if both else 0.0, BASE)]
        bars += [(after, 0.19, EXTENDED)] if both else []
        for side, offset, colour in bars:
            shares = _shares(side.get(channel) or {}, names)
            ax.barh(panels.place + offset, shares, height=0.36, color=colour)
            most = max(most, float(shares.max()))
        ax.grid(axis="y", visible=False)
        ax.set_xlabel("share of the residual's variance")
    for ax in panels.axes.values():
        ax.set_xlim(0.0, min(1.0, 1.08 * most))
    panels.canvas.legend(
        legend_of(True, "", "before", "after", "area") if both else [], panels.left
    )
    return panels.canvas.picture(
        "structure",
        f"share of the residual of {' and '.join(channels)} that each variable explains",
        "Share of the residual explained by each variable alone; the last row is a flexible model "
        "of all variables, an upper bound for any further cause.",
    )


def _shares(found: Report, names: Sequence[str]) -> Array:
    values = [(found.get("r2") or {}).get(n) for n in names] + [found.get("flexible_r2")]
    return np.array([max(v or 0.0, 0.0) for v in values])


def rivals(report: Report) -> Picture | None:
    """Draw the gains of the candidates, best first."""
    entries = list(report.get("rivals") or [])[:MOST_RIVALS]
    if not entries:
        return None
    causes = report.get("causes") or []
    named = {c["name"] for c in causes} | {(c["name"], c.get("form")) for c in causes}
    labels = _rival_labels(entries)
    step, left = 27.0, 250.0 if max(map(len, labels)) <= 34 else 320.0
    canvas = Canvas(LEGEND + step * len(entries) + 44.0)
    ax = canvas.axes(left, LEGEND, WIDTH - left - 60.0, step * len(entries))
    lows, highs = [0.0], [0.05]
    for i, rival in enumerate(entries):
        gain, (low, high) = _comparable(rival, entries[0], report)
        colour = _rival_colour(rival, named)
        ax.barh(i, gain, height=0.62, color=colour)
        ax.plot([low, high], [i, i], color=INK, linewidth=1.4, solid_capstyle="butt")
        style = {"va": "center", "fontsize": 11.0, "color": MUTED if colour == GREY else INK}
        end = (max(high, gain, 0.0), i)
        ax.annotate(written(gain), end, xytext=(6, 0), textcoords="offset points", **style)
        lows.append(min(low, gain))
        highs.append(end[0])
    most = gain_to_floor(report)
    if most is not None:
        ax.axvline(most, **LIMIT)
        highs.append(most)
    ax.axvline(0.0, color=MUTED, linewidth=0.8)
    ax.spines["left"].set_visible(False)
    ax.set_xlim(max(1.05 * min(lows), -0.3 * max(highs)), 1.04 * max(highs))
    ax.set_ylim(len(entries) - 0.4, -0.6)
    ax.set_yticks(range(len(entries)), [short(text, int(left / 7.2)) for text in labels])
    for label, rival in zip(ax.get_yticklabels(), entries, strict=True):
        label.set_color(MUTED if _rival_colour(rival, named) == GREY else INK)
    ax.grid(axis="y", visible=False)
    ax.set_xlabel("gain on held-out segments: ln(mean square before / after), summed over outputs")
    canvas.legend(_rival_legend(entries, named, most), left)
    return canvas.picture(
        "rivals",
        "gain of the candidates, in the order of the decision: "
        + ", ".join(r["name"] for r in entries[:5]),
        "Gain of each candidate on held-out data, fitted together with the base parameters, with "
        "its confidence interval; the order is that of the decision, on blocks of the whole "
        "recording. The dashed line is the gain of a model that leaves only noise.",
    )


def _rival_labels(entries: Sequence[Report]) -> list[str]:
    """Return names, or forms if several forms of a cause compete."""
    names = [r["name"] for r in entries]
    return [
        r["name"].replace("_", " ") if names.count(r["name"]) == 1 else r.get("form") or r["name"]
        for r in entries
    ]


def _spread(gain: Any, middle: float) -> tuple[float, float]:
    low, high = (gain.get("interval") or [None, None])[:2]
    return (middle if low is None else float(low), middle if high is None else float(high))


def _comparable(rival: Report, best: Report, report: Report) -> tuple[float, tuple[float, float]]:
    """Return a gain with its interval, converted if it is of other held-out data."""
    where = (report.get("held_out") or {}).get("by")
    if rival.get("held_out", where) == where or rival.get("behind") is None:
        gain = value(rival["gain"]) or 0.0
        return gain, _spread(rival["gain"], gain)
    top, behind = value(best["gain"]) or 0.0, value(rival["behind"]) or 0.0
    low, high = _spread(rival["behind"], behind)
    return top - behind, (top - high, top - low)


def _rival_colour(rival: Report, named: set[Any]) -> str:
    """Return the colour of a rival: named, not excluded, or excluded."""
    forms = {n[1] for n in named if isinstance(n, tuple) and n[0] == rival["name"]}
    parts = set(re.split(r"\s*[+,]\s*", rival["name"]))
    if parts <= named and (not forms or rival.get("form") in forms):
        return EXTENDED
    return RISING if rival.get("why") == "not excluded" else GREY


def _rival_legend(entries: Sequence[Report], named: set[Any], most: float | None) -> list[Entry]:
    labels = {EXTENDED: "named", RISING: "not excluded", GREY: "excluded: see the table"}
    present = {_rival_colour(r, named) for r in entries}
    legend: list[Entry] = [("area", labels[c], {"facecolor": c}) for c in labels if c in present]
    return legend if most is None else [*legend, NOISE_FLOOR]


def kinds(report: Report) -> Picture | None:
    """Draw the error on each held-out kind of segment."""
    before, after = report.get("error_before") or {}, report.get("error_after") or {}
    channels = reported(before)
    names = list(dict.fromkeys(k for c in channels for k in before[c].get("kinds") or {}))
    if not names:
        return None
    panels = Columns([*(short(n, 28) for n in names), "all held out"], channels, 30.0)
    both = changed(report)
    for channel, ax in panels.axes.items():
        old = _errors(before.get(channel), names)
        new = _errors(after.get(channel) if both else None, names)
        for y, a, b in zip(panels.place, old, new, strict=True):
            ax.plot([a, b], [y, y], color=MUTED, linewidth=1.6, zorder=2)
        ax.plot(old, panels.place, "o", color=BASE, markersize=9, zorder=3)
        ax.plot(new, panels.place, "o", color=EXTENDED, markersize=9, zorder=3)
        noise = floor(report, channel)
        if noise is not None:
            ax.axvline(noise, **LIMIT)
        errors = np.array([*old, *new, noise or 0.0])
        ax.set_xlim(0.0, 1.08 * np.nanmax(errors) or 1.0)
        ax.set_xlabel(f"error [{UNITS[channel][0]} RMS]")
    legend = legend_of(both, "error", "before", "after", "dot")
    panels.canvas.legend([*legend, NOISE_FLOOR], panels.left)
    return panels.canvas.picture(
        "kinds",
        f"held-out error by kind of segment: {', '.join(names)}",
        f"Errors on held-out data{' before and after the extension' if both else ''}; the dashed "
        "line is the noise floor.",
    )


def _errors(quantity: Report | None, names: Sequence[str]) -> Array:
    if not quantity:
        return np.full(len(names) + 1, np.nan)
    found = quantity.get("kinds") or {}
    values = [value(found.get(n)) for n in names] + [value(quantity)]
    return np.array([np.nan if v is None else v for v in values])
