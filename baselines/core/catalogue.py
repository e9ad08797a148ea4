"""All classical controllers by name.

What a controller *knows* is part of its result. A controller is built from a nominal plant and the
named signals, never from an environment. Where the label says "nominal model", whoever runs the
controller decides what that model is: where it is the simulated plant itself, unrandomised, the
controller knows the true model, and a table of results should say so.

Most numbers of a controller follow from a rule or a paper. What they leave open are its *knobs*
(:mod:`baselines.core.knobs`); names with ``_tuned`` are controllers whose knobs were searched for
on tuning seeds, with the budget that learned controllers have (:mod:`baselines.core.tuned`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from baselines.core import tuned
from baselines.core.controller import Controller, reader
from baselines.core.entry import POSITIONING, Entry
from baselines.core.knobs import AS_DESIGNED, Knobs, check_knobs
from baselines.elbow.catalogue import ELBOW_CONTROLLERS, ELBOW_MAKERS
from baselines.joint.catalogue import ARM, JOINT_CONTROLLERS, JOINT_MAKERS
from baselines.knee.catalogue import KNEE, KNEE_CONTROLLERS, KNEE_MAKERS, SIMC
from baselines.positioning.contraction_tables import LOADS
from baselines.positioning.inverse import KNOBS as INVERSE_KNOBS
from baselines.positioning.inverse import make_inverse
from baselines.positioning.inverse_pid import KNOBS as INVERSE_PID_KNOBS
from baselines.positioning.inverse_pid import make_inverse_pid
from baselines.positioning.pid import KNOBS as PID_KNOBS
from baselines.positioning.pid import make_pid
from baselines.positioning.plc_polynomial import (
    make_one_cubic,
    make_plc_as_printed,
    make_plc_refitted,
)
from baselines.positioning.table_inverse import make_table_inverse
from baselines.positioning.trivial import Constant, Line, Random
from pam_envs.data.tables import load_contraction_table
from pam_envs.parameters import Signals
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.core.plant import Plant
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.plants.single_muscle.plant import SingleMuscle

SEED_003 = (
    "positioning2021: Studies regarding the Use of Pneumatic Muscles in Precise Positioning Systems"
)
P = TypeVar("P")
KREJCI = (
    "P. Krejci, K. Kuhnen, Inverse control of systems with hysteresis and creep, IEE Proc. Control "
    "Theory Appl. 148 (2001); I. D. Mayergoyz, Mathematical Models of Hysteresis, Springer 1991"
)

PUBLISHED: dict[str, Entry] = {
    "zero": Entry("no pressure, ever", "nothing", envs=(*POSITIONING, *KNEE)),
    "random": Entry(
        "set-points drawn evenly from the whole range, seeded",
        "nothing",
        envs=(*POSITIONING, *KNEE),
    ),
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
        "PID on the present error, SIMC tuning",
        "nominal model",
        feedback=True,
        citation=SIMC,
        knobs=PID_KNOBS,
    ),
    "inverse_no_preview": Entry(
        "exact inverse of hysteresis, static law and regulator at the present reference",
        "nominal model",
        citation=KREJCI,
    ),
    "inverse": Entry(
        "exact inverse of hysteresis, static law and regulator, dead time and lag ahead",
        "nominal model",
        preview=True,
        citation=KREJCI,
        knobs=INVERSE_KNOBS,
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
        knobs=INVERSE_PID_KNOBS,
    ),
    **KNEE_CONTROLLERS,
    **ELBOW_CONTROLLERS,
    **JOINT_CONTROLLERS,
}
"""By rule or as published."""
TUNED = tuned.read()
CONTROLLERS: dict[str, Entry] = {**PUBLISHED, **tuned.entries(PUBLISHED, TUNED)}


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
    plant: Plant,
    signals: Signals,
    action_signals: Signals,
    seed: int = 0,
    knobs: Knobs = AS_DESIGNED,
) -> Controller:
    """Return a controller by name.

    Parameters
    ----------
    name : str
        One of ``CONTROLLERS``.
    plant : Plant
        Nominal plant: what the controller is told of the muscle. Controllers that know nothing or
        tables do not look at it.
    signals, action_signals : Signals
        Those of the environment.
    seed : int
        For controllers that draw.
    knobs : mapping of float
        Of those that the entry names; 1 where left out.

    Raises
    ------
    ValueError
        If there is no controller of that name, or it has no such knob with that value.
    """
    if name in TUNED:
        found = TUNED[name]
        told = (plant, signals, action_signals)
        return make_controller(found.controller, *told, seed, found.knobs)
    if name not in PUBLISHED:
        raise ValueError(f"no controller named {name!r}; there are: {', '.join(CONTROLLERS)}")
    check_knobs(name, PUBLISHED[name].knobs, knobs)
    return _published(name, plant, signals, action_signals, seed, {"knobs": knobs} if knobs else {})


def _published(
    name: str,
    plant: Plant,
    signals: Signals,
    action_signals: Signals,
    seed: int,
    knobs: Mapping[str, Any],
) -> Controller:
    """Return a controller as published, but for its ``knobs`` where there are some."""
    told = (signals, action_signals)
    if name in KNEE_MAKERS:
        made: Controller = KNEE_MAKERS[name](_as(KneeOrthosis, plant, name), *told, **knobs)
        return made
    if name in ELBOW_MAKERS:
        seeded = {"seed": seed} if name == "elbow_random" else {}
        bending: Controller = ELBOW_MAKERS[name](
            _as(ElbowOrthosis, plant, name), *told, **seeded, **knobs
        )
        return bending
    if name in JOINT_MAKERS:
        following: Controller = JOINT_MAKERS[name](_joint(plant, name), *told, **knobs)
        return following

    def muscle() -> SingleMuscle:
        return _as(SingleMuscle, plant, name)

    makers: dict[str, Callable[[], Any]] = {
        "zero": lambda: Constant(action_signals["pressure_set_point"]),
        "random": lambda: Random(action_signals["pressure_set_point"], seed),
        "linear": lambda: make_linear(*told),
        "one_cubic": lambda: make_one_cubic(*told),
        "plc_as_printed": lambda: make_plc_as_printed(*told),
        "plc_refitted": lambda: make_plc_refitted(*told),
        "table": lambda: make_table_inverse(*told),
        "pid": lambda: make_pid(muscle(), *told, **knobs),
        "inverse_no_preview": lambda: make_inverse(muscle(), *told, preview=False),
        "inverse": lambda: make_inverse(muscle(), *told, **knobs),
        "inverse_pid_no_preview": lambda: make_inverse_pid(muscle(), *told, preview=False),
        "inverse_pid": lambda: make_inverse_pid(muscle(), *told, **knobs),
    }
    built: Controller = makers[name]()
    return built


def _joint(plant: Any, name: str) -> AntagonisticJoint | RedundantManipulator:
    if isinstance(plant, RedundantManipulator) or JOINT_CONTROLLERS[name].envs == ARM:
        return _as(RedundantManipulator, plant, name)
    return _as(AntagonisticJoint, plant, name)


def _as(family: type[P], plant: Any, name: str) -> P:
    """Return a plant of a family, or say which one a controller needs."""
    if not isinstance(plant, family):
        raise ValueError(
            f"{name} is for a {family.__name__}, and the plant is a {type(plant).__name__}; "
            "choose a controller whose envs name the environment"
        )
    return plant
