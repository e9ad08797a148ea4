"""Nominal model of joints: identified hysteresis and motion.

The hysteresis is identified on the nominal plant as in fluidic_muscles (section 3.2) on the rig, by
first-order descending curves (:mod:`pam_envs.identification.joint_forc`), and made symmetric. The
motion after it is the paper's nominal model (section 4), two real poles at 23 rad/s. For a
manipulator the hysteresis is that of a single stage.

In an arm a joint also moves the distal links: its pole is the frequency at which its angle lags its
own setpoint by 90 degrees, as ``p^2 / (s + p)^2`` does at ``p`` (and an oscillating joint at its
natural frequency), at most that of a single stage. Its delay for slow setpoints is the mean time of
its impulse response, ``2 / p`` for a double pole and less for an oscillating joint. Both are found
by small steps of one joint at a time, with the arm straight, without hysteresis, and behind the
regulators' lag alone. The regulators' dead time precedes the motion.

A model of the motion runs beside every controller, driven by the difference between the applied
command and the controller's own (:mod:`baselines.linear.bumpless` with gains of 0). The controller
thus sees the angle that its own command would have given: it does not wind up at a limit, and an
episode starts from the present command.

The PI of fluidic_muscles (section 4) puts its zero on one of the two poles ``p`` of the nominal
plant ``K p^2 / (s + p)^2``, so that the loop is ``K_p K p^2 / (s (s + p))``, and takes the gain
for a damping ``D``: ``K_p K = 1 / (4 D^2)``, ``K_i = p K_p``. At ``D = 1/sqrt(2)`` and 23 rad/s
they are 0.5 and 11.5 1/s. The paper's plant has no dead time; here it counts as a further lag, and
divides both gains by ``1 + theta p``. The slow PI cancels the pole too, with the crossover required
of the disturbance loop, ``K_i K = 4 rad/s`` (in proportion to ``p`` for other poles).

The model loop of model-following control is computed and not measured: it runs in continuous time,
with the reference held over a period, and its mean command over the period is applied. Joint and
model of the joint both receive that mean, so that they differ only by the model error.

A PI in feedback has only the samples: by the bilinear rule at 10 ms it overshoots by 6.1 % instead
of 4.3 % on the nominal plant. A comparison of the two includes the effect of sampling; to exclude
it, run the single PI at 1 ms, which is practically continuous.

Limits act on the command after the model loop: the loop itself is unlimited, and the subsequent
model, which receives the limited command, lags. Nothing winds up.
"""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from baselines.linear.bumpless import Bumpless, BumplessGains
from baselines.linear.systems import (
    DiscreteSystem,
    StateSpace,
    delayed,
    discrete,
    double_lag,
    state_space,
)
from pam_envs.arrays import Array
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
    at rest [rad]; the double pole of each joint [rad/s] follows, behind a dead time. Control period
    and dead time in s.
    """

    hysteresis: Preisach | None
    low: float
    high: float
    period: float
    poles: tuple[float, ...] = (POLE,)
    slope: float = 1.0
    dead_time: float = 0.0

    @cached_property
    def motion(self) -> DiscreteSystem:
        """The motion of each joint at the control period, exact for an input that is held."""
        motions = [delayed(double_lag(pole), self.dead_time, self.period) for pole in self.poles]
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

    def narrowed(self, width: float) -> "JointModel":
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
    return JointModel(
        _HYSTERESIS_MODELS[key], low, high, plant.control_period, poles, dead_time=plant.dead_time
    )


STEP = 0.02
"""[rad]."""
SECONDS = 8.0
FREQUENCIES = np.geomspace(0.5, 60.0, 400)
"""[rad/s]."""


_DYNAMICS: dict[str, tuple[tuple[float, float], ...]] = {}


def joint_poles(plant: Any) -> tuple[float, ...]:
    """Return the pole of each joint [rad/s]."""
    return tuple(pole for pole, _ in _dynamics(plant))


def joint_delays(plant: Any) -> tuple[float, ...]:
    """Return the delay of each joint [s] for slow setpoints, without the hold."""
    return tuple(plant.dead_time + delay for _, delay in _dynamics(plant))


def _dynamics(plant: Any) -> tuple[tuple[float, float], ...]:
    """Return pole [rad/s] and delay [s], without dead time, of each joint, cached by plant."""
    from pam_envs.plants.redundant_manipulator.rollout import simulate_manipulator

    if plant.stages == 1:
        return ((POLE, 2.0 / POLE),)
    key, period, found = plant.digest(), plant.control_period, []
    for joint in range(plant.stages) if key not in _DYNAMICS else ():
        commands = np.zeros((round(SECONDS / period), plant.stages))
        commands[1:, joint] = STEP
        smooth = plant.with_lag_alone().replace({"hysteresis.width": 0.0})
        pulse = np.diff(simulate_manipulator(smooth, commands)["angle"][:, joint])
        behind = np.flatnonzero(-phase(pulse, period) > 0.5 * np.pi)
        pole = min(POLE, float(FREQUENCIES[behind[0]])) if behind.size else POLE
        found.append((pole, mean_time(pulse, period)))
    return _DYNAMICS.setdefault(key, tuple(found))


def mean_time(pulse: Array, period: float) -> float:
    """Return the delay [s] for slow inputs, without the hold, from a response's increments."""
    time = (np.arange(len(pulse)) + 1.0) * period
    return float(time @ pulse / np.sum(pulse)) - 0.5 * period


