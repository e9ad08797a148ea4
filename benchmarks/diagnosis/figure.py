"""Figure of the diagnosis benchmark: confusion matrix and detection curve."""

import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.diagnosis.counts import CURVE, VERDICTS, Numbers
from tests.diagnosis.hidden import EFFECTS


def picture(made: Numbers) -> bytes:
    """Return the confusion matrix and the detection curve as PNG."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context({"font.family": "DejaVu Sans", "font.size": 7.0}):
        drawn = Figure(figsize=(13.0, 6.4), dpi=120, layout="constrained")
        left, right = drawn.subplots(1, 2, width_ratios=[1.25, 1.0])
        _draw_confusion(left, made["confusion"])
        _draw_curve(right, made["curve"])
        buffer = io.BytesIO()
        drawn.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def _draw_confusion(axes: Any, found: Numbers) -> None:
    columns = [*EFFECTS, *VERDICTS[2:]]
    counts = np.array([[found[row].get(c, 0) for c in columns] for row in EFFECTS], float)
    totals = np.maximum(counts.sum(axis=1, keepdims=True), 1.0)
    axes.imshow(counts / totals, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for (i, j), n in np.ndenumerate(counts):
        if n:
            colour = "white" if n > 0.6 * totals[i, 0] else "black"
            axes.text(j, i, f"{n:.0f}", ha="center", va="center", color=colour, fontsize=5.5)
    labels = [name.replace("_", " ") for name in columns]
    axes.set_xticks(range(len(columns)), labels, rotation=90)
    axes.set_yticks(range(len(EFFECTS)), labels[: len(EFFECTS)])
    axes.axvline(len(EFFECTS) - 0.5, color="0.5", linewidth=0.8)
    axes.set_xlabel("first cause, or the verdict where none is named")
    axes.set_ylabel("hidden, size 1 to 5")


def _draw_curve(axes: Any, bins: Sequence[Numbers]) -> None:
    styles = {
        "detected": ("#7f7f7f", "model error detected"),
        "right_first": ("#0072b2", "correct name first"),
        "exact": ("#009e73", "correct and unambiguous"),
        "wrong": ("#d55e00", "wrong name"),
    }
    for k, (key, (colour, label)) in enumerate(styles.items()):
        known = [c for c in bins if c[key]["n"]]
        if not known:
            continue
        x = np.array([np.sqrt(c["low"] * c["high"]) for c in known]) * (1.0 + 0.015 * (k - 1.5))
        y = np.array([c[key]["value"] for c in known])
        ends = np.array([c[key]["interval"] for c in known]).T
        reach = np.maximum(np.abs(ends - y), 0.0)
        axes.errorbar(x, y, reach, fmt="o-", color=colour, label=label, linewidth=1, markersize=3)
    axes.set_xscale("log")
    axes.set_xticks(CURVE, [f"{edge:g}" for edge in CURVE])
    axes.minorticks_off()
    axes.set_ylim(-0.02, 1.02)
    axes.set_xlabel("size of the hidden effect, over the noise")
    axes.set_ylabel("share of the cases, 95 % interval")
    axes.grid(True, linewidth=0.3)
    if any(c["exact"]["n"] for c in bins):
        axes.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4)
