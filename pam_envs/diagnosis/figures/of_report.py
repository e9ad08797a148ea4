"""Figures of a report: residual structure, rivals, errors by kind of segment, isolability."""

import re
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from pam_envs.arrays import Array
from pam_envs.diagnosis.figures import canvas as cv
from pam_envs.diagnosis.figures import quantities as tv

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
NAMES, BARS = 190.0, 150.0  # width for the name of the last cause, and for the bars
TOP = 30.0
LIMIT = {"color": cv.FLOOR, "linewidth": 1.6, "linestyle": cv.DASHES}
NOISE_FLOOR: cv.Entry = ("line", "noise floor", LIMIT)


class Columns:
    """Names of rows on the left, one panel for each channel."""

    def __init__(self, names: Sequence[str], channels: Sequence[str], step: float) -> None:
        self.left, gap, top = 205.0, 46.0, cv.LEGEND + 20.0
        width = (cv.WIDTH - self.left - cv.RIGHT - gap * (len(channels) - 1)) / len(channels)
        if len(channels) == 1:
            width = 0.72 * width
        height = step * len(names) + 10.0
        self.canvas = cv.Canvas(top + height + 42.0)
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
            ax.axhline(self.place[-1] - 0.65, color=cv.RULE, linewidth=0.8)
            self.axes[channel] = ax


def structure(report: tv.Report) -> cv.Picture | None:
    """Draw the share of the residual that each variable explains."""
    sides = report.get("residual_structure") or {}
    before, after = sides.get("before") or {}, sides.get("after") or {}
    channels = tv.reported(before)
    if not channels:
        return None
    own = [n for c in channels for n in before[c].get("r2") or {} if n not in AGAINST]
    against = {**AGAINST, **{n: n.replace("_", " ") for n in own}}
    names = [
        n for n in against if any((before[c].get("r2") or {}).get(n) is not None for c in channels)
    ]
    panels = Columns([*(against[n] for n in names), "all of these together"], channels, 26.0)
    both, most = tv.changed(report), 0.1
    for channel, ax in panels.axes.items():
        bars = [(before, -0.19 if both else 0.0, cv.BASE)]
        bars += [(after, 0.19, cv.EXTENDED)] if both else []
        for side, offset, colour in bars:
            shares = _shares(side.get(channel) or {}, names)
            ax.barh(panels.place + offset, shares, height=0.36, color=colour)
            most = max(most, float(shares.max()))
        ax.grid(axis="y", visible=False)
        ax.set_xlabel("share of the residual's variance")
    for ax in panels.axes.values():
        ax.set_xlim(0.0, min(1.0, 1.08 * most))
    panels.canvas.legend(
        cv.legend_of(True, "", "before", "after", "area") if both else [], panels.left
    )
    return panels.canvas.picture(
        "structure",
        f"share of the residual of {' and '.join(channels)} that each variable explains",
        "Share of the residual explained by each variable alone; the last row is a flexible model "
        "of all variables, an upper bound for any further cause.",
    )


def _shares(found: tv.Report, names: Sequence[str]) -> Array:
    values = [(found.get("r2") or {}).get(n) for n in names] + [found.get("flexible_r2")]
    return np.array([max(v or 0.0, 0.0) for v in values])


