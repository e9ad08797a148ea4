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

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from baselines.knee.published import printed_bumpless, printed_controller
from baselines.linear.bumpless import make_bumpless
from baselines.linear.systems import discrete
from benchmarks.papers.knee import PERIOD, SOURCE
from benchmarks.papers.published import Figure, Group, as_published, note
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
RMS_NORM = "change of the RMS over a stride"
EXACT = "20 % of Eq. (1) behind the low-pass, in stance, delivered exactly"
ASSUMED: dict[Activity, str] = {
    "walk": ", with an assumed aim height of 1 m",
    "stairs_up": ", with synthetic stairs",
    "stairs_down": ", with synthetic stairs",
}
LEANS = ("the shank itself", "the ankle's angle, foot flat")
"""Source of the shank's lean in Eq. (1), for ``shoe.flat_foot`` 0 and 1."""
LEFT_OUT = ("horizontal force", "weight of the shank")
TERMS = ((LEFT_OUT[0],), (LEFT_OUT[1],), LEFT_OUT)
"""Terms that Eq. (1) neglects according to the paper, besides acceleration."""
MOST_ERROR = 4.0
"""Error [N m] of Eq. (1) at the paper's pace that counts as negligible; the paper gives none."""
READINGS: tuple[Reading, ...] = ("A", "B")
MISMATCH = 10.0
"""Error [N] of the tension's reference in swing."""
OTHER = "there with a stride of 5 s around it, so that the figures are not the same"
PLACES: dict[Activity, str] = {
    "walk": f"{SOURCE}, section 5.2: EMG; Fig. 13",
    "stairs_up": f"{SOURCE}, section 5.3: EMG upstairs; Fig. 16",
    "stairs_down": f"{SOURCE}, section 5.3: EMG downstairs; Fig. 17",
}
FASTER = f"{SOURCE}, section 5.2: faster walking"
SHARE = "a fifth of the torque, of which the low-pass and co-contraction cost half"
TOO_LATE = "the low-pass is late"
SWING, AFTER = 2.0, 4.0
"""Seconds before and after the switch."""


def printed_change(activity: Activity) -> dict[str, float]:
    """Return the change of the EMG [%]: printed, in walking that of the two printed values."""
    return {"expected" if activity == "walk" else "published": 100.0 * PUBLISHED[activity]}


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


def emg_reductions() -> Iterator[Figure]:
    """EMG proxy, uncalibrated and by the two readings that are fitted to the published figures."""
    for activity, name in NAMES.items():
        yield from _reductions(activity, f"EMG, {name}, 5 s a stride, ")
    walk = partial(Figure, unit="%", source=PLACES["walk"])
    bare = 100.0 * uncalibrated_change("walk", PAPER_STRIDE, changes={"leg.aim_height": 0.0})
    text = note(
        "predicted",
        f"preset {EXACT}, leg.aim_height 0",
        RMS_NORM,
        "the centre of pressure as at natural pace: without the horizontal force the knee then"
        " hardly has to be extended but at the end of stance, where the low-pass is too late",
    )
    name = "EMG, walking, 5 s a stride, uncalibrated, centre of pressure as measured"
    yield walk(name, bare, expected=100.0 * PUBLISHED["walk"], note=text, why=TOO_LATE)
    why = "the paper: faster, Eq. (1) no longer is a good estimate"
    text = note("predicted", f"preset {EXACT}", RMS_NORM, why)
    quick = 100.0 * uncalibrated_change("walk", NATURAL_STRIDE)
    name = f"EMG, walking, {NATURAL_STRIDE:g} s a stride, uncalibrated"
    yield walk(name, quick, note=text, source=FASTER)
    for stride in (PAPER_STRIDE, NATURAL_STRIDE):
        yield from _estimator_errors(stride)
    ratio = estimator_error(NATURAL_STRIDE) / estimator_error(PAPER_STRIDE)
    name = "error of Eq. (1) at natural pace over that at 5 s"
    words = "no longer provides a good estimate"
    text = note("predicted", "preset full balance of the leg", "RMS in stance")
    yield Figure(name, ratio, "", FASTER, note=text, at_least=1.0, claim=words)


