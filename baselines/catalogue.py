"""All classical controllers by name.

What a controller *knows* is part of its result. A controller is built from a nominal plant and the
named signals, never from an environment. Where the label says "nominal model", whoever runs the
controller decides what that model is: where it is the simulated plant itself, unrandomised, the
controller knows the true model, and a table of results should say so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from baselines.contraction_tables import LOADS
from baselines.controller import Controller, reader
from baselines.inverse import make_inverse
from baselines.inverse_pid import make_inverse_pid
from baselines.pid import make_pid
from baselines.plc_polynomial import make_one_cubic, make_plc_as_printed, make_plc_refitted
from baselines.table_inverse import make_table_inverse
from baselines.trivial import Constant, Line, Random
from pam_envs.data.tables import load_contraction_table
from pam_envs.parameters import Signals
from pam_envs.plants.single_muscle import SingleMuscle

Knowledge = Literal["nothing", "tables", "nominal model", "true model"]
POSITIONING = ("PAM/MusclePositioning-v0",)
SEED_003 = "Seed 003: Studies regarding the Use of Pneumatic Muscles in Precise Positioning Systems"
KREJCI = (
    "P. Krejci, K. Kuhnen, Inverse control of systems with hysteresis and creep, IEE Proc. Control "
    "Theory Appl. 148 (2001); I. D. Mayergoyz, Mathematical Models of Hysteresis, Springer 1991"
)
SIMC = (
    "S. Skogestad, Simple analytic rules for model reduction and PID controller tuning, J. Process "
    "Control 13 (2003) 291-309"
)


@dataclass(frozen=True)
class Entry:
    """A controller of the catalogue.

    Attributes
    ----------
    summary : str
        One line on what it does.
    knowledge : {"nothing", "tables", "nominal model", "true model"}
        What it is told of the muscle; see this module's page on the last two.
    preview : bool
        Whether it reads the previewed reference samples (all that the observation has).
    feedback : bool
        Whether it uses measurements beyond the first of an episode.
    citation : str
        Where the method is from; empty for what needs no source.
    envs : tuple of str
        Environment ids that it is for.
    kind : str
        "classical": a row of results is verified by running it again.
    """

    summary: str
    knowledge: Knowledge
    preview: bool = False
    feedback: bool = False
    citation: str = ""
    envs: tuple[str, ...] = POSITIONING
    kind: str = "classical"


CONTROLLERS: dict[str, Entry] = {
    "zero": Entry("no pressure, ever", "nothing"),
    "random": Entry("set-points drawn evenly from the whole range, seeded", "nothing"),
    "linear": Entry(
        "straight line through the end points of the table at the nearest load", "tables"
    ),
    "one_cubic": Entry(
        "one cubic a load for both branches: hysteresis ignored", "tables", citation=SEED_003
    ),
    "plc_as_printed": Entry(
        "the paper's Equations 7-12 exactly as printed, misprints included",
        "tables",
        citation=SEED_003,
    ),
    "plc_refitted": Entry(
        "the paper's cubics refitted to its Table 6 at full precision",
        "tables",
        citation=SEED_003,
    ),
    "table": Entry(
        "monotone interpolation of the tables' means, a curve for each load and branch",
        "tables",
        citation=SEED_003,
    ),
    "pid": Entry(
        "PID on the present error, SIMC tuning", "nominal model", feedback=True, citation=SIMC
    ),
    "inverse_no_preview": Entry(
        "exact inverse of memory, static law and regulator at the present reference",
        "nominal model",
        citation=KREJCI,
    ),
    "inverse": Entry(
        "exact inverse of memory, static law and regulator, dead time and lag ahead",
        "nominal model",
        preview=True,
        citation=KREJCI,
    ),
    "inverse_pid_no_preview": Entry(
        "inverse_no_preview, and a PID on the deviation from the nominal muscle",
        "nominal model",
        feedback=True,
        citation=f"{KREJCI}; {SIMC}",
    ),
    "inverse_pid": Entry(
        "inverse, and a PID on the deviation from the nominal muscle",
        "nominal model",
        preview=True,
        feedback=True,
        citation=f"{KREJCI}; {SIMC}",
    ),
}


def make_linear(signals: Signals, action_signals: Signals) -> Line:
    """Return the straight line from (0, 0) to the mean contraction at the highest pressure."""
    table = load_contraction_table()
    ends = [(p[-1], x[-1].mean()) for p, x in (table.branch(load, True) for load in LOADS)]
    return Line(
        reader(signals, ["load", "reference"]),
        action_signals["pressure_set_point"],
        LOADS,
        tuple(float(p / x) for p, x in ends),
    )


def make_controller(
    name: str,
    plant: SingleMuscle,
    signals: Signals,
    action_signals: Signals,
    seed: int = 0,
) -> Controller:
    """Return a controller by name.

    Parameters
    ----------
    name : str
        One of ``CONTROLLERS``.
    plant : SingleMuscle
        Nominal plant: what the controller is told of the muscle. Controllers that know nothing or
        tables do not look at it.
    signals, action_signals : Signals
        Those of the environment.
    seed : int
        For controllers that draw.

    Raises
    ------
    ValueError
        If there is no controller of that name.
    """
    told = (signals, action_signals)
    makers: dict[str, Callable[[], Any]] = {
        "zero": lambda: Constant(action_signals["pressure_set_point"]),
        "random": lambda: Random(action_signals["pressure_set_point"], seed),
        "linear": lambda: make_linear(*told),
        "one_cubic": lambda: make_one_cubic(*told),
        "plc_as_printed": lambda: make_plc_as_printed(*told),
        "plc_refitted": lambda: make_plc_refitted(*told),
        "table": lambda: make_table_inverse(*told),
        "pid": lambda: make_pid(plant, *told),
        "inverse_no_preview": lambda: make_inverse(plant, *told, preview=False),
        "inverse": lambda: make_inverse(plant, *told),
        "inverse_pid_no_preview": lambda: make_inverse_pid(plant, *told, preview=False),
        "inverse_pid": lambda: make_inverse_pid(plant, *told),
    }
    if name not in makers:
        raise ValueError(f"no controller named {name!r}; there are: {', '.join(CONTROLLERS)}")
    made: Controller = makers[name]()
    return made
