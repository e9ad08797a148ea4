"""Inverse kinematics of a manipulator: joint setpoints for a reference pose.

fluidic_muscles, section 2: of all joint angles of a pose, those that minimise the weight (2.1),
which keeps joints away from their limits, or the sum of their squares. A period starts from the
angles and multipliers of the last one, so that a few Newton iterations suffice; an episode starts
from the sensed angles. A pose out of reach, or without a direction, leaves the setpoints unchanged
and is counted. :func:`~pam_envs.mechanics.redundancy.resolution.resolve` plans a whole path, and
raises an error for such a pose.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, Reader, RowController, encode_actions, reader
from baselines.core.entry import ARM, Entry, Spec
from pam_envs.arrays import Array
from pam_envs.mechanics.redundancy.resolution import LIMIT, Resolution, UnreachablePose, resolve
from pam_envs.mechanics.serial_chain.chain import SerialChain
from pam_envs.parameters import Signal
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator

POSE = ("x", "y", "z", "point_x", "point_y", "point_z")
INSIDE = 0.999
"""Largest start angle over the limit."""


class PlanState(NamedTuple):
    """Solution of the last period, first axis n_env.

    Setpoints [rad], Lagrange multipliers of (2.2), shape (n_env, 5), and the number of poses out
    of reach so far.
    """

    angles: Array
    multipliers: Array
    missed: Array


@dataclass(frozen=True)
class InverseKinematics(RowController):
    """Setpoints of all joints for the reference pose, without feedback of the tool pose.

    ``sensed`` reads ``angle_k``, ``reference`` reads ``reference_x`` ... ``reference_point_z``; the
    limit is the largest angle of a joint [rad]; ``weighted``: whether the weight (2.1) or the sum
    of squares is minimised.
    """

    chain: SerialChain
    sensed: Reader
    reference: Reader
    actions: Sequence[Signal]
    limit: float = LIMIT
    weighted: bool = True

    def initial_state(self, observation: ArrayLike) -> PlanState:
        """Return the state at the sensed angles, within the limit."""
        sensed, edge = self.sensed.rows(observation).T, INSIDE * self.limit
        rows = len(sensed)
        return PlanState(np.clip(sensed, -edge, edge), np.zeros((rows, 5)), np.zeros(rows))

    def respond(self, observation: ArrayLike, state: PlanState) -> Prediction:
        """Return the action and the next state."""
        angles, multipliers, missed = (np.array(part) for part in state)
        for i, pose in enumerate(self.reference.rows(observation).T):
            found = self._resolve(pose, angles[i], multipliers[i])
            if found is None:
                missed[i] += 1
            else:
                angles[i], multipliers[i] = found.angles[0], found.multipliers[0]
        after = PlanState(angles, multipliers, missed)
        return encode_actions(self.actions, angles.T, observation), after

    def _resolve(self, pose: Array, start: Array, multipliers: Any) -> Resolution | None:
        """Return the setpoints of a pose, None out of reach or without a direction."""
        if not np.any(pose[3:]):
            return None
        try:
            return resolve(self.chain, pose[None], self.limit, self.weighted, start, multipliers)
        except UnreachablePose:
            return None


def make_inverse_kinematics(
    spec: Spec[RedundantManipulator], weighted: bool = True, preview: int = 0
) -> InverseKinematics:
    """Return the controller; ``preview`` is the index of the pose's sample, 0 the present one."""
    joints, tail = range(spec.plant.chain.stages), f"_{preview}" if preview else ""
    return InverseKinematics(
        spec.plant.chain,
        reader(spec.signals, [f"angle_{k}" for k in joints]),
        reader(spec.signals, [f"reference_{name}{tail}" for name in POSE]),
        tuple(spec.actions[f"angle_set_point_{k}"] for k in joints),
        spec.plant.angle_range[1],
        weighted,
    )


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


class Comparison(NamedTuple):
    """Plans of a path with the weight (2.1) and with the smallest angles."""

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
        If the arm cannot reach a pose.
    """
    return Comparison(
        resolve(chain, poses, limit, False, start), resolve(chain, poses, limit, True, start)
    )
