"""Inverse kinematics of a manipulator: joint set-points for a reference pose.

fluidic_muscles, section 2: of all joint angles of a pose, those that minimise the weight (2.1),
which keeps joints off their limits, or the sum of their squares. A period starts from the angles
and multipliers of the last one, so that a few Newton iterations suffice; an episode starts from the
sensed angles. A pose out of reach, or without a direction, leaves the set-points unchanged, and is
counted. :func:`pam_envs.mechanics.redundancy.resolve` plans a whole path, and raises there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Array, Prediction, RowController, reader
from baselines.core.entry import Entry
from baselines.core.environments import ARM
from pam_envs.mechanics.redundancy.resolution import LIMIT, Resolution, UnreachablePose, resolve
from pam_envs.mechanics.serial_chain.chain import SerialChain
from pam_envs.parameters import Signals
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator

POSE = ("x", "y", "z", "point_x", "point_y", "point_z")
INSIDE = 0.999
"""Largest start angle over the limit."""


class PlanState(NamedTuple):
    """Solution of the last period, one row an environment.

    Attributes
    ----------
    angles : ndarray, shape (rows, n)
        Set-points [rad].
    multipliers : ndarray, shape (rows, 5)
        Lagrange multipliers of (2.2).
    missed : ndarray, shape (rows,)
        Poses out of reach so far.
    """

    angles: Array
    multipliers: Array
    missed: Array


class InverseKinematics(RowController):
    """Set-points of all joints for the reference pose, without feedback of the tool.

    Parameters
    ----------
    chain : SerialChain
        The nominal arm.
    signals, actions : Signals
        Of the environment: ``angle_k``, ``reference_x`` ... ``reference_point_z`` (and their
        previews), and ``angle_set_point_k``.
    limit : float
        Largest angle of a joint [rad].
    weighted : bool
        Whether the weight (2.1) or the sum of squares is minimised.
    preview : int
        Index of the preview sample of the pose; 0 is the present one.
    """

    def __init__(
        self,
        chain: SerialChain,
        signals: Signals,
        actions: Signals,
        limit: float = LIMIT,
        weighted: bool = True,
        preview: int = 0,
    ) -> None:
        self.chain, self.limit, self.weighted = chain, limit, weighted
        joints = range(chain.stages)
        tail = f"_{preview}" if preview else ""
        self._sensed = reader(signals, [f"angle_{k}" for k in joints])
        self._reference = reader(signals, [f"reference_{name}{tail}" for name in POSE])
        scales = [actions[f"angle_set_point_{k}"].scale for k in joints]
        self._gain, self._offset = np.array(scales).T

    def initial_state(self, observation: ArrayLike) -> PlanState:
        """Return the state at the sensed angles, within the limit."""
        sensed = self._sensed.rows(observation).T
        edge = INSIDE * self.limit
        rows = len(sensed)
        return PlanState(np.clip(sensed, -edge, edge), np.zeros((rows, 5)), np.zeros(rows))

    def respond(self, observation: ArrayLike, state: PlanState) -> Prediction:
        """See :class:`~baselines.core.controller.RowController`."""
        poses = self._reference.rows(observation).T
        after = self.plan(poses, state)
        action = (self._gain * after.angles + self._offset).astype(np.float32)
        return (action if np.ndim(observation) == 2 else action[0]), after

    def plan(self, poses: Array, state: PlanState) -> PlanState:
        """Return the state with set-points for poses, shape (rows, 6)."""
        angles, multipliers, missed = (np.array(part) for part in state)
        for i, pose in enumerate(poses):
            if not np.any(pose[3:]):
                missed[i] += 1
                continue
            try:
                found = self._resolve(pose, angles[i], multipliers[i])
            except UnreachablePose:
                missed[i] += 1
                continue
            angles[i], multipliers[i] = found.angles[0], found.multipliers[0]
        return PlanState(angles, multipliers, missed)

    def _resolve(self, pose: Array, start: Array, multipliers: Any) -> Resolution:
        return resolve(self.chain, pose[None], self.limit, self.weighted, start, multipliers)


def make_inverse_kinematics(
    plant: RedundantManipulator, signals: Signals, action_signals: Signals
) -> InverseKinematics:
    """Return the controller for the chain and the range of angles of a nominal arm."""
    return InverseKinematics(plant.chain, signals, action_signals, plant.angle_range[1])


ENTRIES = {
    "joint_inverse_kinematics": Entry(
        "set-points for the desired pose of the tool, resolved in each period; no inverse",
        "nominal model",
        make_inverse_kinematics,
        citation="fluidic_muscles",
        envs=ARM,
        plants=(RedundantManipulator,),
    ),
}


@dataclass(frozen=True)
class Comparison:
    """Plans of a path with the weight (2.1) and with the smallest angles.

    Attributes
    ----------
    unweighted, weighted : Resolution
    """

    unweighted: Resolution
    weighted: Resolution

    @property
    def price(self) -> float:
        """Return ``q'q`` of the weighted over that of the unweighted plan, at the path's end."""
        ends = (self.weighted.angles[-1], self.unweighted.angles[-1])
        weighted, unweighted = (float(np.sum(end**2)) for end in ends)
        return weighted / unweighted


def compare(
    chain: SerialChain, poses: ArrayLike, limit: float = LIMIT, start: ArrayLike | None = None
) -> Comparison:
    """Return both plans of a path of poses, shape (m, 6): Fig. 7 of fluidic_muscles.

    Raises
    ------
    UnreachablePose
        If the arm cannot take a pose.
    """
    return Comparison(
        resolve(chain, poses, limit, False, start), resolve(chain, poses, limit, True, start)
    )
