"""What the controllers of joints read and write: one joint, or every joint of a manipulator.

A manipulator is controlled joint by joint (decentralised): each joint of each environment is a
*lane*, and the controllers work on all lanes alike. The names of the signals tell which it is:
``angle``, ``set_point``, ``reference``, or ``angle_k``, ``set_point_k``, ``joint_reference_k``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from baselines.controller import Array, Reader, reader
from pam_envs.parameters import Signal, Signals


class JointView(NamedTuple):
    """One observation, arrays of shape (n_env, n_joints).

    Attributes
    ----------
    angle : ndarray
        As sensed [rad].
    set_point : ndarray
        Of the last period [rad].
    reference : ndarray
        Angle that is wanted [rad].
    payload : ndarray, shape (n_env,)
        As told [kg]; 0 where nothing is said of it.
    """

    angle: Array
    set_point: Array
    reference: Array
    payload: Array


@dataclass(frozen=True)
class JointEyes:
    """Makes a :class:`JointView` of observations, and actions of set-points.

    Attributes
    ----------
    angle, set_point, reference : Reader
    payload, prestress : Reader or None
    actions : tuple of Signal
        Set-points of the joints, in their order.
    prestress_action : Signal or None
        Co-contraction, held where it is.
    """

    angle: Reader
    set_point: Reader
    reference: Reader
    payload: Reader | None
    prestress: Reader | None
    actions: tuple[Signal, ...]
    prestress_action: Signal | None

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.actions)

    @property
    def low(self) -> float:
        """Lowest set-point [rad]."""
        return self.actions[0].low

    @property
    def high(self) -> float:
        """Highest set-point [rad]."""
        return self.actions[0].high

    def look(self, observation: ArrayLike) -> JointView:
        """Return what an observation of shape (n_obs,) or (n_env, n_obs) shows."""
        angle = self.angle.rows(observation).T
        payload = np.zeros(len(angle))
        if self.payload is not None:
            payload = self.payload.rows(observation)[0]
        set_point = self.set_point.rows(observation).T
        return JointView(angle, set_point, self.reference.rows(observation).T, payload)

    def act(self, set_points: Array, observation: ArrayLike) -> NDArray[np.float32]:
        """Return the action for set-points [rad], shape (n_env, n_joints)."""
        held = np.minimum(np.maximum(set_points, self.low), self.high)
        width = len(self.actions) + (self.prestress_action is not None)
        action = np.zeros((len(held), width))
        for k, signal in enumerate(self.actions):
            gain, offset = signal.scale
            action[:, signal.index] = gain * held[:, k] + offset
        if self.prestress_action is not None:
            action[:, self.prestress_action.index] = self._prestress(observation)
        made = action.astype(np.float32)
        return made if np.ndim(observation) == 2 else made[0]

    def _prestress(self, observation: ArrayLike) -> Array:
        signal = self.prestress_action
        assert signal is not None
        gain, offset = signal.scale
        value = np.array([0.5 * (signal.low + signal.high)])
        if self.prestress is not None:
            value = self.prestress.rows(observation)[0]
        return np.asarray(gain * np.minimum(np.maximum(value, signal.low), signal.high) + offset)


def make_joint_eyes(signals: Signals, action_signals: Signals) -> JointEyes:
    """Return what reads and writes the signals of one joint or of a manipulator.

    Raises
    ------
    ValueError
        If the actions are not set-points of angles.
    """
    actions = set(action_signals.names())
    ends = [""] if "angle_set_point" in actions else _numbered(actions)
    if not ends:
        raise ValueError(
            f"the actions are {', '.join(sorted(actions))}; these controllers give set-points of"
            " angles: make the environment with action='angle'"
        )
    wanted = "reference" if ends == [""] else "joint_reference"
    names = set(signals.names())

    def eye(name: str) -> Reader | None:
        return reader(signals, [name]) if name in names else None

    return JointEyes(
        reader(signals, [f"angle{end}" for end in ends]),
        reader(signals, [f"set_point{end}" for end in ends]),
        reader(signals, [f"{wanted}{end}" for end in ends]),
        eye("payload"),
        eye("prestress"),
        tuple(action_signals[f"angle_set_point{end}"] for end in ends),
        action_signals["prestress"] if "prestress" in actions else None,
    )


def _numbered(names: set[str]) -> list[str]:
    ends, k = [], 0
    while f"angle_set_point_{k}" in names:
        ends.append(f"_{k}")
        k += 1
    return ends
