"""``PAM/ElbowOrthosis-v0``: objects that are not there, felt through the elbow, chakarov2018.

Two bundles of pneumatic muscles turn the elbow of an orthosis over a pulley: bundle b bends it,
bundle a straightens it. Torque and stiffness of the joint are set at once by their two pressures.
The wearer moves his forearm as he intends and holds it like a spring and a damper; the orthosis has
to make him feel a weight in his hand, a wall, or nothing at all. What is wanted of it is a function
of the angle, held to what the pressures can give there, torque first.

Observation (float32; scaled to [-1, 1] over the range, or SI with ``normalize=False``):

| # | signal | unit | range |
|---|--------|------|-------|
| 0 | angle, sensed | rad | -0.2 .. 2.4 |
| 1 | rate, of the last two readings of the angle | rad/s | -10 .. 10 |
| 2 | pressure_a, sensed | Pa | 0 .. 6e5 |
| 3 | pressure_b, sensed | Pa | 0 .. 6e5 |
| 4 | set_point_a, of the last period (on/off valves: the last pulse_a) | Pa (s) | as the action |
| 5 | set_point_b (pulse_b) | Pa (s) | as the action |
| 6 | torque, from angle and pressures as sensed, without friction | N m | -30 .. 30 |
| 7 | stiffness, likewise | N m/rad | 0 .. 15 |
| then | to_pulse, time until a pulse is taken (on/off valves only) | s | 0 .. 0.05 |
| then | reference, the torque wanted at the angle as sensed | N m | -30 .. 30 |
| then | reference_1 .., along the intended motion | N m | -30 .. 30 |
| then | stiffness_reference, at the angle as sensed | N m/rad | 0 .. 15 |
| then | stiffness_reference_1 .., along the intended motion | N m/rad | 0 .. 15 |

More muscles than three and seven can do more: torque and stiffness then reach further, up to what
full bundles do (:func:`~pam_envs.envs.elbow.ranges.signal_ranges`).

Action: pressure_a_set_point and pressure_b_set_point, 0 .. 6e5 Pa; with on/off valves pulse_a and
pulse_b, -0.05 .. 0.05 s, of which one in 50 ms is taken, positive to fill; or torque and stiffness.

Reward, each control period: ``- |torque error| / 0.5 N m - 0.2 |stiffness error| / 0.5 N m/rad
- 0.2 (change of both set-points) / 12 bar`` (on/off valves: the widths of the pulses that were last
taken / 0.1 s); where a stop ends the episode, the worst that a period can cost for each one that is
left as well, so that it never pays.

Start: at rest where the wearer holds the forearm, under the pressures that are asked for there
(``start="random"``: under any of half the range). End: truncated after ``episode_seconds``;
terminated where a mechanical stop has been pressed in by 0.15 rad.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
from pam_envs.envs.elbow import layout as L
from pam_envs.envs.elbow.kernels import kernels_for
from pam_envs.envs.elbow.ranges import largest_errors, signal_ranges
from pam_envs.parameters import Signal, Signals
from pam_envs.plants.elbow_orthosis import rows as R
from pam_envs.plants.elbow_orthosis.plant import MAKES, ElbowOrthosis, Valves
from pam_envs.plants.single_muscle.hysteresis import Kind
from pam_envs.references.reaches import MOTIONS
from pam_envs.tasks.torque_stiffness import MIXED, OBJECTS, WEIGHT, TorqueStiffness

ANGLES, RATES = (-0.2, 2.4), (-10.0, 10.0)
MARGIN = math.radians(5.0)
"""References of motion stay this far [rad] within the range, or more."""
NOT_DRAWN = (
    "regulator.max_pressure",
    "valve.frequency",
    "pulley.radius",
    "pulley.lowest",
    "pulley.highest",
    "bundle_a.muscles",
    "bundle_b.muscles",
    "wearer.handle",
)
"""Parameters that ``randomize`` may not draw: they scale the action or the references."""
CORNER = {
    "link.inertia": min,
    "link.damping": max,
    "wearer.inertia": min,
    "wearer.damping": max,
    "wearer.stiffness": max,
    "pulley.stop_stiffness": max,
    "bundle_a.gain": max,
    "bundle_b.gain": max,
}
"""Which end of a range makes the motion faster."""


@lru_cache(maxsize=8)
def _stock(valves: Valves, hysteresis: Kind) -> ElbowOrthosis:
    return ElbowOrthosis.paper(hysteresis, valves=valves)


def _plant(plant: Any, hysteresis: Any, valves: Any) -> ElbowOrthosis:
    """Return the orthosis that the arguments name."""
    if valves is not None:
        check_choice("valves", valves, MAKES)
    made = plant_of(ElbowOrthosis, plant, hysteresis, lambda kind: _stock(valves or MAKES[0], kind))
    if valves is not None and made.valves != valves:
        raise ValueError(
            f"valves = {valves!r} but the plant's are {made.valves!r}; leave valves out, or give "
            f"ElbowOrthosis.paper(valves={valves!r})"
        )
    return made


def model_row(plant: ElbowOrthosis) -> NDArray[np.float64]:
    """Return what the orthosis' own program is told of its bundles, in the order of ``MODEL``."""
    full, pulley = plant.full_pressure, plant.pulley
    low_a, low_b = (float(x) for x in plant.coefficients(0.0, 0.0))
    high_a, high_b = (float(x) for x in plant.coefficients(full, full))
    lengths = [(b.nominal_length, b.reach) for b in (plant.bundle_a, plant.bundle_b)]
    upright = float(plant.weight_torque(0.5 * math.pi))
    return np.array(
        [
            pulley.radius,
            pulley.lowest,
            pulley.highest,
            *lengths[0],
            *lengths[1],
            low_a,
            high_a,
            low_b,
            high_b,
            full,
            upright,
        ]
    )


