"""``PAM/RedundantManipulator-v0``: a hanging arm of six antagonistic joints, fluidic_muscles.

Twelve pneumatic muscles bend an arm of six links about axes x, y, x, y, x, y by turns. Its tool has
to follow a path in position and direction: five numbers for six joints, so that how the arm gets
there is open. The path's joint angles are planned ahead, with the weight of the paper's Eq. (2.1)
that keeps joints away from their limits, and can be observed. The action is a set-point of each
angle, which the static laws of its muscles turn into pressures; or all pressures. Weight, links and
payload couple the joints.

Observation (float32; scaled to [-1, 1] over the range, or SI with ``normalize=False``), of n joints
that count from the base, k = 0 .. n - 1:

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
pressures' set-points) / (2 n 6.5 bar)`` each control period; where a limit ends the episode, the
worst that a period can cost for each one that is left as well, so that it never pays.

Start: at the beginning of the path. End: truncated after ``episode_seconds``; terminated when a
joint is beyond its hard limit.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.envs.core.arguments import (
    common,
    named_arguments,
    payloads_of,
    plant_of,
    spread_of,
    task_of,
)
from pam_envs.envs.core.plant_env import PlantEnv
from pam_envs.envs.core.setup import Setup, check_choice, check_number, compose
from pam_envs.envs.core.vector_env import PlantVectorEnv
from pam_envs.envs.manipulator.kernels import kernels_for
from pam_envs.envs.manipulator.layout import MODES, POSE, joint_names, muscle_names
from pam_envs.envs.manipulator.paths import paths_for
from pam_envs.parameters import Signal, Signals
from pam_envs.plants.antagonistic_joint.bearing import bearable_payload, check_borne
from pam_envs.plants.redundant_manipulator import rows as R
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.plants.single_muscle.hysteresis import Kind
from pam_envs.tasks.joint_tracking import PathTracking

ANGLES = (-0.8, 0.8)
"""Range [rad] of angles in the observation."""
RATES = (-6.0, 6.0)
"""Range [rad/s] of their rates."""
MOST_PAYLOAD = 0.1
"""Largest payload [kg]. Some paths bear less, which is checked."""
NOT_DRAWN = ("regulator.max_pressure", "link.limit", "link.stop", "nominal.prestress")
"""Parameters that ``randomize`` may not draw: they scale the action or enter derived numbers."""
CORNER = {
    "lever.r_u": min,
    "lever.r_o": min,
    "lever.l_u": max,
    "lever.l_o": max,
}
"""Which end of a range brings the lever's toggle nearer."""

Part = tuple[str, str, float, float]


@lru_cache(maxsize=8)
def _stock(hysteresis: Kind) -> RedundantManipulator:
    return RedundantManipulator.paper(hysteresis)


def _pose(plant: RedundantManipulator, key: str) -> list[Part]:
    """Return name, unit and range of a pose's numbers."""
    reach = float(plant.chain.reach)
    spans = [("m", -reach, reach)] * 3 + [("1", -1.0, 1.0)] * 3
    return [(f"{key}{name}", *span) for name, span in zip(POSE, spans, strict=True)]


def _actions(plant: RedundantManipulator, action: str, normalize: bool) -> Signals:
    names, span = joint_names("angle_set_point", plant.stages), ("rad", *plant.angle_range)
    if action == "pressures":
        names = [f"{name}_set_point" for name in muscle_names("pressure", plant.stages)]
        span = ("Pa", 0.0, plant.regulator.max_pressure)
    return Signals(Signal(name, *span, i, normalize) for i, name in enumerate(names))


def _signals(
    plant: RedundantManipulator,
    action: str,
    plan: bool,
    preview: int,
    spacing: float,
    normalize: bool,
) -> Signals:
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
    wanted = _pose(plant, "reference_")
    if plan:
        wanted += [(name, *angles) for name in joint_names("joint_reference", n)]
    made, ahead = list(parts), [0.0] * len(parts)
    for name, unit, low, high in wanted:
        names = [name, *(f"{name}_{i + 1}" for i in range(preview))]
        made += [(each, unit, low, high) for each in names]
        ahead += [i * spacing for i in range(preview + 1)]
    return Signals(
        Signal(*part, i, normalize, late)
        for i, (part, late) in enumerate(zip(made, ahead, strict=True))
    )


def _payloads(
    plant: RedundantManipulator, payload: Any, change: float, paths: Mapping[str, Any],
    by_pressure: bool,
) -> NDArray[np.float64]:  # fmt: skip
    """Return the payloads [kg] to draw from, shape (1, n), if all paths' weights are borne."""
    plans = {name: path[len(POSE) :].T for name, path in paths.items()}
    most = MOST_PAYLOAD
    if payload is None:
        borne = [bearable_payload(plant, plan, by_pressure) for plan in plans.values()]
        most = max(0.0, min(most, *borne) - change)
    payloads = payloads_of(payload, most)
    for name, plan in plans.items():
        check_borne(plant, plan, float(payloads.max()) + change, name, by_pressure)
    return payloads


