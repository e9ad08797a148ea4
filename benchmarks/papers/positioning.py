"""Figures of positioning2021: loop widths, simulated loops and positioning errors."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from baselines.positioning.contraction_tables import positioning_error_table
from benchmarks.papers.published import Figure, Group
from benchmarks.scenarios.scenario_env import make_env
from pam_envs.data.tables import load_contraction_table

Array = NDArray[np.float64]

SOURCE = "positioning2021"
MM, BAR = 1e3, 1e-5

WIDTHS: dict[float, tuple[float, float]] = {0.0: (3.29, 3.5), 2.55: (2.82, 4.5), 4.55: (2.40, 3.5)}
"""Load [kg]: largest loop width [mm] and the pressure of it [bar] (positioning2021, section 4)."""

SIMULATED = 0.3
"""Tolerance [mm] of an identified plant's loop width where the measured loop is widest."""


def loop_width(pressure: Array, contraction: Array) -> tuple[Array, Array]:
    """Return pressures [Pa] and widths [m], shape (n,), of a loop with equal pressures up and down.

    Pressures and contractions, shape (2 n - 1,), are in path order, with the turning point once.
    """
    n = len(pressure) // 2
    return pressure[: n + 1], contraction[::-1][: n + 1] - contraction[: n + 1]


def measured_widths() -> Iterator[Figure]:
    """Largest width of the mean loops in the tables."""
    table = load_contraction_table()
    for load, (width, where) in WIDTHS.items():
        pressure, widths = loop_width(*table.means(load))
        best = int(np.argmax(widths))
        name = f"tables, {load:g} kg: largest loop width"
        ours = (MM * float(widths[best]), BAR * float(pressure[best]))
        yield Figure(name, ours[0], "mm", f"{SOURCE}, section 4", width, 0.005)
        yield Figure(f"{name}, at", ours[1], "bar", SOURCE, where, 1e-6)


def simulated_loop(hysteresis: str, load: float, hold_seconds: float = 3.0) -> tuple[Array, Array]:
    """Return the quasi-static loop of an identified plant, 0 to 6 bar and back by half a bar.

    Pressures [Pa] and noise-free contractions [m], shape (25,), at the end of each hold [s].
    """
    up = np.arange(0.0, 6.01e5, 0.5e5)
    path = np.concatenate([up, up[-2::-1]])
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
        for _ in range(round(hold_seconds / 0.01)):
            info = env.step(np.array([pressure]))[4]
        outputs.append(info["output"])
    env.close()
    return path, np.array(outputs)


def simulated_widths() -> Iterator[Figure]:
    """Loop width of the simulated plants where the measured loop is widest."""
    for hysteresis in ("maxwell_slip", "preisach"):
        for load, (width, where) in WIDTHS.items():
            pressure, widths = loop_width(*simulated_loop(hysteresis, load))
            ours = MM * float(np.interp(where, BAR * pressure, widths))
            name = f"{hysteresis} plant, {load:g} kg: loop width at {where:g} bar"
            yield Figure(name, ours, "mm", SOURCE, width, SIMULATED)


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
from the paper's tables by an independent program."""


def positioning_errors() -> Iterator[Figure]:
    """Positioning error of the polynomials and their refits on the tables' own repeats."""
    table, where = positioning_error_table(), f"{SOURCE}, tables"
    for name, (rms, largest) in POSITIONING.items():
        ours = table[name]
        yield Figure(f"{name}: RMS positioning error", MM * ours.rms, "mm", where, rms, 6e-4)
        yield Figure(f"{name}: largest error", MM * ours.largest, "mm", where, largest, 6e-4)


GROUPS: tuple[Group, ...] = (measured_widths, simulated_widths, positioning_errors)