def rivals(report: tv.Report) -> cv.Picture | None:
    """Draw the gains of the candidates, best first."""
    entries = list(report.get("rivals") or [])[:MOST_RIVALS]
    if not entries:
        return None
    causes = report.get("causes") or []
    named = {c["name"] for c in causes} | {(c["name"], c.get("form")) for c in causes}
    count = Counter(r["name"] for r in entries)
    labels = [
        r["name"].replace("_", " ") if count[r["name"]] == 1 else r.get("form") or r["name"]
        for r in entries  # a form where several of a cause compete
    ]
    step, left = 27.0, 250.0 if max(map(len, labels)) <= 34 else 320.0
    canvas = cv.Canvas(cv.LEGEND + step * len(entries) + 44.0)
    ax = canvas.axes(left, cv.LEGEND, cv.WIDTH - left - 60.0, step * len(entries))
    lows, highs = [0.0], [0.05]
    for i, rival in enumerate(entries):
        gain, (low, high) = _comparable(rival, entries[0], report)
        colour = _rival_colour(rival, named)
        ax.barh(i, gain, height=0.62, color=colour)
        ax.plot([low, high], [i, i], color=cv.INK, linewidth=1.4, solid_capstyle="butt")
        style = {
            "va": "center",
            "fontsize": 11.0,
            "color": cv.MUTED if colour == cv.GREY else cv.INK,
        }
        end = (max(high, gain, 0.0), i)
        ax.annotate(tv.written(gain), end, xytext=(6, 0), textcoords="offset points", **style)
        lows.append(min(low, gain))
        highs.append(end[0])
    most = tv.gain_to_floor(report)
    if most is not None:
        ax.axvline(most, **LIMIT)
        highs.append(most)
    ax.axvline(0.0, color=cv.MUTED, linewidth=0.8)
    ax.spines["left"].set_visible(False)
    ax.set_xlim(max(1.05 * min(lows), -0.3 * max(highs)), 1.04 * max(highs))
    ax.set_ylim(len(entries) - 0.4, -0.6)
    ax.set_yticks(range(len(entries)), [tv.short(text, int(left / 7.2)) for text in labels])
    for label, rival in zip(ax.get_yticklabels(), entries, strict=True):
        label.set_color(cv.MUTED if _rival_colour(rival, named) == cv.GREY else cv.INK)
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


def _spread(gain: Any, middle: float) -> tuple[float, float]:
    low, high = (gain.get("interval") or [None, None])[:2]
    return (middle if low is None else float(low), middle if high is None else float(high))


def _comparable(
    rival: tv.Report, best: tv.Report, report: tv.Report
) -> tuple[float, tuple[float, float]]:
    """Return a gain with its interval, converted if it is of other held-out data."""
    where = (report.get("held_out") or {}).get("by")
    if rival.get("held_out", where) == where or rival.get("behind") is None:
        gain = tv.value(rival["gain"]) or 0.0
        return gain, _spread(rival["gain"], gain)
    top, behind = tv.value(best["gain"]) or 0.0, tv.value(rival["behind"]) or 0.0
    low, high = _spread(rival["behind"], behind)
    return top - behind, (top - high, top - low)


def _rival_colour(rival: tv.Report, named: set[Any]) -> str:
    """Return the colour of a rival: named, not excluded, or excluded."""
    forms = {n[1] for n in named if isinstance(n, tuple) and n[0] == rival["name"]}
    parts = set(re.split(r"\s*[+,]\s*", rival["name"]))
    if parts <= named and (not forms or rival.get("form") in forms):
        return cv.EXTENDED
    return cv.RISING if rival.get("why") == "not excluded" else cv.GREY


def _rival_legend(
    entries: Sequence[tv.Report], named: set[Any], most: float | None
) -> list[cv.Entry]:
    labels = {cv.EXTENDED: "named", cv.RISING: "not excluded", cv.GREY: "excluded: see the table"}
    present = {_rival_colour(r, named) for r in entries}
    legend: list[cv.Entry] = [("area", labels[c], {"facecolor": c}) for c in labels if c in present]
    return legend if most is None else [*legend, NOISE_FLOOR]


def kinds(report: tv.Report) -> cv.Picture | None:
    """Draw the error on each held-out kind of segment."""
    before, after = report.get("error_before") or {}, report.get("error_after") or {}
    channels = tv.reported(before)
    names = list(dict.fromkeys(k for c in channels for k in before[c].get("kinds") or {}))
    if not names:
        return None
    panels = Columns([*(tv.short(n, 28) for n in names), "all held out"], channels, 30.0)
    both = tv.changed(report)
    for channel, ax in panels.axes.items():
        old = _errors(before.get(channel), names)
        new = _errors(after.get(channel) if both else None, names)
        for y, a, b in zip(panels.place, old, new, strict=True):
            ax.plot([a, b], [y, y], color=cv.MUTED, linewidth=1.6, zorder=2)
        ax.plot(old, panels.place, "o", color=cv.BASE, markersize=9, zorder=3)
        ax.plot(new, panels.place, "o", color=cv.EXTENDED, markersize=9, zorder=3)
        noise = tv.floor(report, channel)
        if noise is not None:
            ax.axvline(noise, **LIMIT)
        errors = np.array([*old, *new, noise or 0.0])
        ax.set_xlim(0.0, 1.08 * np.nanmax(errors) or 1.0)
        ax.set_xlabel(f"error [{before[channel].get('unit')} RMS]")
    legend = cv.legend_of(both, "error", "before", "after", "dot")
    panels.canvas.legend([*legend, NOISE_FLOOR], panels.left)
    return panels.canvas.picture(
        "kinds",
        f"held-out error by kind of segment: {', '.join(names)}",
        f"Errors on held-out data{' before and after the extension' if both else ''}; the dashed "
        "line is the noise floor.",
    )


