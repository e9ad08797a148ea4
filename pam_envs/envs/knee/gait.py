"""``PAM/KneeWalk-v0``, ``PAM/KneeStairsUp-v0``, ``PAM/KneeStairsDown-v0``: assistance of a gait.

A wearer walks with the knee orthosis of yeh2010 on one leg. The action is the set-point of its
muscle's pressure. In stance, told from swing by the load on the heel, the muscle's tension has to
give a share of the knee torque, 20 % by default; in swing the knee has to move as it would without
the orthosis. The wearer holds his path like a spring and a damper, and gets out of it where the
orthosis pushes.

The knee torque that the orthosis assists is the paper's estimate, Eq. (1), from the pressure shoe
and the shank's lean: it does not see the ground's horizontal force nor any inertia. What the knee
really asks for, ``state/demand``, comes from the full balance. The share passes an eighth-order
low-pass of 5 Hz, as in the paper, before it becomes a reference.

Observation (float32; scaled to [-1, 1] over the range, or SI with ``normalize=False``):

| # | signal | unit | range |
|---|--------|------|-------|
| 0 | tension, sensed | N | 0 .. 600 |
| 1 | angle of the brace, sensed (grows with flexion) | rad | 1 .. 3.2 |
| 2 | pressure, sensed | Pa | 0 .. 4.5e5 |
| 3 | set_point, of the last period | Pa | 0 .. 4.5e5 |
| 4 | stance, 1 while the heel bears more than 5 kg, else 0 | 1 | 0 .. 1 |
| 5 | ground_force, vertical, sensed | N | 0 .. 1500 |
| 6 | torque_reference, the assistance wanted in stance | N m | -60 .. 60 |
| 7 | reference: the tension that gives it (in swing: none, plus ``mismatch``) | N | 0 .. 600 |
| 8.. | reference_1 .., of the planned stride, ``preview_stride`` periods apart | N | 0 .. 600 |
| then | angle_reference: the wearer's path in swing, the sensed angle in stance | rad | 1 .. 3.2 |
| then | angle_reference_1 .., of the planned stride | rad | 1 .. 3.2 |

Action: pressure_set_point, 0 .. 4.5e5 Pa over [-1, 1].

Reward, each control period: ``- stance |tension error| / 10 N - swing |angle error| / 2 degrees
- 0.2 over-assistance / 5 N m - 0.2 |change of set-point| / 4.5 bar``.

Start: at a random phase of the stride (``start="heel_contact"``: at its beginning), at rest on the
path, under about the pressure that would be needed. End: truncated after ``episode_seconds``;
terminated when the tension exceeds 800 N or the knee is 40 degrees off the path.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from pam_envs.envs.core.arguments import (
    common,
    named_arguments,
    plant_of,
    reference_of,
    spread_of,
    task_of,
)
from pam_envs.envs.core.plant_env import PlantEnv
from pam_envs.envs.core.setup import Setup, check_choice, check_number, compose
from pam_envs.envs.core.vector_env import PlantVectorEnv
from pam_envs.envs.knee.gait_kernels import kernels_for
from pam_envs.envs.knee.gait_layout import SOURCES
from pam_envs.muscle.emg import calibration
from pam_envs.parameters import Signal, Signals
from pam_envs.plants.knee_orthosis import rows as R
from pam_envs.plants.knee_orthosis.plant import Activity, KneeOrthosis
from pam_envs.plants.single_muscle.hysteresis import Kind
from pam_envs.references.gait import NATURAL_STRIDE, PAPER_STRIDE
from pam_envs.tasks.gait_assistance import GaitAssistance

PACES = {"slow": PAPER_STRIDE, "normal": NATURAL_STRIDE}
"""Durations [s] of a stride: the paper's, and the one that was measured."""
STARTS = ("random", "heel_contact")
ASSISTANCE = {"signed": -1e9, "clipped": 0.0}
"""Smallest assistance [N m] that is wanted."""
TENSIONS, ANGLES, TORQUES = (0.0, 600.0), (1.0, 3.2), (-60.0, 60.0)
NOT_DRAWN = (
    "regulator.max_pressure",
    "lever.arm",
    "lever.fittings",
    "lever.mount_angle",
    "fixture.length",
)
"""Parameters that ``randomize`` may not draw: they scale the action or the signals."""


