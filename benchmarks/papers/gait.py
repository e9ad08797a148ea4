"""Figures of yeh2010 with the leg or with a switch between two controllers.

The paper measured the EMG of the thigh with and without the orthosis. The simulation computes
torques; a reading (:mod:`pam_envs.muscle.emg`) predicts the muscle activity from them. The
*uncalibrated* reading is scored. With it, an exactly delivered assistance of 20 % reduces activity
by 20 % at most. The larger published reductions are possible only if the true demand is below Eq.
(1) (reading A) or if EMG grows faster than torque (reading B). Readings A and B have one constant
for each activity, *fitted* to the published figures with 20 % of Eq. (1) delivered without delay;
agreement with these figures is therefore no evidence. Their values with the paper's low-pass, in
stance only, are reported beside them.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from baselines.knee.published import printed_bumpless, printed_controller
from baselines.linear.bumpless import make_bumpless
from baselines.linear.systems import discrete
from benchmarks.papers.knee import PERIOD
from benchmarks.papers.published import Group, Values, as_published
from benchmarks.scoring.group import rms
from pam_envs.arrays import Array
from pam_envs.constants import GRAVITY
from pam_envs.identification.emg_calibration import PUBLISHED, change, stride_torques
from pam_envs.muscle.emg import MuscleActivation, Reading, calibration, emg_proxy
from pam_envs.plants.knee_orthosis.plant import Activity, KneeOrthosis
from pam_envs.plants.knee_orthosis.rollout import simulate_knee
from pam_envs.references.gait import NATURAL_STRIDE, PAPER_STRIDE

NAMES: dict[Activity, str] = {
    "walk": "walking",
    "stairs_up": "stairs up",
    "stairs_down": "stairs down",
}
ASSUMED: dict[Activity, str] = {
    "walk": "with an assumed aim height of 1 m",
    "stairs_up": "with synthetic stairs",
    "stairs_down": "with synthetic stairs",
}
LEANS = ("the shank itself", "the ankle's angle, foot flat")
"""Source of the shank's lean in Eq. (1), for ``shoe.flat_foot`` 0 and 1."""
LEFT_OUT = ("horizontal force", "weight of the shank")
TERMS = ((LEFT_OUT[0],), (LEFT_OUT[1],), LEFT_OUT)
"""Terms that Eq. (1) neglects according to the paper, besides acceleration."""
READINGS: tuple[Reading, ...] = ("A", "B")
MISMATCH = 10.0
"""Error [N] of the tension's reference in swing."""
PLACES: dict[Activity, str] = {
    "walk": "section 5.2: EMG; Fig. 13",
    "stairs_up": "section 5.3: EMG upstairs; Fig. 16",
    "stairs_down": "section 5.3: EMG downstairs; Fig. 17",
}
SWING, AFTER = 2.0, 4.0
"""Seconds before and after the switch."""


def printed_change(activity: Activity) -> dict[str, Any]:
    """Return the place and the change of the EMG [%]: printed, in walking of two printed values."""
    key = "expected" if activity == "walk" else "published"
    return {"source": PLACES[activity], key: 100.0 * PUBLISHED[activity]}


def stride_record(
    activity: Activity, stride: float, changes: Mapping[str, float] | None = None
) -> dict[str, Array]:
    """Return the signals of the second stride of a duration [s] under a constant pressure."""
    n = round(stride / PERIOD)
    plant = as_published(KneeOrthosis.on_leg(activity, stride, "none")).replace(changes or {})
    made = simulate_knee(plant, np.full(2 * n, 1.5e5), pressure=1.5e5)
    return {name: values[-n:] for name, values in made.items()}


def uncalibrated_change(
    activity: Activity,
    stride: float,
    exact: bool = False,
    floor: float = 0.03,
    changes: Mapping[str, float] | None = None,
) -> float:
    """Return the change of the EMG proxy's RMS where the assistance is delivered exactly.

    With ``exact`` the assistance is 20 % of Eq. (1) at all times, without low-pass and phases;
    ``floor`` is the co-contraction, ``changes`` are parameters of the plant. The stride is in s.
    """
    made = stride_record(activity, stride, changes)
    late = stride_torques(activity, stride, changes)[1]
    # records are taken at the ends of the periods, curves at their beginnings
    helped = 0.2 * made["estimate"] if exact else np.roll(late, -1)
    muscle = MuscleActivation(floor=floor)
    demand, assistance = np.tile(made["demand"], 2), np.tile(helped, 2)
    return emg_proxy(demand, assistance, PERIOD, muscle).change


def estimator_error(stride: float, flat_foot: int = 0, added: tuple[str, ...] = ()) -> float:
    """Return the RMS error [N m] of Eq. (1) in the stance of a walk, stride in s.

    With ``flat_foot`` 1 the lean is the ankle angle; terms of ``LEFT_OUT`` are added to Eq. (1).
    """
    made = stride_record("walk", stride, {"shoe.flat_foot": float(flat_foot)})
    leg = KneeOrthosis.on_leg("walk", hysteresis="none").leg
    missing = {
        "horizontal force": -made["ground_x"]
        * (leg.ankle_height + leg.shank * np.cos(made["shank"])),
        "weight of the shank": -leg.mass * leg.centre * GRAVITY * np.sin(made["shank"]),
    }
    torque = made["estimate"] + sum(missing[name] for name in added)
    return rms((torque - made["demand"])[made["stance"] > 0.0])


