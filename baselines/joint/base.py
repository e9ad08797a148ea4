"""Common parts of the controllers of joints: model, signals, gravity feedforward and preview.

With preview, a controller reads the reference ahead by its own delay for slow references plus half
a control period of the hold, by linear interpolation of the previewed samples. If the preview
horizon is too short, as for the slow joints of an arm, the line from the present to the last sample
is extrapolated.

The loop of the pole-cancelling PI and the nominal model (:mod:`baselines.joint.model`) is, at a
damping of ``1 / sqrt(2)``,

    T(s) = 1 / (1 + 2 (s / p) + 2 (s / p)^2)

which equals ``exp(-2 s / p)`` up to the third order: for a smooth reference a pure delay of
``2 / p``. (The double pole without feedback has the same delay, up to the second order.)

The gravity feedforward changes the setpoints such that they compensate the weight of links and
payload of the nominal plant: the torque of the weight at the reference angles, and the setpoint at
which the muscles exert that torque there. In a manipulator the torque depends on the angles of all
joints. Reference angles are used instead of sensed ones, which would introduce feedback.

A manipulator is controlled joint by joint (decentralised); the controllers are vectorised over rows
and joints. Signals are named ``angle``, ``set_point``, ``reference`` for one joint, and
``angle_k``, ``set_point_k``, ``joint_reference_k`` for a manipulator.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import map_coordinates

from baselines.core.controller import (
    Reader,
    RowController,
    encode_actions,
    preview_names,
    preview_weights,
    reader,
)
from baselines.core.entry import JOINT, Bounds, Entry, Spec
from baselines.joint.model import JointModel
from pam_envs.arrays import Array
from pam_envs.parameters import Signal, Signals
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator


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


JOINT_ENTRY = partial(
    Entry,
    knowledge="nominal model",
    citation="fluidic_muscles",
    envs=JOINT,
    plants=(AntagonisticJoint, RedundantManipulator),
)
MAX_EXTRAPOLATION = 2.0
"""Largest extrapolation over the preview horizon."""
PREVIEW_KNOBS: Bounds = {"lead": (0.25, 4.0)}
"""Factor on the compensated delays."""
ANGLES, TORQUES = 61, 81
"""Size of the table of shifts."""
LARGEST_TORQUE = 8.0
"""End of the table [N m]; torques are clipped to it."""


@dataclass(frozen=True)
class Gravity:
    """Gravity feedforward of a nominal plant; none without a plant."""

    plant: Any = None

    def shift(self, angles: Array, payload: Array) -> Array:
        """Return the shift [rad] at angles (n_env, n_joints) with payloads [kg], (n_env,)."""
        if self.plant is None:
            return np.zeros_like(angles)
        low, high = self.plant.angle_range
        along = (np.clip(angles, low, high) - low) / (high - low) * (ANGLES - 1)
        torque = np.clip(self.torque(angles, payload), -LARGEST_TORQUE, LARGEST_TORQUE)
        across = (torque / LARGEST_TORQUE + 1.0) * 0.5 * (TORQUES - 1)
        return np.asarray(map_coordinates(self._table, (along, across), order=1, mode="nearest"))

    def torque(self, angles: Array, payload: Array) -> Array:
        """Return the torques [N m] that hold links and payload, shape (n_env, n_joints)."""
        if self.plant.stages == 1:
            return np.asarray(self.plant.weight_torque(angles, payload[:, None]), float)
        return np.asarray(self.plant.chain.gravity_torque(angles, payload), float)

    @cached_property
    def _table(self) -> Array:
        """Shifts by angle and torque."""
        return _table_of(self.plant)


@lru_cache(maxsize=32)
def _table_of(plant: Any) -> Array:
    """Return the shifts [rad] by angle and torque, shape (ANGLES, TORQUES); not to be changed."""
    low, high = plant.angle_range
    angle = np.linspace(low, high, ANGLES)[:, None]
    torque = np.linspace(-LARGEST_TORQUE, LARGEST_TORQUE, TORQUES)[None, :]
    return np.asarray(plant.shift_for(angle, plant.prestress, torque, high))


class Parts(NamedTuple):
    """Parts of a controller.

    ``preview``, shape (n_joints or 1, n_samples), holds the weights of the samples of the
    reference, the present one first.
    """

    model: JointModel
    signals: JointSignalMap
    gravity: Gravity
    preview: Array


@dataclass(frozen=True)
class JointController(RowController):
    """Base of the controllers of joints."""

    parts: Parts

    def start(self, observation: ArrayLike) -> tuple[JointView, Array]:
        """Return an episode's first view, and its setpoints [rad] without gravity feedforward."""
        view = self.parts.signals.read(observation)
        return view, view.set_point - self.parts.gravity.shift(view.angle, view.payload)

    def read(self, observation: ArrayLike) -> tuple[JointView, Array, Array]:
        """Return the view, the previewed references, and the gravity feedforward [rad]."""
        view = self.parts.signals.read(observation)
        reference = np.add.reduce(view.samples * self.parts.preview, axis=-1)
        return view, reference, self.parts.gravity.shift(view.reference, view.payload)


def make_parts(
    spec: Spec[Any], model: JointModel, gravity: bool, delays: Sequence[float] | None
) -> Parts:
    """Return the parts of a controller.

    ``gravity``: whether the setpoints compensate the weight of the links and of the declared
    payload. The preview compensates ``delays`` [s], which exclude the hold; None for no preview.
    """
    signals = make_joint_signal_map(spec.signals, spec.actions)
    leads = (
        [0.0] if delays is None else [spec.knob("lead") * d + 0.5 * model.period for d in delays]
    )
    preview = [preview_weights(signals.times, lead, MAX_EXTRAPOLATION) for lead in leads]
    return Parts(model, signals, Gravity(spec.plant if gravity else None), np.array(preview))