@named_arguments
def make_setup(
    hysteresis: Kind | None = None,
    plant: RedundantManipulator | str | Path | None = None,
    reference: Any = "paths",
    preview: int = 3,
    preview_stride: int = 5,
    episode_seconds: float = 11.0,
    randomize: Any = False,
    normalize: bool = True,
    render_mode: str | None = None,
    action: str = "angle",
    plan: bool = True,
    weighted: bool = True,
    path_seconds: float = 4.0,
    rest_seconds: float = 1.0,
    payload: Any = 0.0,
    payload_change: float = 0.0,
    reward: Mapping[str, float] | None = None,
) -> Setup:
    """Return the checked configuration of an environment with a redundant manipulator.

    Parameters
    ----------
    hysteresis : {"maxwell_slip", "preisach", "none"}, optional
        The muscles' hysteresis. Default: that of ``plant``, or Maxwell-slip.
    plant : RedundantManipulator or path, optional
        Another plant, with any chain. Default: ``RedundantManipulator.paper()``.
    reference : str or array_like, shape (k, 6)
        "path_1", "path_2", "path_3": a path of 41 poses; "paths": each episode draws one of them;
        "drawn": one of 16 paths between random ends. Or the poses of a path: x, y, z [m] and a
        unit vector in each row.
    preview, preview_stride : int
        Future samples of pose and planned angles, and control periods between them.
    episode_seconds : float
        Duration [s].
    randomize : bool or mapping
        True: every episode draws the assumed parameters within their declared ranges. A mapping
        {"regulator.time_constant": (low, high)}: just those.
    normalize : bool
        Observation and action in [-1, 1], or SI.
    render_mode : {None, "rgb_array", "human"}
        As Gymnasium means it.
    action : {"angle", "pressures"}
        A set-point of each angle, under a fixed prestress; or of each pressure.
    plan : bool
        Whether the planned joint angles are observed.
    weighted : bool
        Plan with the weight of Eq. (2.1), which keeps joints off their limits, or for the smallest
        angles alone.
    path_seconds, rest_seconds : float
        Duration [s] of the way along the path, and of the rest at either end.
    payload : float, sequence of float or None
        Mass [kg] at the tip; several: each episode draws one; None: any that the paths bear, up to
        0.1 kg. The muscles have to bear the heaviest at rest, with its change, in every pose of the
        plan; where set-points are angles, with set-points within their range.
    payload_change : float
        By how much [kg] the payload grows or shrinks, untold, in the middle of an episode.
    reward : mapping, optional
        Fields of :class:`pam_envs.tasks.joint_tracking.PathTracking` to change.

    Raises
    ------
    UnreachablePose
        If the arm cannot take a pose of the path.
    UnbearableLoad
        If its muscles cannot hold it there with the heaviest payload.
    ValueError
        Naming the argument, its value, the bounds and the remedy.
    """
    made = plant_of(RedundantManipulator, plant, hysteresis, _stock)
    given = common(preview, preview_stride, episode_seconds, normalize, render_mode)
    check_choice("action", action, MODES)
    check_choice("plan", plan, (True, False))
    check_choice("weighted", weighted, (True, False))
    task = task_of(PathTracking, reward)
    change = check_number("payload_change", payload_change, 0.0, MOST_PAYLOAD, "kg")
    paths = paths_for(made, reference, True)
    payloads = _payloads(made, payload, change, paths, action == "pressures")
    if not weighted:
        paths = paths_for(made, reference, weighted)
    config = (
        task.position_weight,
        task.position_scale,
        task.pointing_weight,
        task.pointing_scale,
        task.effort_weight,
        task.soft_share * made.angle_range[1],
        task.soft_pressure,
        made.largest_angle,
        made.prestress,
        change,
        check_number("path_seconds", path_seconds, 0.1, 600.0, "s"),
        check_number("rest_seconds", rest_seconds, 0.0, 600.0, "s"),
        task.worst(float(made.chain.reach)),
    )
    spacing = given.stride * made.control_period
    example = "{'regulator.time_constant': (0.03, 0.06)}"
    return compose(
        made,
        kernels_for(made.hysteresis.kind, made.stages),
        given,
        signals=_signals(made, action, plan, given.preview, spacing, normalize),
        actions=_actions(made, action, normalize),
        config=config,
        choices=(made.elements, MODES.index(action), payloads.size, len(paths)),
        own=payloads,
        samples=np.concatenate(list(paths.values())),
        tables=made.hysteresis_tables(),
        spread=spread_of(made, R.PARAMETERS, NOT_DRAWN, randomize, example, CORNER),
        drawn=randomize is not False,
        view=f"{made.family}_{made.stages}",
    )


class RedundantManipulatorEnv(PlantEnv):
    """The single environment (see the module's page)."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(make_setup(**arguments))


class RedundantManipulatorVectorEnv(PlantVectorEnv):
    """The batched environment (see the module's page)."""

    def __init__(
        self, num_envs: int = 1, info: bool = True, threads: int | None = None, **arguments: Any
    ) -> None:
        super().__init__(make_setup(**arguments), num_envs, info, threads)
