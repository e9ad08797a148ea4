"""``PAM/AntagonisticJoint-v0``: a joint between two pneumatic muscles, fluidic_muscles.

Two muscles pull a lever from both sides. The angle ``phi`` is 0 where both are equally long and
positive towards muscle A. The friction of the muscles makes the angle follow its setpoint with
hysteresis. The action is a setpoint of the angle, which the static laws of both muscles convert to
two pressures under a fixed prestress; or setpoints of angle and prestress, that is of position and
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
| 6 | set_point of the angle in the last period (not with ``"pressures"``) | rad | its range |
| 7 | prestress of the last period (with ``"angle_stiffness"``) | N | its range |
| then | reference, now | rad | -0.8 .. 0.8 |
| then | reference_1 .., ``preview_stride`` periods apart | rad | -0.8 .. 0.8 |

Action: angle_set_point, over the joint's range; or angle_set_point and prestress; or
pressure_a_set_point and pressure_b_set_point, 0 .. 6.5e5 Pa.

Reward: ``-|angle - reference| / 1 degree - 0.2 (change of both pressures' setpoints) / 13 bar``
each control period. Where a limit ends the episode, ``reward/ended`` adds the lowest possible
reward of each remaining period, so that a policy never gains by ending an episode.

Start: at rest at a random angle (``start="straight"``: at 0). End: truncated after
``episode_seconds``; terminated beyond the joint's hard limit.

Arguments: :func:`make_setup`, and those of every environment
(:class:`~pam_envs.envs.core.arguments.Common`). Versions: v0, the first.
"""

from functools import lru_cache, partial
from typing import Any

import numpy as np

from pam_envs.envs.core.arguments import Common, Randomization, environment_arguments, environments
from pam_envs.envs.core.setup import Part, Setup, check_choice, check_number, compose, masses_of
from pam_envs.envs.joint import kernels as L
from pam_envs.plants.antagonistic_joint import rows as R
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.statics import PRESTRESS_RANGE, check_borne
from pam_envs.references.trajectory import FAMILIES, SAMPLES, sines_needed
from pam_envs.tasks.joint_tracking import JointTracking

ANGLES = (-0.8, 0.8)
"""Range [rad] of angles in the observation."""
MOST_PAYLOAD = 2.0
"""Largest payload [kg]."""
USUAL_SHARE = 2.0 / 3.0
"""Share of the joint's limit that references and random starts reach."""
RANDOMIZATION = Randomization(
    R.NAMES,
    ("regulator.max_pressure", "link.limit", "link.stop", "nominal.prestress"),
    "{'regulator.time_constant': (0.03, 0.06)}",
    lowest=("link.mass", "link.gyration", "lever.r_u", "lever.r_o"),
    highest=("link.damping", "link.stop_stiffness", "muscle.gain", "lever.l_u", "lever.l_o"),
)


default_plant = lru_cache(maxsize=8)(AntagonisticJoint.paper)


def _signals(plant: AntagonisticJoint, action: str) -> tuple[list[Part], list[Part]]:
    """Return the present signals of the observation, and those of the action."""
    pressures = ("Pa", 0.0, plant.regulator.max_pressure)
    observation: list[Part] = [
        ("angle", "rad", *ANGLES),
        ("pressure_a", *pressures),
        ("pressure_b", *pressures),
        ("set_point_a", *pressures),
        ("set_point_b", *pressures),
        ("payload", "kg", 0.0, MOST_PAYLOAD),
    ]
    if action == "pressures":
        return observation, [(f"pressure_{muscle}_set_point", *pressures) for muscle in "ab"]
    angles = ("rad", *plant.angle_range)
    prestress: list[Part] = [("prestress", "N", *PRESTRESS_RANGE)]
    stiff = prestress if action == "angle_stiffness" else []
    return [*observation, ("set_point", *angles), *stiff], [("angle_set_point", *angles), *stiff]


