"""``PAM/RedundantManipulator-v0``: a hanging arm of six antagonistic joints, fluidic_muscles.

Twelve pneumatic muscles bend an arm of six links about axes x, y, x, y, x, y. Its tool has to
follow a path in position and direction: five degrees of freedom for six joints, so that the arm is
redundant. The joint angles along the path are planned in advance, with the weight of Eq. (2.1) of
the paper, which keeps joints away from their limits; the planned angles can be observed. The action
is a setpoint of each angle, which the static laws of the muscles convert to pressures; or all
pressures. Weight, links and payload couple the joints.

Observation (float32; scaled to [-1, 1] over the range, or SI with ``normalize=False``), for n
joints counted from the base, k = 0 .. n - 1:

| how many | signal | unit | range |
|----------|--------|------|-------|
| n | angle_k, sensed | rad | -0.8 .. 0.8 |
| n | rate_k, of the sensed angle, smoothed over 30 ms | rad/s | -6 .. 6 |
| 2 n | pressure_ka, pressure_kb, sensed | Pa | 0 .. 6.5e5 |
| 1 | payload, at the start | kg | 0 .. 0.1 |
| 6 | x, y, z, point_x, point_y, point_z: tip and direction of the sensed angles | m, 1 | |
| n | set_point_k, of the last period (*) | rad | its range |
| 6 | reference_x .. reference_point_z, and previews ``preview_stride`` periods apart | m, 1 | |
| n | joint_reference_k, planned, and previews (not with ``plan=False``) | rad | -0.8 .. 0.8 |

(*) With ``action="pressures"``: set_point_ka and set_point_kb [Pa].

Action: angle_set_point_k, over the joints' range; or pressure_ka_set_point and
pressure_kb_set_point, 0 .. 6.5e5 Pa.

Reward: ``-|tip - path| / 2 cm - 0.5 |direction - path's| / 2 degrees - 0.2 (change of all
pressures' setpoints) / (2 n 6.5 bar)`` each control period. Where a limit ends the episode,
``reward/ended`` adds the lowest possible reward of each remaining period, so that a policy never
gains by ending an episode.

Start: at the beginning of the path. End: truncated after ``episode_seconds``; terminated when a
joint is beyond its hard limit.

Arguments: :func:`make_setup`, and those of every environment
(:class:`~pam_envs.envs.core.arguments.Common`). Versions: v0, the first.
"""

from collections.abc import Mapping
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.envs.core.arguments import Common, Randomization, environment_arguments, environments
from pam_envs.envs.core.setup import Part, Setup, check_choice, check_number, compose, masses_of
from pam_envs.envs.manipulator.kernels import kernels_for
from pam_envs.envs.manipulator.layout import MODES, POSE, joint_names, muscle_names
from pam_envs.envs.manipulator.paths import paths_for
from pam_envs.plants.antagonistic_joint.statics import bearable_payload, check_borne
from pam_envs.plants.redundant_manipulator import rows as R
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.tasks.joint_tracking import PathTracking

ANGLES = (-0.8, 0.8)
"""Range [rad] of angles in the observation."""
RATES = (-6.0, 6.0)
"""Range [rad/s] of their rates."""
MOST_PAYLOAD = 0.1
"""Largest payload [kg]. The largest one on some paths is less, which is checked."""
RANDOMIZATION = Randomization(
    R.NAMES,
    ("regulator.max_pressure", "link.limit", "link.stop", "nominal.prestress"),
    "{'regulator.time_constant': (0.03, 0.06)}",
    lowest=("lever.r_u", "lever.r_o"),
    highest=("lever.l_u", "lever.l_o"),
)


default_plant = lru_cache(maxsize=8)(RedundantManipulator.paper)


def _pose(plant: RedundantManipulator, key: str) -> list[Part]:
    """Return the signals of a pose."""
    reach = float(plant.chain.reach)
    spans = [("m", -reach, reach)] * 3 + [("1", -1.0, 1.0)] * 3
    return [(f"{key}{name}", *span) for name, span in zip(POSE, spans, strict=True)]


def _actions(plant: RedundantManipulator, action: str) -> list[Part]:
    if action == "pressures":
        full = plant.regulator.max_pressure
        names = muscle_names("pressure", plant.stages)
        return [(f"{name}_set_point", "Pa", 0.0, full) for name in names]
    names = joint_names("angle_set_point", plant.stages)
    return [(name, "rad", *plant.angle_range) for name in names]