@lru_cache(maxsize=16)
def _stock(activity: Activity, pace: float, hysteresis: Kind) -> KneeOrthosis:
    return KneeOrthosis.on_leg(activity, stride=pace, hysteresis=hysteresis)


def _pace(pace: Any) -> float:
    """Return the duration of a stride [s]."""
    if isinstance(pace, str):
        check_choice("pace", pace, tuple(PACES))
        return PACES[pace]
    return check_number("pace", pace, 0.8, 20.0, "s a stride")


def _plant(activity: Activity, plant: Any, hysteresis: Any, pace: Any) -> KneeOrthosis:
    """Return the orthosis on a leg that the arguments name."""
    seconds = PAPER_STRIDE if pace is None else _pace(pace)
    made = plant_of(KneeOrthosis, plant, hysteresis, lambda kind: _stock(activity, seconds, kind))
    if made.mounting != "leg" or made.activity != activity:
        raise ValueError(
            f"plant: mounting {made.mounting!r} with activity {made.activity!r}; give "
            f"KneeOrthosis.on_leg({activity!r})"
        )
    if plant is not None and pace is not None:
        return made.replace({"stride.time": seconds})
    return made


def _signals(full: float, preview: int, spacing: float, normalize: bool) -> Signals:
    parts: list[tuple[str, str, tuple[float, float], float]] = [
        ("tension", "N", TENSIONS, 0.0),
        ("angle", "rad", ANGLES, 0.0),
        ("pressure", "Pa", (0.0, full), 0.0),
        ("set_point", "Pa", (0.0, full), 0.0),
        ("stance", "1", (0.0, 1.0), 0.0),
        ("ground_force", "N", (0.0, 1500.0), 0.0),
        ("torque_reference", "N m", TORQUES, 0.0),
    ]
    for name, unit, span in (("reference", "N", TENSIONS), ("angle_reference", "rad", ANGLES)):
        parts.append((name, unit, span, 0.0))
        parts += [(f"{name}_{i + 1}", unit, span, (i + 1) * spacing) for i in range(preview)]
    return Signals(
        Signal(name, unit, low, high, i, normalize, ahead)
        for i, (name, unit, (low, high), ahead) in enumerate(parts)
    )


