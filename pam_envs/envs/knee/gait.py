"""``PAM/KneeWalk-v0``, ``PAM/KneeStairsUp-v0``, ``PAM/KneeStairsDown-v0``: gait assistance.

A wearer walks with the knee orthosis of yeh2010 on one leg. The action is the setpoint of the
pressure of its muscle. In stance, which the load on the heel distinguishes from swing, the tension
of the muscle has to give a share of the knee torque, 20 % by default; in swing the knee has to move
as it would without the orthosis. The wearer holds the intended path like a spring and a damper, and
deviates from it where the orthosis pushes.

The assisted knee torque is the paper's estimate (yeh2010, Eq. 1) from the pressure shoe and the
lean of the shank: it neglects the horizontal ground force and all inertia. The true demand of the
knee, ``state/demand``, comes from the full balance. The share passes an eighth-order low-pass of
5 Hz, as in the paper, before it becomes a reference.

Observation (float32; scaled to [-1, 1] over the range, or SI with ``normalize=False``):

| # | signal | unit | range |
|---|--------|------|-------|
| 0 | tension, sensed | N | 0 .. 600 |
| 1 | angle of the brace, sensed (grows with flexion) | rad | 1 .. 3.2 |
| 2 | pressure, sensed | Pa | 0 .. 4.5e5 |
| 3 | set_point, of the last period | Pa | 0 .. 4.5e5 |
| 4 | stance, 1 while the load on the heel exceeds 5 kg, else 0 | 1 | 0 .. 1 |
| 5 | ground_force, vertical, sensed | N | 0 .. 1500 |
| 6 | torque_reference, the desired assistance in stance | N m | -60 .. 60 |
| 7 | reference: the tension that gives it (in swing: none, plus ``mismatch``) | N | 0 .. 600 |
| 8.. | reference_1 .., of the planned stride, ``preview_stride`` periods apart | N | 0 .. 600 |
| then | angle_reference: the wearer's path in swing, the sensed angle in stance | rad | 1 .. 3.2 |
| then | angle_reference_1 .., of the planned stride | rad | 1 .. 3.2 |

Action: pressure_set_point, 0 .. 4.5e5 Pa over [-1, 1].

Reward, each control period: ``- stance |tension error| / 10 N - swing |angle error| / 2 degrees
- 0.2 over-assistance / 5 N m - 0.2 |change of setpoint| / 4.5 bar``.

Start: at a random phase of the stride (``start="heel_contact"``: at its beginning), at rest on the
path, near the pressure that the reference needs. End: truncated after ``episode_seconds``;
terminated when the tension exceeds 800 N or the knee deviates by 40 degrees from the path.

Arguments: :func:`make_setup`, and those of every environment
(:class:`~pam_envs.envs.core.arguments.Common`). Versions: v0, the first.
"""

from functools import lru_cache, partial
from typing import Any

from pam_envs.envs.core.arguments import Common, Randomization, environment_arguments, environments
from pam_envs.envs.core.setup import Setup, check_choice, check_number, compose
from pam_envs.envs.knee.gait_kernels import kernels_for
from pam_envs.envs.knee.gait_layout import SOURCES
from pam_envs.muscle.emg import calibration
from pam_envs.plants.knee_orthosis import rows as R
from pam_envs.plants.knee_orthosis.plant import Activity, KneeOrthosis
from pam_envs.references.gait import NATURAL_STRIDE, PAPER_STRIDE
from pam_envs.tasks.gait_assistance import GaitAssistance

PACES = {"slow": PAPER_STRIDE, "normal": NATURAL_STRIDE}
"""Durations [s] of a stride: the paper's, and the one that was measured."""
STARTS = ("random", "heel_contact")
ASSISTANCE = {"signed": -1e9, "clipped": 0.0}
"""Lowest desired assistance [N m]."""
TENSIONS, ANGLES, TORQUES = (0.0, 600.0), (1.0, 3.2), (-60.0, 60.0)
RANDOMIZATION = Randomization(
    R.NAMES,
    (
        *("regulator.max_pressure", "lever.arm", "lever.fittings", "lever.mount_angle"),
        "fixture.length",
    ),
    "{'leg.body_mass': (60, 85)}",
)


default_plant = lru_cache(maxsize=16)(KneeOrthosis.on_leg)


STRIDES = {
    "varied": {"stride.variability": 0.03, "stride.load_variability": 0.02},
    "identical": {"stride.variability": 0.0, "stride.load_variability": 0.0},
}
WEARERS = {
    "prescribed": {"leg.adaptation": 0.0, "leg.forgetting": 0.0, "leg.reflex": 0.0},
    "adaptive": {"leg.adaptation": 0.3, "leg.forgetting": 0.05, "leg.reflex": 15.0},
}
LEANS = {"shank": {"shoe.flat_foot": 0.0}, "ankle": {"shoe.flat_foot": 1.0}}
"""Parameters that the arguments ``strides``, ``wearer`` and ``lean`` set."""


