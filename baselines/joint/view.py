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

from baselines.core.controller import Array, Reader, reader
from pam_envs.parameters import Signal, Signals


class JointView(NamedTuple):
    """One observation, arrays of shape (n_env, n_joints).

    Attributes
    ----------
    angle : ndarray
        As sensed [rad].
    set_point : ndarray
        Of the last period [rad].
    samples : ndarray, shape (n_env, n_joints, n_samples)
        Angle that is wanted [rad]: now, and as previewed.
    payload : ndarray, shape (n_env,)
        As told [kg]; 0 where nothing is said of it.
    """

    angle: Array
    set_point: Array
    samples: Array
    payload: Array

    @property
    def reference(self) -> Array:
        """Angle that is wanted now [rad], shape (n_env, n_joints)."""
        return self.samples[..., 0]


@dataclass(frozen=True)
class JointSignalMap:
    """Makes a :class:`JointView` of observations, and actions of set-points.

    Attributes
    ----------
    angle, set_point : Reader
    samples : Reader
        Of the wanted angles, joint by joint: now, and as previewed.
    times : tuple of float
        Of these samples, from now on [s].
    payload, prestress : Reader or None
    actions : tuple of Signal
        Set-points of the joints, in their order.
    prestress_action : Signal or None
        Co-contraction, held where it is.
    """

    angle: Reader
    set_point: Reader
    samples: Reader
    times: tuple[float, ...]
    payload: Reader | None
    prestress: Reader | None
    actions: tuple[Signal, ...]
    prestress_action: Signal | None

    @property
    def low(self) -> float:
        """Lowest set-point [rad]."""
        return self.actions[0].low

    @property
    def high(self) -> float:
        """Highest set-point [rad]."""
        return self.actions[0].high

    def read(self, observation: ArrayLike) -> JointView:
        """Return what an observation of shape (n_obs,) or (n_env, n_obs) shows."""
        angle = self.angle.rows(observation).T
        payload = np.zeros(len(angle))
        if self.payload is not None:
            payload = self.payload.rows(observation)[0]
        set_point = self.set_point.rows(observation).T
        samples = self.samples.rows(observation).T.reshape(*angle.shape, len(self.times))
        return JointView(angle, set_point, samples, payload)

    def write(self, set_points: Array, observation: ArrayLike) -> NDArray[np.float32]:
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


def make_joint_signal_map(signals: Signals, action_signals: Signals) -> JointSignalMap:
    """Return what reads and writes the signals of one joint or of a manipulator.

    Raises
    ------
    ValueError
        If the actions are not set-points of angles, or the wanted angles are not observed.
    """
    actions, names = set(action_signals.names()), set(signals.names())
    ends = [""] if "angle_set_point" in actions else _numbered(actions)
    if not ends:
        raise ValueError(
            f"the actions are {', '.join(sorted(actions))}; these controllers give set-points of"
            " angles: make the environment with action='angle'"
        )
    wanted = [f"{'reference' if ends == [''] else 'joint_reference'}{end}" for end in ends]
    if wanted[0] not in names:
        raise ValueError(
            f"there is no signal {wanted[0]!r}; these controllers follow planned angles: make the"
            " environment with plan=True, or take 'joint_inverse_kinematics', which plans itself"
        )
    previews = _previews(wanted[0], names)

    def known(name: str) -> Reader | None:
        return reader(signals, [name]) if name in names else None

    return JointSignalMap(
        reader(signals, [f"angle{end}" for end in ends]),
        reader(signals, [f"set_point{end}" for end in ends]),
        reader(signals, [f"{name}{late}" for name in wanted for late in previews]),
        tuple(signals[f"{wanted[0]}{late}"].ahead for late in previews),
        known("payload"),
        known("prestress"),
        tuple(action_signals[f"angle_set_point{end}"] for end in ends),
        action_signals["prestress"] if "prestress" in actions else None,
    )


def _numbered(names: set[str]) -> list[str]:
    ends: list[str] = []
    while f"angle_set_point_{len(ends)}" in names:
        ends.append(f"_{len(ends)}")
    return ends


def _previews(name: str, names: set[str]) -> list[str]:
    """Return the ends of the names of a signal and its previews, the present one first."""
    found = [""]
    while f"{name}_{len(found)}" in names:
        found.append(f"_{len(found)}")
    return found
