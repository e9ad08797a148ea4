"""Figures of positioning2021: loop widths, simulated loops and positioning errors."""

import numpy as np

from baselines.positioning.contraction_tables import positioning_error_table
from benchmarks.papers.published import Group, Values, as_published
from benchmarks.scenarios.scenario_env import make_env
from pam_envs.arrays import Array
from pam_envs.data.tables import load_contraction_table
from pam_envs.plants.single_muscle.plant import SingleMuscle

MM, BAR = 1e3, 1e-5
HOLD_SECONDS = 3.0  # time at each pressure of a quasi-static loop

WIDTHS: dict[float, tuple[float, float]] = {0.0: (3.29, 3.5), 2.55: (2.82, 4.5), 4.55: (2.40, 3.5)}
"""Load [kg]: largest loop width [mm] and the pressure of it [bar]."""
PLACES = {
    0.0: "Fig. 4; section 3.1.1: widest loop; section 4: inflation and deflation",
    2.55: "Fig. 7; section 3.1.2: widest loop; section 4: inflation and deflation",
    4.55: "Fig. 9; section 3.1.3: widest loop; section 4: inflation and deflation",
}


def loop_width(pressure: Array, contraction: Array) -> tuple[Array, Array]:
    """Return pressures [Pa] and widths [m], shape (n,), of a loop with equal pressures up and down.

    Pressures and contractions, shape (2 n - 1,), are in path order, with the turning point once.
    """
    n = len(pressure) // 2
    return pressure[: n + 1], contraction[::-1][: n + 1] - contraction[: n + 1]


def measured_widths() -> Values:
    """Largest width of the mean loops in the tables."""
    table = load_contraction_table()
    for load, (width, where) in WIDTHS.items():
        pressure, widths = loop_width(*table.means(load))
        best, at = int(np.argmax(widths)), {"load": load, "source": PLACES[load]}
        name = "tables, {load:g} kg: largest loop width"
        yield name, MM * float(widths[best]), at | {"published": width}
        yield f"{name}, at", BAR * float(pressure[best]), at | {"published": where}


def simulated_loop(hysteresis: str, load: float) -> tuple[Array, Array]:
    """Return the quasi-static loop of an identified plant, 0 to 6 bar and back by half a bar.

    Pressures [Pa] and noise-free contractions [m], shape (25,), at the end of each hold.
    """
    up = np.arange(0.0, 6.01e5, 0.5e5)
    path = np.concatenate([up, up[-2::-1]])
    kwargs = {
        "plant": as_published(SingleMuscle.mas10(hysteresis)),
        "load": load,
        "start": "rest",
        "normalize": False,
        "episode_seconds": len(path) * HOLD_SECONDS + 1.0,
    }
    env = make_env("PAM/MusclePositioning-v0", kwargs)
    env.reset(seed=0)
    outputs = []
    for pressure in path:
        for _ in range(round(HOLD_SECONDS / 0.01)):
            info = env.step(np.array([pressure]))[4]
        outputs.append(info["output"])
    env.close()
    return path, np.array(outputs)


def simulated_widths() -> Values:
    """Loop width of the simulated plants where the measured loop is widest."""
    for hysteresis in ("maxwell_slip", "preisach"):
        for load, (width, where) in WIDTHS.items():
            pressure, widths = loop_width(*simulated_loop(hysteresis, load))
            ours = MM * float(np.interp(where, BAR * pressure, widths))
            at = {"load": load, "bar": where, "source": PLACES[load], "published": width}
            yield f"{hysteresis} plant, {{load:g}} kg: loop width at {{bar:g}} bar", ours, at


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


def positioning_errors() -> Values:
    """Positioning error of the polynomials and their refits on the tables' own repeats."""
    table = positioning_error_table()
    for name, (rms, largest) in POSITIONING.items():
        ours, about = table[name], {"curves": name}
        yield "{curves}: RMS positioning error", MM * ours.rms, about | {"expected": rms}
        yield "{curves}: largest error", MM * ours.largest, about | {"expected": largest}
    without = table["one cubic for both branches"].rms
    name = "Eqs. (7) to (12) over one cubic without hysteresis, RMS"
    yield name, table["published"].rms / without
    name = "RMS positioning error without hysteresis over that of an inverse"
    yield name, without / table["pchip"].rms


GROUPS: tuple[Group, ...] = (measured_widths, simulated_widths, positioning_errors)
