"""``PAM/AntagonisticJoint-v0``: a joint between two pneumatic muscles, fluidic_muscles.

Two muscles pull a lever from both sides. The angle ``phi`` is 0 where both are equally long and
positive towards muscle A. Hysteresis of the muscles' friction makes the angle lag behind what is
asked for. The action is a set-point of the angle, which the static laws of both muscles turn into
two pressures under a fixed prestress; or set-points of angle and prestress, that is of position and
stiffness; or the two pressures.

Observation (float32; scaled to [-1, 1] over the range, or SI with ``normalize=False``):

| # | signal | unit | range |
|---|--------|------|-------|
| 0 | angle, sensed | rad | -0.8 .. 0.8 |
| 1 | pressure_a, sensed | Pa | 0 .. 6.5e5 |
| 2 | pressure_b, sensed | Pa | 0 .. 6.5e5 |
| 3 | set_point_a, of muscle A's pressure in the last period | Pa | 0 .. 6.5e5 |
| 4 | set_point_b, of muscle B's | Pa | 0 .. 6.5e5 |
| 5 | payload, at the start | kg | 0 .. 2 |
| 6 | set_point of the angle in the last period (not of ``"pressures"``) | rad | its range |
| 7 | prestress of the last period (of ``"angle_stiffness"``) | N | its range |
| then | reference, now | rad | -0.8 .. 0.8 |
| then | reference_1 .., ``preview_stride`` periods apart | rad | -0.8 .. 0.8 |

Action: angle_set_point, over the joint's range; or angle_set_point and prestress; or
pressure_a_set_point and pressure_b_set_point, 0 .. 6.5e5 Pa.

Reward: ``-|angle - reference| / 1 degree - 0.2 (change of both pressures' set-points) / 13 bar``
each control period; where a limit ends the episode, the worst that a period can cost for each one
that is left as well, so that it never pays.

Start: at rest at a random angle (``start="straight"``: at 0). End: truncated after
``episode_seconds``; terminated beyond the joint's hard limit.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from pam_envs.envs.core.arguments import (
    common,
    named_arguments,
    payloads_of,
    plant_of,
    reference_of,
    spread_of,
    task_of,
)
from pam_envs.envs.core.plant_env import PlantEnv
from pam_envs.envs.core.setup import Setup, check_choice, check_number, compose
from pam_envs.envs.core.vector_env import PlantVectorEnv
from pam_envs.envs.joint import layout as K
from pam_envs.envs.joint.kernels import kernels_for
from pam_envs.parameters import Signal, Signals
from pam_envs.plants.antagonistic_joint import rows as R
from pam_envs.plants.antagonistic_joint.bearing import check_borne
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.single_muscle.hysteresis import Kind
from pam_envs.references.trajectory import FAMILIES, SAMPLES, sines_needed
from pam_envs.tasks.joint_tracking import JointTracking

ANGLES = (-0.8, 0.8)
"""Range [rad] of angles in the observation."""
MOST_PAYLOAD = 2.0
"""Largest payload [kg]."""
USUAL_SHARE = 2.0 / 3.0
"""References and random starts reach this share of the joint's limit."""
NUMBERS = {len(K.REFERENCES): SAMPLES, len(FAMILIES): K.SINE, len(FAMILIES) + 1: K.STEP}
"""Of references, by their place among those that the environment takes."""
NOT_DRAWN = ("regulator.max_pressure", "link.limit", "link.stop", "nominal.prestress")
"""Parameters that ``randomize`` may not draw: they scale the action or enter derived numbers."""
CORNER = {
    "link.mass": min,
    "link.gyration": min,
    "link.damping": max,
    "link.stop_stiffness": max,
    "muscle.gain": max,
    "lever.r_u": min,
    "lever.r_o": min,
    "lever.l_u": max,
    "lever.l_o": max,
}
"""Which end of a range makes the motion faster, or brings the lever's toggle nearer."""


@lru_cache(maxsize=8)
def _stock(hysteresis: Kind) -> AntagonisticJoint:
    return AntagonisticJoint.paper(hysteresis)


def _actions(plant: AntagonisticJoint, action: str, normalize: bool) -> Signals:
    full = plant.regulator.max_pressure
    angle = ("angle_set_point", "rad", *plant.angle_range)
    parts = {
        "angle": [angle],
        "angle_stiffness": [angle, ("prestress", "N", *plant.prestress_range)],
        "pressures": [(f"pressure_{muscle}_set_point", "Pa", 0.0, full) for muscle in "ab"],
    }[action]
    return Signals(Signal(*part, i, normalize) for i, part in enumerate(parts))


def _signals(
    plant: AntagonisticJoint, action: str, preview: int, spacing: float, normalize: bool
) -> Signals:
    pressures = ("Pa", 0.0, plant.regulator.max_pressure)
    parts: list[tuple[str, str, float, float]] = [
        ("angle", "rad", *ANGLES),
        ("pressure_a", *pressures),
        ("pressure_b", *pressures),
        ("set_point_a", *pressures),
        ("set_point_b", *pressures),
        ("payload", "kg", 0.0, MOST_PAYLOAD),
    ]
    if action != "pressures":
        parts.append(("set_point", "rad", *plant.angle_range))
    if action == "angle_stiffness":
        parts.append(("prestress", "N", *plant.prestress_range))
    fixed = len(parts)
    parts.append(("reference", "rad", *ANGLES))
    parts += [(f"reference_{i + 1}", "rad", *ANGLES) for i in range(preview)]
    return Signals(
        Signal(*part, i, normalize, max(0, i - fixed) * spacing) for i, part in enumerate(parts)
    )


