"""``PAM/ElbowOrthosis-v0``: virtual objects rendered at the elbow, chakarov2018.

Two bundles of pneumatic muscles turn the elbow of an orthosis through a pulley: bundle b flexes it,
bundle a extends it. The two pressures set torque and stiffness of the joint together. The wearer
moves the forearm along an intended motion and holds it like a spring and a damper; the orthosis has
to render a weight in the hand, a wall, or free motion. Desired torque and stiffness are functions
of the angle, clipped to the range of the pressures there, torque first.

Observation (float32; scaled to [-1, 1] over the range, or SI with ``normalize=False``):

| # | signal | unit | range |
|---|--------|------|-------|
| 0 | angle, sensed | rad | -0.2 .. 2.4 |
| 1 | rate, of the last two readings of the angle | rad/s | -10 .. 10 |
| 2 | pressure_a, sensed | Pa | 0 .. 6e5 |
| 3 | pressure_b, sensed | Pa | 0 .. 6e5 |
| 4 | set_point_a, of the last period (on/off valves: the last pulse_a) | Pa (s) | as the action |
| 5 | set_point_b (pulse_b) | Pa (s) | as the action |
| 6 | torque, estimated from the readings, without friction | N m | -30 .. 30 |
| 7 | stiffness, estimated likewise | N m/rad | 0 .. 15 |
| then | to_pulse, time until a pulse is taken (on/off valves only) | s | 0 .. 0.05 |
| then | reference, the desired torque at the sensed angle | N m | -30 .. 30 |
| then | reference_1 .., along the intended motion | N m | -30 .. 30 |
| then | stiffness_reference, at the sensed angle | N m/rad | 0 .. 15 |
| then | stiffness_reference_1 .., along the intended motion | N m/rad | 0 .. 15 |

With more muscles than three and seven the ranges of torque and stiffness are larger
(:func:`signal_ranges`).

Action: pressure_a_set_point and pressure_b_set_point, 0 .. 6e5 Pa; with on/off valves pulse_a and
pulse_b, -0.05 .. 0.05 s, of which one in 50 ms is taken, positive to fill; or torque and stiffness.

Reward, each control period:
``- |torque error| / 0.5 N m - 0.2 |stiffness error| / 0.5 N m/rad - 0.2 (change of both setpoints)
/ 12 bar`` (on/off valves: the last pulse widths / 0.1 s). Where a stop ends the episode,
``reward/ended`` adds the lowest possible reward of each remaining period, so that a policy never
gains by ending an episode.

Start: at rest where the wearer holds the forearm, under the pressures for the references there
(``start="random"``: under random pressures up to half the range). End: truncated after
``episode_seconds``; terminated when a mechanical stop is pressed in by 0.15 rad.

Arguments: :func:`make_setup`, and those of every environment
(:class:`~pam_envs.envs.core.arguments.Common`). Versions: v0, the first.
"""

import math
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.envs.core.arguments import Common, Randomization, environment_arguments, environments
from pam_envs.envs.core.setup import Part, Setup, check_choice, check_number, compose
from pam_envs.envs.elbow import layout as L
from pam_envs.envs.elbow.kernels import kernels_for
from pam_envs.parameters import declarations
from pam_envs.plants.elbow_orthosis import rows as R
from pam_envs.plants.elbow_orthosis.plant import MAKES, ElbowOrthosis
from pam_envs.references.reaches import MOTIONS
from pam_envs.tasks.torque_stiffness import MIXED, OBJECTS, WEIGHT, TorqueStiffness

ANGLES, RATES = (-0.2, 2.4), (-10.0, 10.0)
LEAST_RANGES, ROUND = (30.0, 15.0), 5.0
"""Smallest ranges of torque [N m] and stiffness [N m/rad], and the step of rounding."""
MARGIN = math.radians(5.0)
"""Smallest distance [rad] of intended motions from the ends of the range."""
RANDOMIZATION = Randomization(
    R.NAMES,
    (
        *("regulator.max_pressure", "valve.frequency", "pulley.radius", "pulley.lowest"),
        *("pulley.highest", "bundle_a.muscles", "bundle_b.muscles", "wearer.handle"),
    ),
    "{'wearer.stiffness': (15, 30)}",
    lowest=("link.inertia", "wearer.inertia"),
    highest=(
        *("link.damping", "wearer.damping", "wearer.stiffness", "pulley.stop_stiffness"),
        *("bundle_a.gain", "bundle_b.gain"),
    ),
)


default_plant = lru_cache(maxsize=8)(ElbowOrthosis.paper)