def emg_reductions() -> Values:
    """EMG proxy, uncalibrated and by the two readings that are fitted to the published figures."""
    for activity in NAMES:
        yield from _reductions(activity)
    bare = 100.0 * uncalibrated_change("walk", PAPER_STRIDE, changes={"leg.aim_height": 0.0})
    name = "EMG, walking, 5 s a stride, uncalibrated, centre of pressure as measured"
    yield name, bare, printed_change("walk")
    quick = 100.0 * uncalibrated_change("walk", NATURAL_STRIDE)
    yield "EMG, walking, {stride:g} s a stride, uncalibrated", quick, {"stride": NATURAL_STRIDE}
    for stride in (PAPER_STRIDE, NATURAL_STRIDE):
        yield from _estimator_errors(stride)
    ratio = estimator_error(NATURAL_STRIDE) / estimator_error(PAPER_STRIDE)
    yield "error of Eq. (1) at natural pace over that at 5 s", ratio


def _reductions(activity: Activity) -> Values:
    """Yield the uncalibrated reading, and the fitted ones without and with the low-pass."""
    known = {"activity": NAMES[activity], "assumed": ASSUMED[activity], **printed_change(activity)}
    plain = 100.0 * uncalibrated_change(activity, PAPER_STRIDE)
    bare = 100.0 * uncalibrated_change(activity, PAPER_STRIDE, exact=True, floor=0.0)
    yield "EMG, {activity}, 5 s a stride, uncalibrated", plain, known | {"bare": bare}
    title = "EMG, {activity}, 5 s a stride, calibrated {reading}"
    for reading in READINGS:
        constant = calibration(activity, reading)
        means = {
            "A": f"true demand = {constant:g} of Eq. (1)",
            "B": f"EMG = torque to the power {constant:g}",
        }[reading]
        read = known | {"reading": reading, "means": means}
        yield title, 100.0 * change(activity, reading, constant), read
        late = 100.0 * change(activity, reading, constant, as_referred=True)
        yield f"{title}, behind the low-pass", late, read


def _estimator_errors(stride: float) -> Values:
    """Yield the error of Eq. (1) by the source of the lean and by the added terms."""
    slow = stride == PAPER_STRIDE
    title = "error of Eq. (1), {stride:g} s a stride, "
    known: dict[str, Any] = {"stride": stride}
    known["source"] = "Eq. (1)" if slow else "section 5.2: faster walking"
    for flat, lean in enumerate(LEANS):
        name, about = f"{title}lean from {{lean}}", known | {"lean": lean}
        if slow and not flat:  # the claim of the paper
            name, about = "error of Eq. (1), 5 s a stride, lean from the shank itself", {}
        yield name, estimator_error(stride, flat), about
    left = {added: estimator_error(stride, added=added) for added in ((), *TERMS)}
    for added in TERMS:
        yield f"{title}with the {{terms}}", left[added], known | {"terms": " and the ".join(added)}
    for term in LEFT_OUT if slow else ():
        yield (
            f"error of Eq. (1), 5 s a stride, share due to the {term}",
            1.0 - left[term,] / left[()],
        )


def linear_switch(mismatch: float, compensated: bool) -> tuple[float, float]:
    """Return the transient of the switch to the printed controller on the printed plant.

    Before the switch the pressure is held at its nominal value and the controller runs off-line
    with a reference error of ``mismatch`` [N]; afterwards the reference is correct.

    Returns the largest error of the tension [N], and the jump of the pressure at the switch [kPa].
    """
    plant, gains = printed_bumpless()
    loop = make_bumpless(plant, printed_controller(), PERIOD, -200.0, 250.0, gains)
    loop = loop if compensated else loop.without()
    rig, before = discrete(plant, PERIOD, "zoh"), round(SWING / PERIOD)
    inside, state = rig.initial_state(), loop.initial_state()
    measured, commands = list[float](), list[float]()
    for k in range(before + round(AFTER / PERIOD)):
        reference = mismatch if k < before else 0.0
        measured.append(float(inside @ rig.c))
        in_charge = k >= before
        command = float(loop.output(reference, measured[-1], state)) if in_charge else 0.0
        state = loop.advance(reference, measured[-1], command, state)
        inside = rig.advance(command, inside)
        commands.append(command)
    return float(np.max(np.abs(measured[before:]))), abs(commands[before])


def switching_transient() -> Values:
    """Tension error and jump of the pressure after a switch, with and without bumpless transfer."""
    (soft, jump), (hard, bump) = (linear_switch(MISMATCH, compensated=c) for c in (True, False))
    yield "tension error with bumpless transfer", soft
    yield "pressure jump with bumpless transfer", jump
    yield "tension error without bumpless transfer", hard
    yield "pressure jump without bumpless transfer", bump
    yield "tension error with over without", soft / hard


GROUPS: tuple[Group, ...] = (emg_reductions, switching_transient)