def _errors(quantity: tv.Report | None, names: Sequence[str]) -> Array:
    if not quantity:
        return np.full(len(names) + 1, np.nan)
    found = quantity.get("kinds") or {}
    values = [tv.value(found.get(n)) for n in names] + [tv.value(quantity)]
    return np.array([np.nan if v is None else v for v in values])


def isolability(report: tv.Report) -> cv.Picture | None:
    """Draw the cosines between effects, and the share of each that the refit absorbs."""
    found = report.get("isolability") or {}
    names = [str(n) for n in found.get("names") or []]
    if len(names) < 2:
        return None
    cosine = np.abs(np.array(found["cosine"], dtype=float))
    order = alike(cosine)
    names = [names[i] for i in order]
    side = len(names) * min(30.0, (cv.WIDTH - NAMES - BARS) / len(names))
    canvas = cv.Canvas(TOP + side + 8.0)
    cells(canvas.axes(0.0, TOP, side, side), cosine[np.ix_(order, order)], names)
    left = side + NAMES
    canvas.text(left, TOP - 10.0, "absorbed by the refit", fontsize=11.0, color=cv.MUTED)
    shares(canvas.axes(left, TOP, BARS - 20.0, side), found.get("absorbed") or {}, names)
    return canvas.picture(
        "isolability",
        f"similarity of the effects of {len(names)} causes in this recording",
        "Cosine between the effects of two causes after a refit of the base parameters (1: not "
        "separable on this recording); the bars show the share of an effect that the refit "
        "absorbs.",
    )


def cells(ax: Any, cosine: Array, names: Sequence[str]) -> None:
    """Fill the lower triangle and write the names along the diagonal."""
    for row, name in enumerate(names):
        for column in range(row):
            share = float(min(cosine[row, column], 1.0))
            cv.square(ax, column, row, cv.RULE, 0.4)
            if not np.isfinite(share):
                continue
            cv.square(ax, column, row, cv.EXTENDED, share)
            if share >= 0.3:
                label = f".{min(99, round(100 * share)):02d}"
                style = {"fontsize": 9.5, "color": cv.PAPER if share > 0.75 else cv.INK}
                ax.text(column + 0.5, row + 0.5, label, ha="center", va="center", **style)
        ax.text(row + 0.15, row + 0.5, name, fontsize=11.0, va="center", color=cv.INK)
    ax.set_xlim(0, len(names))
    ax.set_ylim(len(names), 0)
    ax.set_axis_off()


def shares(ax: Any, absorbed: tv.Report, names: Sequence[str]) -> None:
    """Draw a bar for each name."""
    for y, name in enumerate(names):
        share = absorbed.get(name)
        if share is None:
            continue
        ax.barh(y + 0.5, share, height=0.5, color=cv.GREY)
        style = {"va": "center", "fontsize": 10.5, "color": cv.MUTED}
        place = {"xytext": (5, 0), "textcoords": "offset points"}
        ax.annotate(f"{100 * share:.0f} %", (share, y + 0.5), **place, **style)
    ax.set_xlim(0.0, 1.35)
    ax.set_ylim(len(names), 0)
    ax.set_axis_off()


def alike(cosine: Array) -> list[int]:
    """Return the order that puts similar causes side by side, of a similarity (n, n) from 0 to 1.

    Order along the second eigenvector of the graph Laplacian (Fiedler vector), which keeps
    strongly connected nodes close together.
    """
    weight = np.nan_to_num((cosine + cosine.T) / 2.0) ** 2
    np.fill_diagonal(weight, 0.0)
    _, vectors = np.linalg.eigh(np.diag(weight.sum(axis=1)) - weight)
    along = vectors[:, 1] if len(cosine) > 2 else np.arange(float(len(cosine)))
    along = along * (1.0 if along[0] <= along[-1] else -1.0)
    return [int(i) for i in np.argsort(along.round(9), kind="stable")]