@named_arguments
def make_setup(
    activity: Activity,
    hysteresis: Kind | None = None,
    plant: KneeOrthosis | str | Path | None = None,
    reference: Any = "estimate",
    preview: int = 5,
    preview_stride: int = 4,
    episode_seconds: float = 10.0,
    randomize: Any = False,
    normalize: bool = True,
    render_mode: str | None = None,
    pace: Any = None,
    ratio: float = 0.2,
    assistance: str = "signed",
    mismatch: float = 0.0,
    start: str = "random",
    reward: Mapping[str, float] | None = None,
) -> Setup:
    """Return the checked configuration of an environment with the orthosis on a leg.

    Parameters
    ----------
    activity : {"walk", "stairs_up", "stairs_down"}
        What the wearer does.
    hysteresis : {"maxwell_slip", "preisach", "none"}, optional
        The muscle's hysteresis. Default: that of ``plant``, or Maxwell-slip.
    plant : KneeOrthosis or path, optional
        Another plant, on a leg of this activity.
    reference : str or array_like
        What the assistance is a share of: "estimate", the paper's Eq. (1) from the sensors, or
        "demand", the true knee torque. Or samples [N m] of the assistance itself, one a control
        period, which pass no low-pass (the last one holds).
    preview, preview_stride : int
        Future samples of both references, of the planned stride, and control periods between them.
    episode_seconds : float
        Duration [s].
    randomize : bool or mapping
        True: every episode draws the assumed parameters within their declared ranges. A mapping
        {"leg.body_mass": (low, high)}: just those.
    normalize : bool
        Observation and action in [-1, 1], or SI.
    render_mode : {None, "rgb_array", "human"}
        As Gymnasium means it.
    pace : float or {"slow", "normal"}, optional
        Duration of a stride [s]: 5 s ("slow", as in the paper), 1.224 s ("normal", as measured).
        Default: that of ``plant``, or slow.
    ratio : float
        Share of the knee torque that the orthosis is to give, up to a half: on stairs that is
        beyond what the muscle can give at its capacity.
    assistance : {"signed", "clipped"}
        Whether it helps flexion where the share is negative, or not at all.
    mismatch : float
        By how much [N] the tension's reference is off in swing, where the tension is not tracked.
    start : {"random", "heel_contact"}
        Phase of the stride at the start.
    reward : mapping, optional
        Fields of :class:`pam_envs.tasks.gait_assistance.GaitAssistance` to change.

    Raises
    ------
    ValueError
        Naming the argument, its value, the bounds and the remedy.
    """
    made = _plant(activity, plant, hysteresis, pace)
    source, samples = reference_of(reference, SOURCES, "N m", 100.0)
    given = common(preview, preview_stride, episode_seconds, normalize, render_mode)
    check_choice("assistance", assistance, tuple(ASSISTANCE))
    check_choice("start", start, STARTS)
    share = check_number("ratio", ratio, 0.0, 0.5, "")
    shift = check_number("mismatch", mismatch, -100.0, 100.0, "N")
    task = task_of(GaitAssistance, reward)
    full = made.regulator.max_pressure
    config = (
        task.tension_weight,
        task.tension_scale,
        task.angle_weight,
        task.angle_scale,
        task.over_weight,
        task.over_scale,
        task.effort_weight,
        task.soft_pressure,
        task.soft_deviation,
        task.highest_tension,
        task.largest_deviation,
        share,
        ASSISTANCE[assistance],
        shift,
        calibration(activity, "A"),
        -1.0 if start == "random" else 0.0,
        0.1 if start == "random" else 0.0,
        made.lever.arm,
        made.lever.stiffness,
        made.lever.relaxed_angle,
        made.leg.shank,
        made.leg.body_mass,
    )
    example = "{'leg.body_mass': (60, 85)}"
    return compose(
        made,
        kernels_for(made.hysteresis.kind, made.dynamics),
        given,
        signals=_signals(full, given.preview, given.stride * made.control_period, normalize),
        actions=Signals([Signal("pressure_set_point", "Pa", 0.0, full, 0, normalize)]),
        config=config,
        choices=(made.elements, source),
        own=made.gait_table(),
        samples=samples,
        tables=made.hysteresis_tables(),
        spread=spread_of(made, R.PARAMETERS, NOT_DRAWN, randomize, example, {}),
        drawn=randomize is not False,
        view="knee_gait",
    )


class KneeWalkEnv(PlantEnv):
    """The single environment of level walking (see the module's page)."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(make_setup("walk", **arguments))


class KneeWalkVectorEnv(PlantVectorEnv):
    """The batched environment of level walking (see the module's page)."""

    def __init__(
        self, num_envs: int = 1, info: bool = True, threads: int | None = None, **arguments: Any
    ) -> None:
        super().__init__(make_setup("walk", **arguments), num_envs, info, threads)


class KneeStairsUpEnv(PlantEnv):
    """The single environment of stairs up (see the module's page)."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(make_setup("stairs_up", **arguments))


class KneeStairsUpVectorEnv(PlantVectorEnv):
    """The batched environment of stairs up (see the module's page)."""

    def __init__(
        self, num_envs: int = 1, info: bool = True, threads: int | None = None, **arguments: Any
    ) -> None:
        super().__init__(make_setup("stairs_up", **arguments), num_envs, info, threads)


class KneeStairsDownEnv(PlantEnv):
    """The single environment of stairs down (see the module's page)."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(make_setup("stairs_down", **arguments))


class KneeStairsDownVectorEnv(PlantVectorEnv):
    """The batched environment of stairs down (see the module's page)."""

    def __init__(
        self, num_envs: int = 1, info: bool = True, threads: int | None = None, **arguments: Any
    ) -> None:
        super().__init__(make_setup("stairs_down", **arguments), num_envs, info, threads)