def phase(pulse: Array, period: float) -> Array:
    """Return the phase [rad] at ``FREQUENCIES``, without the hold, from a response's increments."""
    response = _waves(len(pulse), period) @ pulse
    return np.unwrap(np.angle(response)) + 0.5 * period * FREQUENCIES


@cache
def _waves(count: int, period: float) -> NDArray[np.complex128]:
    """Return the Fourier factors of increments at ``FREQUENCIES``, shape (400, count)."""
    time = (np.arange(count) + 1.0) * period
    return np.asarray(np.exp(-1j * np.multiply.outer(FREQUENCIES, time)))


DAMPING = 1.0 / math.sqrt(2.0)
SLOW_DAMPING = 0.5 * math.sqrt(POLE / 4.0)
"""Damping of the slow PI: a crossover of 4 rad/s at poles of 23 rad/s."""


class PiGains(NamedTuple):
    """Gains of a PI: proportional [1] and integral [1/s]."""

    proportional: float
    integral: float


def pole_cancelling(
    gain: float = 1.0, pole: float = POLE, damping: float = DAMPING, dead_time: float = 0.0
) -> PiGains:
    """Return the gains that cancel a pole [rad/s] and give a damping; see the module."""
    proportional = 1.0 / (4.0 * damping**2 * gain * (1.0 + dead_time * pole))
    return PiGains(proportional, proportional * pole)


def pi_delay(pole: float, damping: float = DAMPING, dead_time: float = 0.0) -> float:
    """Return the delay [s] of the closed loop of that PI for slow references."""
    return 4.0 * damping**2 * (1.0 / pole + dead_time)


def pi_system(gains: PiGains) -> StateSpace:
    """Return ``K_p + K_i / s``."""
    return state_space([[0.0]], [1.0], [gains.integral], gains.proportional)


def make_loop(model: JointModel, controller: Callable[[float], StateSpace]) -> Bumpless:
    """Return loops on the nominal model of each joint, from its pole [rad/s] to its controller."""
    loops = [discrete(controller(pole), model.period) for pole in model.poles]
    gains = BumplessGains(np.zeros_like(model.motion.b))
    return Bumpless(DiscreteSystem.stacked(loops), model.motion, gains, model.low, model.high)


def make_model_loop(model: JointModel, damping: float = DAMPING) -> DiscreteSystem:
    """Return the closed loops of PI and model for each joint, from reference to mean command."""
    loops = []
    for pole in model.poles:
        pi = pi_system(pole_cancelling(pole=pole, damping=damping))
        loops.append(_averaged_hold(pi.feedback(double_lag(pole)), model.period))
    return DiscreteSystem.stacked(loops)


def _averaged_hold(system: StateSpace, period: float) -> DiscreteSystem:
    """Return the system at a period [s], exact for a held input, with the mean output over it."""
    n = system.nstates
    whole = np.zeros((n + 2, n + 2))  # states, held input, integral of the output
    whole[:n, : n + 1] = np.hstack([system.A, system.B])
    whole[n + 1, : n + 1] = np.hstack([system.C, system.D])
    moved = expm(whole * period)
    mean = moved[n + 1] / period
    return DiscreteSystem(moved[:n, :n], moved[:n, n], mean[:n], np.asarray(mean[n]), period)
