"""Published figures beside ours, each with its tolerance."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SEED = "positioning2021"
MM, BAR = 1e3, 1e-5

WIDTHS: dict[float, tuple[float, float]] = {0.0: (3.29, 3.5), 2.55: (2.82, 4.5), 4.55: (2.40, 3.5)}
"""Load [kg]: largest loop width [mm] and the pressure of it [bar] (positioning2021, section 4)."""

SIMULATED = 0.3
"""Tolerance [mm] of an identified plant's loop width where the measured loop is widest."""


@dataclass(frozen=True)
class Figure:
    """One published figure beside ours.

    Attributes
    ----------
    name, source, unit : str
    published : float
        What the paper prints; NaN where it prints nothing.
    ours : float or None
        ``None`` if it cannot be computed; ``note`` says why.
    tolerance : float or None
        Largest absolute difference from ``expected``, or from ``published`` where nothing else is
        expected; ``None`` if it is not judged so.
    note : str
    expected : float, optional
        Computed beforehand from the paper's own equations by another program.
    at_most, at_least : float, optional
        Bounds on ours.
    given : bool
        Whether ours was chosen to be so: an input, which is shown and never judged.
    why : str
        Of one that is out of tolerance and known to be: the reason.
    """

    name: str
    source: str
    unit: str
    published: float
    ours: float | None
    tolerance: float | None
    note: str = ""
    expected: float | None = None
    at_most: float | None = None
    at_least: float | None = None
    given: bool = False
    why: str = ""

    @property
    def passed(self) -> bool | None:
        """Whether ours is within tolerance and bounds; ``None`` if it is not judged."""
        if self.ours is None or self.given:
            return None
        checks = list[bool]()
        if self.tolerance is not None:
            wanted = self.published if self.expected is None else self.expected
            checks.append(abs(self.ours - wanted) <= self.tolerance)
        if self.at_most is not None:
            checks.append(self.ours <= self.at_most)
        if self.at_least is not None:
            checks.append(self.ours >= self.at_least)
        return all(checks) if checks else None

    @property
    def judged_by(self) -> str:
        """The tolerance and the bounds, as the table shows them."""
        if self.given:
            return ""
        words = [] if self.tolerance is None else [f"+-{self.tolerance:.2g}"]
        words += [] if self.at_least is None else [f">= {self.at_least:.4g}"]
        words += [] if self.at_most is None else [f"<= {self.at_most:.4g}"]
        return ", ".join(words)

    @property
    def verdict(self) -> str:
        """What the table says of it."""
        if self.ours is None:
            return "not computed"
        if self.given:
            return "input"
        missed = "MISSED" if self.tolerance is None or self.why else "FAIL"
        return {True: "pass", False: missed, None: "reported"}[self.passed]

    @property
    def remark(self) -> str:
        """The note, and behind it the reason where it is missed."""
        reason = f"does not reproduce: {self.why}" if self.passed is False and self.why else ""
        return "; ".join(text for text in (self.note, reason) if text)

    def record(self) -> dict[str, Any]:
        """Return the figure as plain data."""
        return {**asdict(self), "passed": self.passed}


def loop_width(pressure: Array, contraction: Array) -> tuple[Array, Array]:
    """Return pressures [Pa] and widths [m] of a loop that goes up and down the same pressures.

    Parameters
    ----------
    pressure, contraction : (2 n - 1,) array
        In the order of the path, the turning point once.
    """
    n = len(pressure) // 2
    return pressure[: n + 1], contraction[::-1][: n + 1] - contraction[: n + 1]


def measured_widths() -> list[Figure]:
    """Largest width of the mean loops in the tables."""
    from pam_envs.data.tables import load_contraction_table

    table, figures = load_contraction_table(), list[Figure]()
    for load, (width, where) in WIDTHS.items():
        pressure, widths = loop_width(*table.means(load))
        best = int(np.argmax(widths))
        name = f"tables, {load:g} kg: largest loop width"
        figures += [
            Figure(name, f"{SEED}, section 4", "mm", width, MM * float(widths[best]), 0.005),
            Figure(f"{name}, at", SEED, "bar", where, BAR * float(pressure[best]), 1e-6),
        ]
    return figures