@named_arguments
def make_setup(
    hysteresis: Kind | None = None,
    plant: AntagonisticJoint | str | Path | None = None,
    reference: Any = "steps",
    preview: int = 5,
    preview_stride: int = 4,
    episode_seconds: float = 20.0,
    randomize: Any = False,
    normalize: bool = True,
    render_mode: str | None = None,
    action: str = "angle",
    amplitude: float | None = None,
    frequency: float = 0.5,
    payload: Any = 0.0,
    payload_change: float = 0.0,
    disturbance: float = 0.0,
    start: str = "random",
    reward: Mapping[str, float] | None = None,
) -> Setup:
    """Return the checked configuration of an environment with one antagonistic joint.

    Parameters
    ----------
    hysteresis : {"maxwell_slip", "preisach", "none"}, optional
        The muscles' hysteresis. Default: that of ``plant``, or Maxwell-slip.
    plant : AntagonisticJoint or path, optional
        Another plant. Default: ``AntagonisticJoint.paper()``.
    reference : str or array_like
        "steps", "ramps", "sines", "multisine", "staircase", "mixed", "sine" (one, of ``amplitude``
        and ``frequency``, from 0), "step" (from 0 to ``amplitude`` at 1 s), or samples [rad], one
        a control period (the last one holds).
    preview, preview_stride : int
        Future reference samples in the observation, and control periods between them.
    episode_seconds : float
        Duration [s].
    randomize : bool or mapping
        True: every episode draws the assumed parameters within their declared ranges. A mapping
        {"regulator.time_constant": (low, high)}: just those.
    normalize : bool
        Observation and action in [-1, 1], or SI.
    render_mode : {None, "rgb_array", "human"}
        As Gymnasium means it.
    action : {"angle", "angle_stiffness", "pressures"}
        Set-point of the angle under a fixed prestress; of angle and prestress; of both pressures.
    amplitude : float, optional
        References run from minus this to this [rad]. Default: two thirds of the joint's limit.
        The muscles have to hold link and heaviest payload there.
    frequency : float
        Of the reference "sine" [Hz].
    payload : float, sequence of float or None
        Mass [kg] at the joint; several: each episode draws one; None: any from 0 to 2 kg.
    payload_change : float
        By how much [kg] the payload grows or shrinks, untold, in the middle of an episode.
    disturbance : float
        Largest torque [N m] of the pulses that push the joint, one in 5 s, 1 s long.
    start : {"random", "straight"}
        Rest at a random angle, or at 0.
    reward : mapping, optional
        Fields of :class:`pam_envs.tasks.joint_tracking.JointTracking` to change.

    Raises
    ------
    UnbearableLoad
        If the muscles cannot hold the largest angle with the heaviest payload.
    ValueError
        Naming the argument, its value, the bounds and the remedy.
    """
    made = plant_of(AntagonisticJoint, plant, hysteresis, _stock)
    most = made.angle_range[1]
    place, samples = reference_of(reference, K.REFERENCES, "rad", most)
    family = NUMBERS.get(place, place)
    given = common(preview, preview_stride, episode_seconds, normalize, render_mode)
    check_choice("action", action, K.MODES)
    check_choice("start", start, ("random", "straight"))
    if action == "pressures" and made.dynamics == "reduced":
        raise ValueError(
            "action = 'pressures' needs the muscles, and the reduced plant has none; take "
            "action = 'angle', or AntagonisticJoint.paper()"
        )
    usual = USUAL_SHARE * most
    reach = usual if amplitude is None else check_number("amplitude", amplitude, 0.0, most, "rad")
    task, by_pressure = task_of(JointTracking, reward), action == "pressures"
    actions = _actions(made, action, normalize)
    signals = _signals(made, action, given.preview, given.stride * made.control_period, normalize)
    payloads = payloads_of(payload, MOST_PAYLOAD)
    change = check_number("payload_change", payload_change, 0.0, MOST_PAYLOAD, "kg")
    largest = np.abs(samples).max() if family == SAMPLES else reach
    ends = np.array([[-largest], [largest]])
    check_borne(made, ends, float(payloads.max()) + change, "the reference's ends", by_pressure)
    config = (
        task.tracking_weight,
        task.error_scale,
        task.effort_weight,
        task.soft_share * most,
        task.soft_pressure,
        made.largest_angle,
        reach,
        check_number("frequency", frequency, 1e-3, 20.0, "Hz"),
        usual if start == "random" else 0.0,
        made.prestress,
        change,
        check_number("disturbance", disturbance, 0.0, 100.0, "N m"),
        task.worst(made.largest_angle + most),
    )
    fixed = len(signals) - 1 - given.preview
    sines = sines_needed(family)
    return compose(
        made,
        kernels_for(made.hysteresis.kind, made.dynamics),
        given,
        signals=signals,
        actions=actions,
        config=config,
        choices=(made.elements, family, sines, K.MODES.index(action), payloads.size, fixed),
        own=payloads,
        samples=samples,
        tables=made.hysteresis_tables(),
        spread=spread_of(
            made,
            R.PARAMETERS,
            NOT_DRAWN,
            randomize,
            "{'regulator.time_constant': (0.03, 0.06)}",
            CORNER,
        ),
        drawn=randomize is not False,
    )


class AntagonisticJointEnv(PlantEnv):
    """The single environment (see the module's page)."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(make_setup(**arguments))


class AntagonisticJointVectorEnv(PlantVectorEnv):
    """The batched environment (see the module's page)."""

    def __init__(
        self, num_envs: int = 1, info: bool = True, threads: int | None = None, **arguments: Any
    ) -> None:
        super().__init__(make_setup(**arguments), num_envs, info, threads)