def _plant(given: Common, valves: Any) -> ElbowOrthosis:
    """Return the orthosis that the arguments name."""
    if valves is not None:
        check_choice("valves", valves, MAKES)
    made = given.plant_of(ElbowOrthosis, partial(default_plant, valves=valves or MAKES[0]))
    if valves is not None and made.valves != valves:
        raise ValueError(
            f"valves = {valves!r} but the plant's are {made.valves!r}; leave valves out, or give "
            f"ElbowOrthosis.paper(valves={valves!r})"
        )
    return made


def model_row(plant: ElbowOrthosis) -> NDArray[np.float64]:
    """Return the nominal model of the bundles, in the order of ``MODEL``."""
    full, pulley = plant.full_pressure, plant.pulley
    model = {name: getattr(pulley, name) for name in ("radius", "lowest", "highest")}
    lows, highs = plant.coefficients(0.0, 0.0), plant.coefficients(full, full)
    bundles = (plant.bundle_a, plant.bundle_b)
    for side, bundle, low, high in zip("ab", bundles, lows, highs, strict=True):
        model |= {f"length_{side}": bundle.nominal_length, f"reach_{side}": bundle.reach}
        model |= {f"low_{side}": float(low), f"high_{side}": float(high)}
    model |= {"full_pressure": full, "weight": float(plant.weight_torque(0.5 * math.pi))}
    return np.array([model[name] for name in L.MODEL._fields])


def signal_ranges(plant: ElbowOrthosis) -> tuple[float, float]:
    """Return the ranges of the signals of torque [N m] and stiffness [N m/rad].

    The largest values at any corner of the pressures, rounded up.
    """
    return tuple(  # type: ignore[return-value]
        max(least, ROUND * math.ceil(float(np.abs(values).max()) / ROUND))
        for values, least in zip(_corners(plant), LEAST_RANGES, strict=True)
    )


def largest_errors(plant: ElbowOrthosis) -> tuple[float, float]:
    """Return upper bounds of the errors of torque [N m] and stiffness [N m/rad].

    References are between the corners of the nominal bundles; the true bundles can be stronger by
    the largest allowed gain.
    """
    torques, stiffnesses = _corners(plant)
    strongest = declarations(plant.bundle_a)["gain"].high
    return strongest * float(np.ptp(torques)), strongest * float(stiffnesses.max())


