"""The picture of a step and of the open-loop inverse, beside fluidic_muscles's Fig. 10 and 16."""

from __future__ import annotations

from typing import Any

import numpy as np

from baselines.joint.model import joint_model
from benchmarks.papers.joint_inverses import loop_path
from benchmarks.papers.joint_studies import DEGREE, FINE, HOLD, STEP, step, step_run
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint

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
SHOWN = 1.2
"""Seconds of the step that are shown."""


def step_figure() -> Any:
    """Return a figure: a step after a turn, and the muscles' loop with and without the inverse."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[1.5, 1.0])
    _steps(left)
    _loops(right)
    return figure


def _steps(ax: Any) -> None:
    begin, shown = round(2.0 * HOLD / FINE), round(SHOWN / FINE)
    time = np.arange(1, shown + 1) * FINE
    for name, (label, colour, style) in LINES.items():
        angle = step_run(name).angle[begin : begin + shown] / DEGREE
        text = f"{label}: rise {step(name).rise:.3f} s"
        ax.plot(time, angle, color=colour, linestyle=style, label=text)
    ax.axhline(STEP / DEGREE, color="0.25", linewidth=0.8, linestyle="--")
    ax.set_xlabel("time since the step [s]")
    ax.set_ylabel("angle [deg]")
    ax.set_title(
        "10 degrees after a turn, controllers at 10 ms\nreduced plant: symmetric Preisach operator"
        r" (assumed, loops of 10 %), then $23^2/(s+23)^2$",
        fontsize=9,
    )
    ax.grid(True, linewidth=0.3)
    ax.legend(loc="lower right", fontsize=8)


def _loops(ax: Any) -> None:
    joint = AntagonisticJoint.paper()
    model = joint_model(joint)
    for told, label, colour in (
        (model.narrowed(0.0), "straight line", "#009e73"),
        (model, "inverse of the identified hysteresis", "#d55e00"),
    ):
        wanted, reached = loop_path(joint, told, STEP)
        ax.plot(wanted / DEGREE, reached / DEGREE, color=colour, label=label)
    ax.set_xlabel("wanted angle [deg]")
    ax.set_ylabel("angle at rest [deg]")
    ax.set_title("open loop at 10 degrees,\njoint of two muscles", fontsize=9)
    ax.grid(True, linewidth=0.3)
    ax.legend(loc="upper left", fontsize=8)
