"""Nominal model of joints: identified hysteresis and motion.

The hysteresis is identified on the nominal plant as in fluidic_muscles (section 3.2) on the rig, by
first-order descending curves (:mod:`pam_envs.identification.joint_forc`), and made symmetric. The
motion after it is the paper's nominal model (section 4), two real poles at 23 rad/s. For a
manipulator the hysteresis is that of a single stage.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from baselines.core.controller import Array
from baselines.linear.systems import DiscreteSystem, discrete, double_lag
from pam_envs.hysteresis.preisach import Preisach
from pam_envs.hysteresis.protocol import Rows, RowsState, operator_of
from pam_envs.identification.joint_forc import measure_joint

POLE = 23.0
"""Both poles of the nominal model [rad/s] (fluidic_muscles, section 4)."""
LEVELS = 21
"""Levels of the identified map."""

_HYSTERESIS_MODELS: dict[str, Preisach] = {}


@dataclass(frozen=True)
class JointModel:
    """Nominal model of joints.

    Hysteresis, or a line with a slope, maps setpoints between ``low`` and ``high`` [rad] to angles
    at rest [rad]; the double pole of each joint [rad/s] follows. Control period in s.
    """

    hysteresis: Preisach | None
    low: float
    high: float
    period: float
    poles: tuple[float, ...] = (POLE,)
    slope: float = 1.0

    @cached_property
    def motion(self) -> DiscreteSystem:
        """The motion of each joint at the control period, exact for an input that is held."""
        motions = [discrete(double_lag(pole), self.period, "zoh") for pole in self.poles]
        return DiscreteSystem.stacked(motions)

    @cached_property
    def gain(self) -> float:
        """Angle over setpoint between the tips of the major loop: the nominal gain ``K``."""
        if self.hysteresis is None:
            return self.slope
        return float(self.hysteresis.everett[-1, 0]) / (self.hysteresis.high - self.hysteresis.low)

    @cached_property
    def rows(self) -> Rows:
        """The hysteresis vectorised over rows; the identity for a line."""
        return operator_of(self.hysteresis).rows()

    @cached_property
    def reach(self) -> tuple[float, float]:
        """Angles at rest [rad] at the ends of the setpoint's range, reached from the other end."""
        ends = np.array([self.low, self.high])
        state = self.rows.initial(2)
        for u in (ends[::-1], ends):
            found, state = self._forward(u, state)
        return float(found[0]), float(found[1])

    def start(self, set_point: Array) -> tuple[Array, RowsState]:
        """Return angles at rest under first setpoints (n_env, n_joints) [rad], and the state."""
        return self._forward(set_point, self.rows.initial(set_point.size))

    def forward(self, set_point: Array, state: RowsState) -> tuple[Array, RowsState]:
        """Return the angles at rest [rad] under setpoints, and the state after them."""
        return self._forward(set_point, _flat(state))

    def inverse(self, angle: Array, state: RowsState) -> Array:
        """Return the setpoints [rad] of angles at rest; the state is unchanged."""
        return self.rows.inverse(angle.ravel() / self.slope, _flat(state)).reshape(angle.shape)

    def _forward(self, set_point: Array, state: RowsState) -> tuple[Array, RowsState]:
        found, after = self.rows.forward(set_point.ravel(), state)
        shape = set_point.shape
        packed = tuple(part.reshape(*shape, *part.shape[1:]) for part in after)
        return self.slope * found.reshape(shape), packed

    def narrowed(self, width: float) -> JointModel:
        """Return the model with the hysteresis' width scaled, its tips unchanged; 0: a line."""
        if self.hysteresis is None or width == 0.0:
            return replace(self, hysteresis=None, slope=self.gain)
        return replace(self, hysteresis=self.hysteresis.scaled(width, self.gain))


def _flat(state: RowsState) -> RowsState:
    return tuple(part.reshape(np.prod(part.shape[:2]), *part.shape[2:]) for part in state)


def joint_model(plant: Any, poles: tuple[float, ...] = (POLE,)) -> JointModel:
    """Return the nominal model of a plant with ``rest_angles``, cached by plant.

    Warns
    -----
    UserWarning
        If the hysteresis is not a symmetric Preisach operator; the model is then the measured map.
    """
    key = plant.digest()
    low, high = plant.angle_range
    if key not in _HYSTERESIS_MODELS:
        found = measure_joint(plant.rest_angles, high, LEVELS)
        if not (found.symmetric and found.preisach):
            warnings.warn(f"the hysteresis of the nominal plant {found.verdict}", stacklevel=2)
        _HYSTERESIS_MODELS[key] = found.model
    return JointModel(_HYSTERESIS_MODELS[key], low, high, plant.control_period, poles)