@environment_arguments(reference="steps", preview=5, preview_stride=4, episode_seconds=20.0)
def make_setup(
    given: Common,
    action: str = "angle",
    amplitude: float | None = None,
    frequency: float = 0.5,
    payload: Any = 0.0,
    payload_change: float = 0.0,
    disturbance: float = 0.0,
    start: str = "random",
) -> Setup:
    """Return the checked configuration of an environment with one antagonistic joint.

    Parameters
    ----------
    given : Common
        Plant: an ``AntagonisticJoint``, by default ``AntagonisticJoint.paper()``. Reference:
        "steps", "ramps", "sines", "multisine", "staircase", "mixed", "sine" (one, of ``amplitude``
        and ``frequency``, from 0), "step" (from 0 to ``amplitude`` at 1 s), or samples [rad].
        Reward: :class:`~pam_envs.tasks.joint_tracking.JointTracking`.
    action : {"angle", "angle_stiffness", "pressures"}
        Setpoint of the angle under a fixed prestress; of angle and prestress; of both pressures.
    amplitude : float, optional
        Amplitude of references [rad]. Default: two thirds of the joint's limit. The muscles have
        to hold the link and the heaviest payload there.
    frequency : float
        Frequency of the reference "sine" [Hz].
    payload : float, sequence of float or None
        Mass [kg] at the joint; of several, each episode draws one; None: any from 0 to 2 kg.
    payload_change : float
        Change of the payload [kg], up or down, at an unannounced time.
    disturbance : float
        Largest torque [N m] of disturbance pulses, one of 1 s in every 5 s.
    start : {"random", "straight"}
        At rest at a random angle, or at 0.

    Raises
    ------
    UnbearableLoad
        If the muscles cannot hold the largest angle with the heaviest payload.
    """
    made = given.plant_of(AntagonisticJoint, default_plant)
    most = made.angle_range[1]
    family, samples = given.reference_of(FAMILIES, "rad", most, own=("sine", "step"))
    check_choice("action", action, L.MODES)
    check_choice("start", start, ("random", "straight"))
    if action == "pressures" and made.dynamics == "reduced":
        raise ValueError(
            "action = 'pressures' needs the muscles, and the reduced plant has none; take "
            "action = 'angle', or AntagonisticJoint.paper()"
        )
    usual = USUAL_SHARE * most
    reach = usual if amplitude is None else check_number("amplitude", amplitude, 0.0, most, "rad")
    task = given.task_of(JointTracking)
    payloads = masses_of("payload", payload, MOST_PAYLOAD, np.linspace(0.0, MOST_PAYLOAD, 6))
    change = check_number("payload_change", payload_change, 0.0, MOST_PAYLOAD, "kg")
    largest = np.abs(samples).max() if family == SAMPLES else reach
    ends, heaviest = np.array([[-largest], [largest]]), float(payloads.max()) + change
    check_borne(made, ends, heaviest, "the reference's ends", action == "pressures")
    config = {
        **vars(task),
        "soft_angle": task.soft_share * most,
        "largest_angle": made.largest_angle,
        "amplitude": reach,
        "frequency": check_number("frequency", frequency, 1e-3, 20.0, "Hz"),
        "start_angle": usual if start == "random" else 0.0,
        "prestress": made.prestress,
        "payload_change": change,
        "disturbance": check_number("disturbance", disturbance, 0.0, 100.0, "N m"),
        "worst_period": task.worst(made.largest_angle + most),
    }
    observation, actions = _signals(made, action)
    return compose(
        made,
        partial(L.kernels_for, made.hysteresis.kind, made.dynamics),
        given,
        RANDOMIZATION,
        observation=observation,
        references=[("reference", "rad", *ANGLES)],
        action=actions,
        config=config,
        choices={"mode": L.MODES.index(action), "payloads": payloads.size},
        reference=family,
        sines=sines_needed(family),
        own=payloads,
        samples=samples,
        view="pam_envs.envs.joint.view:VIEW",
    )


AntagonisticJointEnv, AntagonisticJointVectorEnv = environments("AntagonisticJoint", make_setup)
