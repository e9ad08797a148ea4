"""Counterparts of the papers' figures: a stride with the knee orthosis, a step of the joint.

yeh2010, Fig. 12 and 13; fluidic_muscles, Fig. 10 and 16.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from baselines.joint.model import joint_model
from benchmarks.papers.joint_hysteresis import loop_path
from benchmarks.papers.joint_studies import DEGREE, FINE, HOLD, STEP, step, step_run
from benchmarks.papers.published import as_published
from pam_envs.arrays import Array
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint

Signals = Mapping[str, Array]

STANCE = "#e8edf3"
DESIRED, OURS, PRESSURE, FREE = "0.25", "#0072b2", "#009e73", "#d55e00"
BAR, DEGREES = 1e-5, 180.0 / np.pi
LOOK_AFTER = 0.5
"""Seconds after a switch that contain its transient, as in the metrics."""


def spans(flags: Array, time: Array) -> list[tuple[float, float]]:
    """Return start and end time of each interval in which a flag is set."""
    edges = np.diff(np.concatenate([[0], (flags > 0.5).astype(int), [0]]))
    ends = np.append(time, 2.0 * time[-1] - time[-2])
    starts, stops = np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)
    return [(float(ends[a]), float(ends[b])) for a, b in zip(starts, stops, strict=True)]


def cut(signals: Signals, first: float, last: float) -> dict[str, Array]:
    """Return a record from one time [s] to another, with time 0 at its first heel contact."""
    time = signals["time"]
    kept = (time > first - 1e-9) & (time < last + 1e-9)
    made = {name: values[kept] for name, values in signals.items()}
    contact = np.flatnonzero(np.diff(made["state/stance"]) > 0.5)
    made["time"] = made["time"] - made["time"][contact[0] + 1]
    return made


def stride_figure(records: Sequence[Signals], titles: Sequence[str], title: str) -> Figure:
    """Return a figure with a column for each record: tension, angle, pressure, EMG proxy.

    A record is ``info`` in SI with ``set_point`` [Pa]; its ``time`` is 0 at a heel contact.
    """
    figure = Figure(figsize=(11.0, 10.0), layout="constrained")
    grid = figure.subplots(4, len(records), sharex=True, sharey="row", squeeze=False)
    for column, (signals, name) in enumerate(zip(records, titles, strict=True)):
        axes = grid[:, column]
        for draw, ax in zip((_tension, _angle, _pressure, _emg), axes, strict=True):
            _shade(ax, signals)
            draw(ax, signals)
        _phases(axes[0], signals)
        axes[0].set_title(name, fontweight="bold", pad=18.0)
        axes[-1].set_xlabel("time since heel contact [s]")
    for ax, (text, top, place) in zip(grid[:, 0], ROWS, strict=True):
        ax.set_ylabel(text)
        ax.set_ylim(top=top)
        ax.legend(loc=place, ncols=3, fontsize=8, framealpha=0.9)
    figure.suptitle(title, fontsize=10)
    return figure


ROWS = (
    ("tension of the\nmuscle [N]", 350.0, "upper right"),
    ("angle of the brace [deg],\nupwards: bent", 195.0, "upper right"),
    ("pressure [bar]", 5.6, "upper right"),
    ("EMG proxy of the\nextensors [% of largest]", 36.0, "upper right"),
)
"""Label, upper limit and legend position of each row."""


def _shade(ax: Any, signals: Signals) -> None:
    time = signals["time"]
    for begin, end in spans(signals["state/stance"], time):
        ax.axvspan(begin, end, color=STANCE, zorder=0)
        for edge in (begin, end):
            ax.axvline(edge, color="0.65", linewidth=0.8, zorder=1)
    ax.set_xlim(time[0], time[-1])
    ax.grid(True, linewidth=0.3)


def _phases(ax: Any, signals: Signals) -> None:
    """Write the phase of each span and its controlled quantity above the panel."""
    time, stance = signals["time"], signals["state/stance"]
    for flags, name in ((stance, "stance: tension"), (1.0 - stance, "swing: angle")):
        for begin, end in spans(flags, time):
            if end - begin > 0.2 * (time[-1] - time[0]):
                ax.text(0.5 * (begin + end), 1.02, name, transform=ax.get_xaxis_transform(),
                        ha="center", va="bottom", fontsize=8.5, color="0.35")  # fmt: skip


def _tension(ax: Any, signals: Signals) -> None:
    both = (signals["state/stance"] > 0.5) & (signals["sensor/stance"] > 0.5)
    desired = np.where(both, signals["reference"], np.nan)
    ax.plot(signals["time"], signals["output"], color=OURS, label="tension")
    ax.plot(signals["time"], desired, color=DESIRED, linestyle="--", label="desired in stance")
    at, error = after_switch(signals)
    ax.annotate(f"{error:.0f} N off\nafter the switch", xy=at, xytext=(3.6, 120.0), fontsize=9,
                ha="center", arrowprops={"arrowstyle": "->", "color": "0.3"})  # fmt: skip


def after_switch(signals: Signals) -> tuple[tuple[float, float], float]:
    """Return time [s], tension [N] and size [N] of the largest error after heel contact."""
    time, stance = signals["time"], signals["state/stance"] > 0.5
    looked = stance & (signals["sensor/stance"] > 0.5) & (time >= 0.0) & (time < LOOK_AFTER)
    error = np.where(looked, np.abs(signals["output"] - signals["reference"]), -1.0)
    at = int(np.argmax(error))
    return (float(time[at]), float(signals["output"][at])), float(error[at])


def _angle(ax: Any, signals: Signals) -> None:
    path = signals["state/angle"] - signals["state/deviation"]
    ax.plot(signals["time"], DEGREES * signals["state/angle"], color=OURS, label="angle")
    ax.plot(signals["time"], DEGREES * path, color=DESIRED, linestyle="--", label="wearer's path")


def _pressure(ax: Any, signals: Signals) -> None:
    time = signals["time"]
    ax.plot(time, BAR * signals["set_point"], color="0.55", linewidth=0.8, label="setpoint")
    ax.plot(time, BAR * signals["state/pressure"], color=PRESSURE, label="pressure")
    ax.axhline(4.5, color="0.4", linewidth=0.8, linestyle=":", label="capacity")


def _emg(ax: Any, signals: Signals) -> None:
    time = signals["time"]
    free, worn = signals["effort/extensors_free"], signals["effort/extensors"]
    ax.plot(time, 100.0 * free, color=FREE, linestyle="--", label="without orthosis")
    ax.plot(time, 100.0 * worn, color=OURS, label="with orthosis")
    plain, fitted = (reduction(signals, f"effort/extensors{{}}{kind}") for kind in KINDS)
    words = (
        f"RMS of this stride: {plain:+.0f} %\n(calibrated reading A: {fitted:+.0f} %;\n"
        "the paper's EMG: -36 %)"
    )
    ax.text(3.5, 26.0, words, ha="center", va="center", fontsize=9)


KINDS = ("", "_calibrated")


def reduction(signals: Signals, pattern: str, stride: float = 5.0) -> float:
    """Return the change [%] of a proxy's RMS over the stride that begins at 0."""
    time = signals["time"]
    kept = (time >= 0.0) & (time < stride)
    free, worn = (np.mean(signals[pattern.format(x)][kept] ** 2) for x in ("_free", ""))
    return 100.0 * float(np.sqrt(worn / free) - 1.0)