def _own(plant: ElbowOrthosis, samples: NDArray[np.float64]) -> NDArray[np.float64]:
    model = model_row(plant)
    rows = np.zeros((3, max(len(model), samples.shape[1])))
    rows[0, : len(model)] = model
    rows[1:, : samples.shape[1]] = samples
    return rows


def _commands(plant: ElbowOrthosis) -> tuple[str, str, float, float]:
    """Return the name of what a bundle's valves are told, its unit and its range."""
    if plant.valves == "on_off":
        return "pulse", "s", -plant.cycle, plant.cycle
    return "set_point", "Pa", 0.0, plant.full_pressure


def _spans(plant: ElbowOrthosis) -> tuple[tuple[float, float], tuple[float, float]]:
    torque, stiffness = signal_ranges(plant)
    return (-torque, torque), (0.0, stiffness)


def _actions(plant: ElbowOrthosis, action: str, normalize: bool) -> Signals:
    word, unit, low, high = _commands(plant)
    form = "pulse_{}" if word == "pulse" else "pressure_{}_set_point"
    parts = [(form.format(bundle), unit, low, high) for bundle in "ab"]
    if action == "torque_stiffness":
        torques, stiffnesses = _spans(plant)
        parts = [
            ("torque_set_point", "N m", *torques),
            ("stiffness_set_point", "N m/rad", *stiffnesses),
        ]
    return Signals(Signal(*part, i, normalize) for i, part in enumerate(parts))


