"""Figure of isolability: similarity of causes in a recording."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pam_envs.diagnosis.arrays import Array
from pam_envs.diagnosis.figures.canvas import (
    EXTENDED,
    GREY,
    INK,
    MUTED,
    PAPER,
    RULE,
    WIDTH,
    Canvas,
    Picture,
    square,
)
from pam_envs.diagnosis.figures.quantities import Report

NAMES, BARS = 190.0, 150.0
"""Width for the name of the last cause, and for the bars."""
TOP = 30.0


def isolability(report: Report) -> Picture | None:
    """Draw the cosines between effects, and the share of each that the refit absorbs."""
    found = report.get("isolability") or {}
    names = [str(n) for n in found.get("names") or []]
    if len(names) < 2:
        return None
    cosine = np.abs(np.array(found["cosine"], dtype=float))
    order = alike(cosine)
    names = [names[i] for i in order]
    side = len(names) * min(30.0, (WIDTH - NAMES - BARS) / len(names))
    canvas = Canvas(TOP + side + 8.0)
    cells(canvas.axes(0.0, TOP, side, side), cosine[np.ix_(order, order)], names)
    left = side + NAMES
    canvas.text(left, TOP - 10.0, "absorbed by the refit", fontsize=11.0, color=MUTED)
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
            square(ax, column, row, RULE, 0.4)
            if not np.isfinite(share):
                continue
            square(ax, column, row, EXTENDED, share)
            if share >= 0.3:
                label = f".{min(99, round(100 * share)):02d}"
                style = {"fontsize": 9.5, "color": PAPER if share > 0.75 else INK}
                ax.text(column + 0.5, row + 0.5, label, ha="center", va="center", **style)
        ax.text(row + 0.15, row + 0.5, name, fontsize=11.0, va="center", color=INK)
    ax.set_xlim(0, len(names))
    ax.set_ylim(len(names), 0)
    ax.set_axis_off()


def shares(ax: Any, absorbed: Report, names: Sequence[str]) -> None:
    """Draw a bar for each name."""
    for y, name in enumerate(names):
        share = absorbed.get(name)
        if share is None:
            continue
        ax.barh(y + 0.5, share, height=0.5, color=GREY)
        style = {"va": "center", "fontsize": 10.5, "color": MUTED}
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