LINES = {
    "joint_mfc_mu": ("model-following, inverse", "#d55e00", "-"),
    "joint_mfc_mu_wrong": ("inverse 30 % too narrow", "#d55e00", "--"),
    "joint_mfc_mu_plain": ("without inverse", "#d55e00", ":"),
    "joint_pi": ("the same PI", "#009e73", "-"),
    "joint_pi_slow": ("slow PI", "0.5", "-"),
    "joint_pid": ("PID, SIMC", "#56b4e9", "-"),
    "joint_pid_smooth": ("PID, SIMC, as fast as the plant", "#56b4e9", "--"),
}
"""Label, colour and style of each controller."""
SHOWN_SECONDS = 1.2
"""Size of the step in the picture."""


def step_figure() -> Figure:
    """Return a figure of a step after a turn, and of the loop with and without the inverse."""
    figure = Figure(figsize=(11.0, 4.4), layout="constrained")
    ax, right = figure.subplots(1, 2, width_ratios=[1.5, 1.0])
    _draw_loops(right)
    begin, shown = round(2.0 * HOLD / FINE), round(SHOWN_SECONDS / FINE)
    time = np.arange(1, shown + 1) * FINE
    for name, (label, colour, style) in LINES.items():
        angle = step_run(name).angle[begin : begin + shown] / DEGREE
        text = f"{label}: rise {step(name).rise:.3f} s"
        ax.plot(time, angle, color=colour, linestyle=style, label=text)
    ax.axhline(STEP / DEGREE, color="0.25", linewidth=0.8, linestyle="--")
    title = (
        "10 degrees after a turn, controllers at 10 ms\nreduced plant: symmetric Preisach operator"
        r" (assumed, loops of 10 %), then $23^2/(s+23)^2$"
    )
    _label(ax, "time since the step [s]", "angle [deg]", title, "lower right")
    return figure


def _label(ax: Any, across: str, up: str, title: str, legend: str) -> None:
    ax.set_xlabel(across)
    ax.set_ylabel(up)
    ax.set_title(title, fontsize=9)
    ax.grid(True, linewidth=0.3)
    ax.legend(loc=legend, fontsize=8)


def _draw_loops(ax: Any) -> None:
    joint = as_published(AntagonisticJoint.paper("maxwell_slip"))
    model = joint_model(joint)
    for known, label, colour in (
        (model.narrowed(0.0), "straight line", "#009e73"),
        (model, "inverse of the identified hysteresis", "#d55e00"),
    ):
        desired, reached = loop_path(joint, known, STEP)
        ax.plot(desired / DEGREE, reached / DEGREE, color=colour, label=label)
    title = "open loop at 10 degrees,\njoint of two muscles"
    _label(ax, "desired angle [deg]", "angle at rest [deg]", title, "upper left")
