"""Observation and action of the joints' controllers: one joint, or every joint of a manipulator.

A manipulator is controlled joint by joint (decentralised); the controllers are vectorised over rows
and joints. Signals are named ``angle``, ``set_point``, ``reference`` for one joint, and
``angle_k``, ``set_point_k``, ``joint_reference_k`` for a manipulator.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from baselines.core.controller import Array, Reader, encode_actions, preview_names, reader
from pam_envs.parameters import Signal, Signals


class JointView(NamedTuple):
    """One observation, arrays of shape (n_env, n_joints), angles in rad.

    Sensed angle, setpoint of the last period, samples of the reference, present and previewed, of
    shape (n_env, n_joints, n_samples), and declared payload [kg] of shape (n_env,), or 0.
    """

    angle: Array
    set_point: Array
    samples: Array
    payload: Array

    @property
    def reference(self) -> Array:
        """Present reference angle [rad], shape (n_env, n_joints)."""
        return self.samples[..., 0]


@dataclass(frozen=True)
class JointSignalMap:
    """Reader of observations as a :class:`JointView`, and writer of actions.

    The samples of the references are at ``times`` [s] after the present. ``prestress_action`` is
    the co-contraction, kept at its observed value, or in the middle of its range.
    """

    angle: Reader
    set_point: Reader
    samples: Reader
    times: tuple[float, ...]
    payload: Reader | None
    prestress: Reader | None
    actions: tuple[Signal, ...]
    prestress_action: Signal | None

    def read(self, observation: ArrayLike) -> JointView:
        """Return the view of an observation of shape (n_obs,) or (n_env, n_obs)."""
        angle = self.angle.rows(observation).T
        payload = np.zeros(len(angle))
        if self.payload is not None:
            payload = self.payload.rows(observation)[0]
        set_point = self.set_point.rows(observation).T
        samples = self.samples.rows(observation).T.reshape(*angle.shape, len(self.times))
        return JointView(angle, set_point, samples, payload)

    def write(self, set_points: Array, observation: ArrayLike) -> NDArray[np.float32]:
        """Return the action for setpoints [rad], shape (n_env, n_joints)."""
        signal = self.prestress_action
        if signal is None:
            return encode_actions(self.actions, set_points.T, observation)
        kept = np.full(len(set_points), 0.5 * (signal.low + signal.high))
        if self.prestress is not None:
            kept = self.prestress.rows(observation)[0]
        return encode_actions((*self.actions, signal), [*set_points.T, kept], observation)


def make_joint_signal_map(signals: Signals, action_signals: Signals) -> JointSignalMap:
    """Return the reader and writer of the signals of one joint or of a manipulator."""
    actions, names = set(action_signals.names()), set(signals.names())
    ends = [""] if "angle_set_point" in actions else _numbered(actions)
    if not ends:
        raise ValueError(
            f"the actions are {', '.join(sorted(actions))}; these controllers give set-points of"
            " angles: make the environment with action='angle'"
        )
    references = [f"{'reference' if ends == [''] else 'joint_reference'}{end}" for end in ends]
    if references[0] not in names:
        raise ValueError(
            f"there is no signal {references[0]!r}; these controllers track planned angles: make"
            " the environment with plan=True, or take 'joint_inverse_kinematics', which plans"
        )

    def known(name: str) -> Reader | None:
        return reader(signals, [name]) if name in names else None

    return JointSignalMap(
        reader(signals, [f"angle{end}" for end in ends]),
        reader(signals, [f"set_point{end}" for end in ends]),
        reader(signals, [name for first in references for name in preview_names(first, signals)]),
        tuple(signals[name].ahead for name in preview_names(references[0], signals)),
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
