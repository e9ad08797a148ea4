"""Figures of positioning2021: loop widths, simulated loops and positioning errors."""

from collections.abc import Iterator

import numpy as np

from baselines.positioning.contraction_tables import positioning_error_table
from benchmarks.papers.published import BEFORE, Figure, Group, as_published
from benchmarks.scenarios.scenario_env import make_env
from pam_envs.arrays import Array
from pam_envs.data.tables import load_contraction_table
from pam_envs.plants.single_muscle.plant import SingleMuscle

SOURCE = "positioning2021"
MM, BAR = 1e3, 1e-5

WIDTHS: dict[float, tuple[float, float]] = {0.0: (3.29, 3.5), 2.55: (2.82, 4.5), 4.55: (2.40, 3.5)}
"""Load [kg]: largest loop width [mm] and the pressure of it [bar]."""
PLACES = {
    0.0: f"{SOURCE}, Fig. 4; section 3.1.1: widest loop; section 4: inflation and deflation",
    2.55: f"{SOURCE}, Fig. 7; section 3.1.2: widest loop; section 4: inflation and deflation",
    4.55: f"{SOURCE}, Fig. 9; section 3.1.3: widest loop; section 4: inflation and deflation",
}

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
        yield Figure(name, ours[0], "mm", PLACES[load], width, 0.005)
        yield Figure(f"{name}, at", ours[1], "bar", PLACES[load], where, 1e-6)


def simulated_loop(hysteresis: str, load: float, hold_seconds: float = 3.0) -> tuple[Array, Array]:
    """Return the quasi-static loop of an identified plant, 0 to 6 bar and back by half a bar.

    Pressures [Pa] and noise-free contractions [m], shape (25,), at the end of each hold [s].
    """
    up = np.arange(0.0, 6.01e5, 0.5e5)
    path = np.concatenate([up, up[-2::-1]])
    kwargs = {
        "plant": as_published(SingleMuscle.mas10(hysteresis)),
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
            yield Figure(name, ours, "mm", PLACES[load], width, SIMULATED)


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
    table, where = positioning_error_table(), f"{SOURCE}, abstract: positioning accuracy"
    for name, (rms, largest) in POSITIONING.items():
        ours = table[name]
        for what, value, expected in (
            ("RMS positioning error", ours.rms, rms),
            ("largest error", ours.largest, largest),
        ):
            more = {"tolerance": 6e-4, "note": BEFORE, "expected": expected}
            yield Figure(f"{name}: {what}", MM * value, "mm", where, **more)  # type: ignore[arg-type]
    without = table["one cubic for both branches"].rms
    ratio, words = table["published"].rms / without, "increase positioning accuracy"
    name = "Eqs. (7) to (12) over one cubic without hysteresis, RMS"
    why = "Eq. (11) as printed: 4.0 mm RMS"
    yield Figure(name, ratio, "", where, at_most=1.0, claim=words, why=why)
    ratio = without / table["pchip"].rms
    where = f"{SOURCE}, section 4: inverse model"
    words = "hysteresis should be compensated"
    name = "RMS positioning error without hysteresis over that of an inverse"
    yield Figure(name, ratio, "", where, at_least=1.0, claim=words)


GROUPS: tuple[Group, ...] = (measured_widths, simulated_widths, positioning_errors)