def _observation(plant: RedundantManipulator, action: str) -> list[Part]:
    """Return the signals of the observation without references."""
    n, pressures = plant.stages, ("Pa", 0.0, plant.regulator.max_pressure)
    angles = ("rad", *ANGLES)
    parts: list[Part] = [(name, *angles) for name in joint_names("angle", n)]
    parts += [(name, "rad/s", *RATES) for name in joint_names("rate", n)]
    parts += [(name, *pressures) for name in muscle_names("pressure", n)]
    parts += [("payload", "kg", 0.0, MOST_PAYLOAD), *_pose(plant, "")]
    if action == "angle":
        parts += [(name, "rad", *plant.angle_range) for name in joint_names("set_point", n)]
    else:
        parts += [(name, *pressures) for name in muscle_names("set_point", n)]
    return parts


def _payloads(
    plant: RedundantManipulator, payload: Any, change: float, paths: Mapping[str, Any],
    by_pressure: bool,
) -> NDArray[np.float64]:  # fmt: skip
    """Return the payloads [kg] to draw from, shape (1, n), all of which the paths allow."""
    plans = {name: path[len(POSE) :].T for name, path in paths.items()}
    most = MOST_PAYLOAD
    if payload is None:
        borne = [bearable_payload(plant, plan, by_pressure) for plan in plans.values()]
        most = max(0.0, min(most, *borne) - change)
    payloads = masses_of("payload", payload, MOST_PAYLOAD, np.linspace(0.0, most, 6))
    for name, plan in plans.items():
        check_borne(plant, plan, float(payloads.max()) + change, name, by_pressure)
    return payloads


@environment_arguments(reference="paths", preview=3, preview_stride=5, episode_seconds=11.0)
def make_setup(
    given: Common,
    action: str = "angle",
    plan: bool = True,
    weighted: bool = True,
    path_seconds: float = 4.0,
    rest_seconds: float = 1.0,
    payload: Any = 0.0,
    payload_change: float = 0.0,
) -> Setup:
    """Return the checked configuration of an environment with a redundant manipulator.

    Parameters
    ----------
    given : Common
        Plant: a ``RedundantManipulator`` with any chain, by default
        ``RedundantManipulator.paper()``. Reference: "path_1", "path_2", "path_3" (a path of 41
        poses), "paths" (each episode draws one of them), "drawn" (one of 16 paths between random
        ends); or the poses of a path, shape (k, 6): x, y, z [m] and a unit vector in each row.
        Reward: :class:`~pam_envs.tasks.joint_tracking.PathTracking`.
    action : {"angle", "pressures"}
        A setpoint of each angle, under a fixed prestress; or of each pressure.
    plan : bool
        Whether the planned joint angles are observed.
    weighted : bool
        Plan with the weight of Eq. (2.1), which keeps joints away from their limits, or for the
        smallest angles alone.
    path_seconds, rest_seconds : float
        Duration [s] of the motion along the path, and of the rest at either end.
    payload : float, sequence of float or None
        Mass [kg] at the tip; of several, each episode draws one; None: any that the paths allow, up
        to 0.1 kg. The muscles have to hold the heaviest one, with its change, at rest in every pose
        of the plan, and with ``action="angle"`` with setpoints within their range.
    payload_change : float
        Change of the payload [kg], up or down, at an unannounced time.

    Raises
    ------
    UnreachablePose
        If the arm cannot take a pose of the path.
    UnbearableLoad
        If its muscles cannot hold it there with the heaviest payload.
    """
    made = given.plant_of(RedundantManipulator, default_plant)
    check_choice("action", action, MODES)
    check_choice("plan", plan, (True, False))
    check_choice("weighted", weighted, (True, False))
    task = given.task_of(PathTracking)
    change = check_number("payload_change", payload_change, 0.0, MOST_PAYLOAD, "kg")
    paths = paths_for(made, given.reference, True)
    payloads = _payloads(made, payload, change, paths, action == "pressures")
    if not weighted:
        paths = paths_for(made, given.reference, weighted)
    names = joint_names("joint_reference", made.stages) if plan else []
    references = [*_pose(made, "reference_"), *((name, "rad", *ANGLES) for name in names)]
    config = {
        **vars(task),
        "soft_angle": task.soft_share * made.angle_range[1],
        "largest_angle": made.largest_angle,
        "prestress": made.prestress,
        "payload_change": change,
        "path_seconds": check_number("path_seconds", path_seconds, 0.1, 600.0, "s"),
        "rest_seconds": check_number("rest_seconds", rest_seconds, 0.0, 600.0, "s"),
        "worst_period": task.worst(float(made.chain.reach)),
    }
    return compose(
        made,
        partial(kernels_for, made.hysteresis.kind, made.stages),
        given,
        RANDOMIZATION,
        observation=_observation(made, action),
        references=references,
        action=_actions(made, action),
        config=config,
        choices={"mode": MODES.index(action), "payloads": payloads.size, "paths": len(paths)},
        own=payloads,
        samples=np.concatenate(list(paths.values())),
        view="pam_envs.envs.manipulator.view:view",
    )


RedundantManipulatorEnv, RedundantManipulatorVectorEnv = environments(
    "RedundantManipulator", make_setup
)