def _signals(plant: ElbowOrthosis, preview: int, spacing: float, normalize: bool) -> Signals:
    pressures, (torques, stiffnesses) = (0.0, plant.full_pressure), _spans(plant)
    word, unit, low, high = _commands(plant)
    parts: list[tuple[str, str, tuple[float, float], float]] = [
        ("angle", "rad", ANGLES, 0.0),
        ("rate", "rad/s", RATES, 0.0),
        ("pressure_a", "Pa", pressures, 0.0),
        ("pressure_b", "Pa", pressures, 0.0),
        (f"{word}_a", unit, (low, high), 0.0),
        (f"{word}_b", unit, (low, high), 0.0),
        ("torque", "N m", torques, 0.0),
        ("stiffness", "N m/rad", stiffnesses, 0.0),
    ]
    if word == "pulse":
        parts.append(("to_pulse", "s", (0.0, plant.cycle), 0.0))
    for name, its_unit, span in (
        ("reference", "N m", torques),
        ("stiffness_reference", "N m/rad", stiffnesses),
    ):
        parts.append((name, its_unit, span, 0.0))
        parts += [(f"{name}_{i + 1}", its_unit, span, (i + 1) * spacing) for i in range(preview)]
    return Signals(
        Signal(name, unit, low, high, i, normalize, ahead)
        for i, (name, unit, (low, high), ahead) in enumerate(parts)
    )


def _span(plant: ElbowOrthosis, span: Any) -> tuple[float, float]:
    """Return between which angles [rad] the wearer moves."""
    low, high = plant.angle_range
    if span is None:
        return low + 3.0 * MARGIN, high - 3.0 * MARGIN
    try:
        first, last = span
    except (TypeError, ValueError) as error:
        raise ValueError(f"span = {span!r} must be two angles [rad]") from error
    lowest, highest = low + MARGIN, high - MARGIN
    a, b = (check_number("span", angle, lowest, highest, "rad") for angle in (first, last))
    if a >= b:
        raise ValueError(f"span = {span!r} must begin below its end; swap them")
    return a, b


def _reference(plant: ElbowOrthosis, reference: Any) -> tuple[int, NDArray[np.float64]]:
    """Return the object's number, and torque and stiffness where they are given as samples."""
    most = tuple(2.0 * largest for largest in signal_ranges(plant))
    kind, samples = reference_of(reference, OBJECTS, "N m, N m/rad", most, channels=L.CHANNELS)
    if samples.min(axis=1)[1] < 0.0:
        raise ValueError(
            f"reference has a stiffness of {samples.min(axis=1)[1]:g} N m/rad; give 0 or more"
        )
    return kind, samples


def _weights(task: TorqueStiffness, weight: Any, kind: int) -> tuple[float, float]:
    """Return the lightest and the heaviest weight [kg] that is drawn."""
    if weight is None:
        return task.lightest, task.heaviest
    if kind not in (WEIGHT, MIXED):
        raise ValueError(
            f"weight = {weight!r} but no weight is to be felt; leave it out, or take reference = "
            "'weight' or 'mixed'"
        )
    kilograms = check_number("weight", weight, 0.0, 20.0, "kg")
    return kilograms, kilograms


