"""Hysteresis of every joint of every environment: states with row and joint first."""

from __future__ import annotations

from dataclasses import dataclass

from baselines.core.controller import Array
from baselines.joint.model import JointModel
from baselines.positioning.nominal import HysteresisState


@dataclass(frozen=True)
class JointHysteresis:
    """The hysteresis of a model, for arrays of shape (n_env, n_joints).

    Attributes
    ----------
    model : JointModel
    """

    model: JointModel

    def start(self, set_point: Array) -> tuple[Array, HysteresisState]:
        """Return the angles at rest under first set-points [rad], and the state after them."""
        found, state = self.model.virgin(set_point.ravel())
        return found.reshape(set_point.shape), _packed(state, set_point.shape)

    def forward(self, set_point: Array, state: HysteresisState) -> tuple[Array, HysteresisState]:
        """Return the angles at rest [rad] under set-points, and the state after them."""
        found, after = self.model.rows.forward(set_point.ravel(), _flat(state))
        return found.reshape(set_point.shape), _packed(after, set_point.shape)

    def inverse(self, angle: Array, state: HysteresisState) -> Array:
        """Return the set-points [rad] of angles at rest; the state is unchanged."""
        return self.model.rows.inverse(angle.ravel(), _flat(state)).reshape(angle.shape)


def _flat(state: HysteresisState) -> HysteresisState:
    return tuple(part.reshape(-1, *part.shape[2:]) for part in state)


def _packed(state: HysteresisState, shape: tuple[int, ...]) -> HysteresisState:
    return tuple(part.reshape(*shape, *part.shape[1:]) for part in state)