def _corners(plant: ElbowOrthosis) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return torque and stiffness at the corners of the pressures, over all angles."""
    return plant.corners(np.linspace(*plant.hard_limits, 49))


def _signals(plant: ElbowOrthosis, action: str) -> tuple[list[Part], list[Part], list[Part]]:
    """Return the signals of the observation, its references and the action."""
    pulsed, pressures = plant.valves == "on_off", ("Pa", 0.0, plant.full_pressure)
    torque, stiffness = signal_ranges(plant)
    torques, stiffnesses = ("N m", -torque, torque), ("N m/rad", 0.0, stiffness)
    pulses = ("s", -plant.cycle, plant.cycle)
    word, span = ("pulse", pulses) if pulsed else ("set_point", pressures)
    observation: list[Part] = [
        ("angle", "rad", *ANGLES),
        ("rate", "rad/s", *RATES),
        ("pressure_a", *pressures),
        ("pressure_b", *pressures),
        (f"{word}_a", *span),
        (f"{word}_b", *span),
        ("torque", *torques),
        ("stiffness", *stiffnesses),
    ]
    if pulsed:
        observation.append(("to_pulse", "s", 0.0, plant.cycle))
    form = "pulse_{}" if pulsed else "pressure_{}_set_point"
    actions: list[Part] = [(form.format(bundle), *span) for bundle in "ab"]
    if action == "torque_stiffness":
        actions = [("torque_set_point", *torques), ("stiffness_set_point", *stiffnesses)]
    references: list[Part] = [("reference", *torques), ("stiffness_reference", *stiffnesses)]
    return observation, references, actions


def _span(plant: ElbowOrthosis, span: Any) -> tuple[float, float]:
    """Return the range [rad] of the intended motion."""
    low, high = plant.angle_range
    if span is None:
        return low + 3.0 * MARGIN, high - 3.0 * MARGIN
    if np.shape(span) != (2,):
        raise ValueError(f"span = {span!r} must be two angles [rad]")
    a, b = (check_number("span", angle, low + MARGIN, high - MARGIN, "rad") for angle in span)
    if a >= b:
        raise ValueError(f"span = {span!r} must begin below its end; swap them")
    return a, b


def _weights(task: TorqueStiffness, weight: Any, kind: int) -> tuple[float, float]:
    """Return the range of the drawn weight [kg]."""
    if weight is None:
        return task.lightest, task.heaviest
    if kind not in (WEIGHT, MIXED):
        raise ValueError(
            f"weight = {weight!r} but the reference has no weight; leave it out, or take "
            "reference = 'weight' or 'mixed'"
        )
    kilograms = check_number("weight", weight, 0.0, 20.0, "kg")
    return kilograms, kilograms


@environment_arguments(reference="mixed", preview=0, preview_stride=4, episode_seconds=10.0)
def make_setup(
    given: Common,
    valves: str | None = None,
    action: str = "pressures",
    motion: str = "reaches",
    span: Any = None,
    pace: float = 2.5,
    weight: float | None = None,
    bear: bool = True,
    start: str = "ready",
) -> Setup:
    """Return the checked configuration of an environment with the elbow orthosis.

    Parameters
    ----------
    given : Common
        Plant: an ``ElbowOrthosis``, by default ``ElbowOrthosis.paper()``. Reference: the virtual
        object, "weight", "wall", "free", or "mixed" (each episode draws one); or samples of torque
        [N m] and stiffness [N m/rad], two numbers per control period. Previews are those along
        the intended motion, which no orthosis can know. Reward:
        :class:`~pam_envs.tasks.torque_stiffness.TorqueStiffness`.
    valves : {"proportional", "on_off"}, optional
        Pressure regulators, or a fill and an exhaust valve for each bundle, as in the paper.
        Default: those of the plant, or proportional.
    action : {"pressures", "torque_stiffness"}
        Two pressure setpoints (with on/off valves: two pulse widths), or torque and stiffness,
        which the orthosis converts to pressure setpoints.
    motion : {"reaches", "sines", "still", "mixed"}
        Intended motion of the wearer.
    span : (float, float), optional
        Range of the intended motion [rad]. Default: 15 degrees within the range of the joint.
    pace : float
        Duration [s] of a reach with its rest; a sine takes two of them or more.
    weight : float, optional
        Weight in the hand [kg], for references with a weight. Default: each episode draws one.
    bear : bool
        Whether the orthosis compensates its own weight.
    start : {"ready", "random"}
        Under the pressures for the references, or under random ones.
    """
    made = _plant(given, valves)
    most = tuple(2.0 * largest for largest in signal_ranges(made))
    kind, samples = given.reference_of(OBJECTS, "N m, N m/rad", most, channels=L.CHANNELS)
    if samples[1].min() < 0.0:
        raise ValueError(
            f"reference has a stiffness of {samples[1].min():g} N m/rad; give 0 or more"
        )
    check_choice("action", action, L.ACTIONS)
    check_choice("motion", motion, MOTIONS)
    check_choice("start", start, ("ready", "random"))
    check_choice("bear", bear, (True, False))
    pulsed = made.valves == "on_off"
    if pulsed and action == "torque_stiffness":
        raise ValueError(
            "action = 'torque_stiffness' needs regulators, and on/off valves have none; take "
            "action = 'pressures', or valves = 'proportional'"
        )
    task, full = given.task_of(TorqueStiffness), made.full_pressure
    lightest, heaviest = _weights(task, weight, kind)
    low, high = _span(made, span)
    own = np.zeros((3, max(len(L.MODEL), samples.shape[1])))
    own[0, : len(L.MODEL)], own[1:, : samples.shape[1]] = model_row(made), samples
    config = {
        **vars(task),
        "lightest": lightest,
        "heaviest": heaviest,
        "handle": made.wearer.handle,
        "lowest_angle": made.hard_limits[0],
        "highest_angle": made.hard_limits[1],
        "bears": 1.0 if bear else 0.0,
        "motion_low": low,
        "motion_high": high,
        "window": check_number("pace", pace, 0.2, 60.0, "s"),
        "command_range": 2.0 * (made.cycle if pulsed else full),
        "start_share": 0.5 * full if start == "random" else 0.0,
        "worst_period": task.worst(*largest_errors(made)),
    }
    choices = {
        "motion": MOTIONS.index(motion),
        "mode": L.ACTIONS.index(action),
        "pulsed": int(pulsed),
        "samples": samples.shape[1],
    }
    observation, references, actions = _signals(made, action)
    return compose(
        made,
        partial(kernels_for, made.hysteresis.kind, made.valves),
        given,
        RANDOMIZATION,
        observation=observation,
        references=references,
        action=actions,
        config=config,
        choices=choices,
        reference=kind,
        own=own,
        samples=samples,
        view="pam_envs.envs.elbow.view:VIEW",
    )


ElbowOrthosisEnv, ElbowOrthosisVectorEnv = environments("ElbowOrthosis", make_setup)