def _reductions(activity: Activity, title: str) -> Iterator[Figure]:
    """Yield the uncalibrated reading, and the fitted ones without and with the low-pass."""
    known: dict[str, Any] = {"source": PLACES[activity], **printed_change(activity)}
    plain = 100.0 * uncalibrated_change(activity, PAPER_STRIDE)
    bare = 100.0 * uncalibrated_change(activity, PAPER_STRIDE, exact=True, floor=0.0)
    why = (
        f"20 % of Eq. (1) at all times and no co-contraction were {bare:.1f} %; the low-pass"
        " (0.16 s late), the swing and co-contraction cost the rest; a proxy in proportion to"
        " torque falls by the share that is borne, so that the published figure needs a reading"
        " of its own"
    )
    preset = f"preset {EXACT}{ASSUMED[activity]}"
    text = note("predicted", preset, RMS_NORM, why)
    yield Figure(f"{title}uncalibrated", plain, "%", note=text, why=SHARE, **known)
    for reading in READINGS:
        constant = calibration(activity, reading)
        means = {
            "A": f"true demand = {constant:g} of Eq. (1)",
            "B": f"EMG = torque to the power {constant:g}",
        }[reading]
        name = f"{title}calibrated {reading}"
        at_once = "preset 20 % of Eq. (1) delivered exactly and at once"
        text = note("calibrated", at_once, RMS_NORM, f"{means}, fitted to this figure")
        ours = 100.0 * change(activity, reading, constant)
        yield Figure(name, ours, "%", tolerance=0.1, note=text, given=True, **known)
        why = f"{means}, fitted to exact delivery; the low-pass is late"
        late = 100.0 * change(activity, reading, constant, as_referred=True)
        text = note("predicted", preset, RMS_NORM, why)
        name = f"{name}, behind the low-pass"
        yield Figure(name, late, "%", note=text, why=TOO_LATE, **known)


def _estimator_errors(stride: float) -> Iterator[Figure]:
    """Yield the error of Eq. (1) by the source of the lean and by the added terms."""
    eq_1 = f"{SOURCE}, Eq. (1)" if stride == PAPER_STRIDE else FASTER
    torque = partial(Figure, unit="N m", source=eq_1)
    tag = ("predicted", "preset full balance of the leg", "RMS in stance")
    why = "it leaves out the ground's horizontal force and the shank's weight and inertia"
    title = f"error of Eq. (1), {stride:g} s a stride, "
    for flat, sensed in enumerate(LEANS):
        judged = stride == PAPER_STRIDE and not flat
        more = ("4 N m are taken for negligible",) if judged else ()
        known: dict[str, Any] = {}
        if judged:
            known = {"at_most": MOST_ERROR, "why": LATE, "claim": "gentle and slow"}
        where = f"{SOURCE}, section 2.3: slow motion; Eq. (1)" if judged else eq_1
        name, text = f"{title}lean from {sensed}", note(*tag, why, *more)
        yield torque(name, estimator_error(stride, flat), note=text, source=where, **known)
    left = {added: estimator_error(stride, added=added) for added in ((), *TERMS)}
    for added in TERMS:
        name = f"{title}with the {' and the '.join(added)}"
        yield torque(name, left[added], note=note(*tag))
    if stride == PAPER_STRIDE:
        for term, words in zip(LEFT_OUT, ("negligible", "ignorable"), strict=True):
            name, text = f"{title}share due to the {term}", note(*tag, "10 % is taken for this")
            where, share = f"{SOURCE}, section 2.3: {term}", 1.0 - left[term,] / left[()]
            yield torque(
                name, share, unit="", source=where, note=text, at_most=0.1, claim=words, why=LATE
            )


LATE = (
    "most of it is of late stance, where the shank leans and its weight, which the paper takes to"
    " be ignorable, comes to 3 N m RMS"
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


def switching_transient() -> Iterator[Figure]:
    """Tension error and jump of the pressure after a switch, with and without bumpless transfer."""
    figure = partial(Figure, source=f"{SOURCE}, section 4.2: transience dies out; Eq. (13)")
    preset = f"preset as printed, mismatch {MISMATCH:g} N, linear plant, {SWING:g} s of swing"
    errors = list[float]()
    for name, theirs, least, most in (
        ("with bumpless transfer", "11.4 N and 7.7 kPa", None, 15.0),
        ("without bumpless transfer", "46 N and 220 kPa", 40.0, None),
    ):
        error, jump = linear_switch(MISMATCH, compensated=name.startswith("with "))
        other = f"{theirs} by another program, {OTHER}"
        text = note("predicted", preset, "largest after the switch", other)
        yield figure(f"tension error {name}", error, "N", at_least=least, at_most=most, note=text)
        text = note("predicted", preset, "at the switch", other)
        yield figure(f"pressure jump {name}", jump, "kPa", note=text)
        errors.append(error)
    name = "tension error with over without"
    text = note("predicted", preset, "largest after the switch")
    words = "can die out quickly"
    yield figure(name, errors[0] / errors[1], note=text, at_most=1.0, claim=words)


GROUPS: tuple[Group, ...] = (emg_reductions, switching_transient)
