"""Nominal model of joints: identified hysteresis and motion.

The hysteresis is identified on the nominal plant as in fluidic_muscles (section 3.2) on the rig, by
first-order descending curves (:mod:`pam_envs.identification.joint_forc`), and made symmetric. The
motion after it is the paper's nominal model (section 4), two real poles at 23 rad/s. For a
manipulator the hysteresis is that of a single stage.

In an arm a joint also moves the distal links: its pole is the frequency at which its angle lags its
own setpoint by 90 degrees, as ``p^2 / (s + p)^2`` does at ``p`` (and an oscillating joint at its
natural frequency), at most that of a single stage. Its delay for slow setpoints is the mean time of
its impulse response, ``2 / p`` for a double pole and less for an oscillating joint. Both are found
by small steps of one joint at a time, with the arm straight and without hysteresis.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

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


STEP = 0.02
"""[rad]."""
SECONDS = 8.0
FREQUENCIES = np.geomspace(0.5, 60.0, 400)
"""[rad/s]."""


class JointDynamics(NamedTuple):
    """Equivalent pole [rad/s] and delay [s] of a joint."""

    pole: float
    delay: float


_DYNAMICS: dict[str, tuple[JointDynamics, ...]] = {}


def joint_poles(plant: Any) -> tuple[float, ...]:
    """Return the pole of each joint [rad/s]."""
    return tuple(pace.pole for pace in joint_dynamics(plant))


def joint_delays(plant: Any) -> tuple[float, ...]:
    """Return the delay of each joint [s] for slow setpoints, without the hold."""
    return tuple(pace.delay for pace in joint_dynamics(plant))


def joint_dynamics(plant: Any) -> tuple[JointDynamics, ...]:
    """Return the dynamics of each joint, cached by plant."""
    if plant.stages == 1:
        return (JointDynamics(POLE, 2.0 / POLE),)
    key = plant.digest()
    if key not in _DYNAMICS:
        smooth = plant.replace({"hysteresis.width": 0.0})
        _DYNAMICS[key] = tuple(_dynamics(smooth, k) for k in range(plant.stages))
    return _DYNAMICS[key]


def _dynamics(plant: Any, joint: int) -> JointDynamics:
    from pam_envs.plants.redundant_manipulator.rollout import simulate_manipulator

    period = plant.control_period
    commands = np.zeros((round(SECONDS / period), plant.stages))
    commands[1:, joint] = STEP
    pulse = np.diff(simulate_manipulator(plant, commands)["angle"][:, joint])
    behind = np.flatnonzero(-phase(pulse, period) > 0.5 * np.pi)
    pole = min(POLE, float(FREQUENCIES[behind[0]])) if behind.size else POLE
    return JointDynamics(pole, mean_time(pulse, period))


def mean_time(pulse: Array, period: float) -> float:
    """Return the delay [s] for slow inputs, without the hold, from a response's increments."""
    time = (np.arange(len(pulse)) + 1.0) * period
    return float(time @ pulse / np.sum(pulse)) - 0.5 * period


def phase(pulse: Array, period: float) -> Array:
    """Return the phase [rad] at ``FREQUENCIES``, without the hold, from a response's increments."""
    time = (np.arange(len(pulse)) + 1.0) * period
    response = np.exp(-1j * np.multiply.outer(FREQUENCIES, time)) @ pulse
    return np.unwrap(np.angle(response)) + 0.5 * period * FREQUENCIES