def _plant(activity: Activity, given: Common, pace: Any, **kinds: str | None) -> KneeOrthosis:
    """Return the orthosis on a leg that the arguments name."""
    changes: dict[str, float] = {}
    for name, choices in (("strides", STRIDES), ("wearer", WEARERS), ("lean", LEANS)):
        if kinds[name] is not None:
            check_choice(name, kinds[name], tuple(choices))
            changes |= choices[kinds[name]]  # type: ignore[index]
        elif given.plant is None and name == "strides":
            changes |= choices["varied"]
    if isinstance(pace, str):
        check_choice("pace", pace, tuple(PACES))
    stride = PACES.get("slow" if pace is None else pace, pace)
    seconds = check_number("pace", stride, 0.8, 20.0, "s a stride")
    made = given.plant_of(
        KneeOrthosis,
        lambda kind: default_plant(activity, stride=seconds, hysteresis=kind),
        usual="pressure",
    )
    if made.mounting != "leg" or made.activity != activity:
        raise ValueError(
            f"plant: mounting {made.mounting!r} with activity {made.activity!r}; give "
            f"KneeOrthosis.on_leg({activity!r})"
        )
    if given.plant is not None and pace is not None:
        changes["stride.time"] = seconds
    return made.replace(changes) if changes else made


@environment_arguments(reference="estimate", preview=5, preview_stride=4, episode_seconds=10.0)
def make_setup(
    given: Common,
    activity: Activity,
    pace: Any = None,
    ratio: float = 0.2,
    assistance: str = "signed",
    mismatch: float = 0.0,
    start: str = "random",
    strides: str | None = None,
    wearer: str | None = None,
    lean: str | None = None,
) -> Setup:
    """Return the checked configuration of an environment with the orthosis on a leg.

    Parameters
    ----------
    given : Common
        Plant: a ``KneeOrthosis`` on a leg with this activity. Reference: the torque of which the
        assistance is a share: "estimate" (yeh2010, Eq. 1, from the sensors) or "demand" (the true
        knee torque); or samples [N m] of the assistance itself, without low-pass. Previews are of
        the planned stride. Reward: :class:`~pam_envs.tasks.gait_assistance.GaitAssistance`.
    activity : {"walk", "stairs_up", "stairs_down"}
        Activity of the wearer.
    pace : float or {"slow", "normal"}, optional
        Duration of a stride [s]: 5 s ("slow", as in the paper), 1.224 s ("normal", as measured).
        Default: that of the plant, or slow.
    ratio : float
        Share of the knee torque that the orthosis gives, up to 0.5: on stairs that is beyond the
        capacity of the muscle.
    assistance : {"signed", "clipped"}
        Assist flexion where the share is negative, or not at all.
    mismatch : float
        Offset [N] of the tension's reference in swing, where the tension is not tracked.
    start : {"random", "heel_contact"}
        Phase of the stride at the start.
    strides : {"varied", "identical"}, optional
        Whether durations and loads of strides differ, by 3 and 2 % (standard deviation), so that
        the planned stride of the previews is early or late. Default: as in ``plant``, or "varied".
    wearer : {"prescribed", "adaptive"}, optional
        Whether the wearer gives up effort at once, or learns over strides what to expect of the
        orthosis (:mod:`pam_envs.mechanics.leg`). Default: as in ``plant``, or "prescribed".
    lean : {"shank", "ankle"}, optional
        Lean of the shank in the estimate: the true one, or that of the paper's ankle
        potentiometer, which takes the foot to be flat. Default: as in ``plant``, or "shank".
    """
    made = _plant(activity, given, pace, strides=strides, wearer=wearer, lean=lean)
    source, samples = given.reference_of(SOURCES, "N m", 100.0)
    check_choice("assistance", assistance, tuple(ASSISTANCE))
    check_choice("start", start, STARTS)
    task, full = given.task_of(GaitAssistance), made.regulator.max_pressure
    config = {
        **vars(task),
        "ratio": check_number("ratio", ratio, 0.0, 0.5, ""),
        "lowest_torque": ASSISTANCE[assistance],
        "mismatch": check_number("mismatch", mismatch, -100.0, 100.0, "N"),
        "demand_share": calibration(activity, "A"),
        "start_phase": -1.0 if start == "random" else 0.0,
        "start_spread": 0.1 if start == "random" else 0.0,
        "known_arm": made.lever.arm,
        "known_wire": made.lever.stiffness,
        "known_relaxed": made.lever.relaxed_angle,
        "known_shank": made.leg.shank,
        "known_mass": made.leg.body_mass,
    }
    return compose(
        made,
        partial(kernels_for, made.hysteresis.kind, made.dynamics),
        given,
        RANDOMIZATION,
        observation=[
            ("tension", "N", *TENSIONS),
            ("angle", "rad", *ANGLES),
            ("pressure", "Pa", 0.0, full),
            ("set_point", "Pa", 0.0, full),
            ("stance", "1", 0.0, 1.0),
            ("ground_force", "N", 0.0, 1500.0),
            ("torque_reference", "N m", *TORQUES),
        ],
        references=[("reference", "N", *TENSIONS), ("angle_reference", "rad", *ANGLES)],
        action=[("pressure_set_point", "Pa", 0.0, full)],
        config=config,
        reference=source,
        own=made.gait_table(),
        samples=samples,
        view="pam_envs.envs.knee.view:GAIT_VIEW",
    )


KneeWalkEnv, KneeWalkVectorEnv = environments("KneeWalk", make_setup, "walk")
KneeStairsUpEnv, KneeStairsUpVectorEnv = environments("KneeStairsUp", make_setup, "stairs_up")
KneeStairsDownEnv, KneeStairsDownVectorEnv = environments(
    "KneeStairsDown", make_setup, "stairs_down"
)