def simulated_loop(hysteresis: str, load: float, hold_seconds: float = 3.0) -> tuple[Array, Array]:
    """Return the quasi-static loop of an identified plant, 0 to 6 bar and back by half a bar.

    Parameters
    ----------
    hysteresis : {"maxwell_slip", "preisach"}
    load : float [kg]
    hold_seconds : float [s]
        At each pressure; the state at its end is taken.

    Returns
    -------
    pressure, contraction : (25,) array
        [Pa] and [m], noise-free.
    """
    from benchmarks.runs.cells import make_env

    up = np.arange(0.0, 6.01e5, 0.5e5)
    path = np.concatenate([up, up[-2::-1]])
    steps = round(hold_seconds / 0.01)
    kwargs = {
        "hysteresis": hysteresis,
        "load": load,
        "start": "rest",
        "normalize": False,
        "episode_seconds": len(path) * hold_seconds + 1.0,
    }
    env = make_env("PAM/MusclePositioning-v0", kwargs)
    env.reset(seed=0)
    outputs = []
    for pressure in path:
        for _ in range(steps):
            info = env.step(np.array([pressure]))[4]
        outputs.append(info["output"])
    env.close()
    return path, np.array(outputs)


def simulated_widths() -> list[Figure]:
    """Loop width of the simulated plants where the measured loop is widest."""
    figures = []
    for hysteresis in ("maxwell_slip", "preisach"):
        for load, (width, where) in WIDTHS.items():
            pressure, widths = loop_width(*simulated_loop(hysteresis, load))
            ours = MM * float(np.interp(where, BAR * pressure, widths))
            name = f"{hysteresis} plant, {load:g} kg: loop width at {where:g} bar"
            figures.append(Figure(name, SEED, "mm", width, ours, SIMULATED))
    return figures


POSITIONING: dict[str, tuple[float, float]] = {
    "published": (1.730, 8.751),
    "table 6 refit": (0.236, 1.114),
    "cubic": (0.262, 0.849),
    "inverse of forward cubic": (0.202, 0.698),
    "quintic": (0.174, 0.578),
    "pchip": (0.162, 0.623),
    "one cubic for both branches": (1.171, 2.191),
}
"""RMS and largest positioning error [mm] on the tables' own repeats, one repeat left out: computed
from the paper's tables beforehand, by another program."""


def positioning_errors() -> list[Figure]:
    """Positioning error of the polynomials and their refits on the tables' own repeats."""
    module = importlib.import_module("baselines.positioning.contraction_errors")
    table, figures = module.positioning_error_table(), list[Figure]()
    for name, (rms, largest) in POSITIONING.items():
        ours, where = table[name], f"{SEED}, tables"
        figures += [
            Figure(f"{name}: RMS positioning error", where, "mm", rms, MM * ours.rms, 6e-4),
            Figure(f"{name}: largest error", where, "mm", largest, MM * ours.largest, 6e-4),
        ]
    return figures


GROUPS: tuple[Callable[[], list[Figure]], ...] = (
    measured_widths,
    simulated_widths,
    positioning_errors,
)


def groups() -> tuple[Callable[[], list[Figure]], ...]:
    """Return the groups of all papers."""
    from benchmarks.papers import elbow as papers_elbow
    from benchmarks.papers import gait as papers_gait
    from benchmarks.papers import joint as papers_joint
    from benchmarks.papers import joint_steps as papers_joint_steps
    from benchmarks.papers import knee as papers_knee
    from benchmarks.papers import knee_envs as papers_knee_envs
    from benchmarks.papers import manipulator as papers_manipulator

    knee = papers_knee.GROUPS + papers_gait.GROUPS + papers_knee_envs.GROUPS  # they import Figure
    joint = papers_joint.GROUPS + papers_joint_steps.GROUPS
    return GROUPS + knee + papers_elbow.GROUPS + joint + papers_manipulator.GROUPS


def all_figures() -> list[Figure]:
    """Return every figure; a group that cannot be computed is one line that says why."""
    figures: list[Figure] = []
    for group in groups():
        try:
            figures += group()
        except (ModuleNotFoundError, AttributeError) as error:
            title = (group.__doc__ or group.__name__).splitlines()[0].rstrip(".")
            note = f"not there: {error}"
            figures.append(Figure(title, "", "", float("nan"), None, None, note))
    return figures


def table(figures: Sequence[Figure]) -> str:
    """Return the figures as aligned text."""
    lines = [("figure", "published", "expected", "ours", "unit", "judged by", "", "note")]
    for figure in figures:
        known = figure.published == figure.published
        lines.append(
            (
                figure.name,
                f"{figure.published:.4g}" if known else "",
                "" if figure.expected is None else f"{figure.expected:.4g}",
                "-" if figure.ours is None else f"{figure.ours:.4g}",
                figure.unit,
                figure.judged_by,
                figure.verdict,
                figure.remark,
            )
        )
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    )