@named_arguments
def make_setup(
    hysteresis: Kind | None = None,
    plant: ElbowOrthosis | str | Path | None = None,
    reference: Any = "mixed",
    preview: int = 0,
    preview_stride: int = 4,
    episode_seconds: float = 10.0,
    randomize: Any = False,
    normalize: bool = True,
    render_mode: str | None = None,
    valves: str | None = None,
    action: str = "pressures",
    motion: str = "reaches",
    span: Any = None,
    pace: float = 2.5,
    weight: float | None = None,
    bear: bool = True,
    start: str = "ready",
    reward: Mapping[str, float] | None = None,
) -> Setup:
    """Return the checked configuration of an environment with the elbow orthosis.

    Parameters
    ----------
    hysteresis : {"maxwell_slip", "preisach", "none"}, optional
        The bundles' hysteresis. Default: that of ``plant``, or Maxwell-slip.
    plant : ElbowOrthosis or path, optional
        Another plant. Default: ``ElbowOrthosis.paper()``.
    reference : str or array_like
        The object that is to be felt: "weight", "wall", "free", or "mixed" (each episode draws
        one). Or samples of torque [N m] and stiffness [N m/rad], two numbers a control period (the
        last ones hold).
    preview, preview_stride : int
        Future samples of both references in the observation, and control periods between them.
        They are those along the motion that the wearer intends, which no orthosis can know.
    episode_seconds : float
        Duration [s].
    randomize : bool or mapping
        True: every episode draws the assumed parameters within their declared ranges. A mapping
        {"wearer.stiffness": (low, high)}: just those.
    normalize : bool
        Observation and action in [-1, 1], or SI.
    render_mode : {None, "rgb_array", "human"}
        As Gymnasium means it.
    valves : {"proportional", "on_off"}, optional
        Pressure regulators, or a fill and an exhaust valve for each bundle, as in the paper.
        Default: those of ``plant``, or proportional.
    action : {"pressures", "torque_stiffness"}
        Two set-points of pressure (with on/off valves: two pulse widths), or torque and stiffness,
        which the orthosis' own program turns into set-points of pressure.
    motion : {"reaches", "sines", "still", "mixed"}
        What the wearer intends.
    span : (float, float), optional
        Between which angles [rad]. Default: 15 degrees within the range.
    pace : float
        Duration [s] of a reach with its rest; a sine takes two of them or more.
    weight : float, optional
        Of the weight in the hand [kg], where one is to be felt. Default: each episode draws one.
    bear : bool
        Whether the orthosis is to bear its own weight.
    start : {"ready", "random"}
        Under the pressures that are asked for, or random ones.
    reward : mapping, optional
        Fields of :class:`pam_envs.tasks.torque_stiffness.TorqueStiffness` to change.

    Raises
    ------
    ValueError
        Naming the argument, its value, the bounds and the remedy.
    """
    made = _plant(plant, hysteresis, valves)
    kind, samples = _reference(made, reference)
    given = common(preview, preview_stride, episode_seconds, normalize, render_mode)
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
    task = task_of(TorqueStiffness, reward)
    full = made.full_pressure
    config = (
        task.torque_weight,
        task.torque_scale,
        task.stiffness_weight,
        task.stiffness_scale,
        task.effort_weight,
        task.soft_pressure,
        *_weights(task, weight, kind),
        made.wearer.handle,
        task.softest_free,
        task.stiffest_free,
        task.softest_held,
        task.stiffest_held,
        task.nearest_wall,
        task.farthest_wall,
        task.softest_wall,
        task.stiffest_wall,
        task.wall_depth,
        *made.hard_limits,
        1.0 if bear else 0.0,
        *_span(made, span),
        check_number("pace", pace, 0.2, 60.0, "s"),
        2.0 * (made.cycle if pulsed else full),
        0.5 * full if start == "random" else 0.0,
        task.worst(*largest_errors(made)),
    )
    fixed = L.COMMON_SIGNALS + (1 if pulsed else 0)
    mode = L.ACTIONS.index(action)
    example = "{'wearer.stiffness': (15, 30)}"
    return compose(
        made,
        kernels_for(made.hysteresis.kind, made.valves),
        given,
        signals=_signals(made, given.preview, given.stride * made.control_period, normalize),
        actions=_actions(made, action, normalize),
        config=config,
        choices=(
            made.elements,
            kind,
            MOTIONS.index(motion),
            mode,
            int(pulsed),
            fixed,
            samples.shape[1],
        ),
        own=_own(made, samples),
        samples=samples,
        tables=made.hysteresis_tables(),
        spread=spread_of(made, R.PARAMETERS, NOT_DRAWN, randomize, example, CORNER),
        drawn=randomize is not False,
    )


class ElbowOrthosisEnv(PlantEnv):
    """The single environment (see the module's page)."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(make_setup(**arguments))


class ElbowOrthosisVectorEnv(PlantVectorEnv):
    """The batched environment (see the module's page)."""

    def __init__(
        self, num_envs: int = 1, info: bool = True, threads: int | None = None, **arguments: Any
    ) -> None:
        super().__init__(make_setup(**arguments), num_envs, info, threads)
