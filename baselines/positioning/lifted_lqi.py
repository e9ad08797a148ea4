"""Lifted linear-quadratic control with integral action of the single muscle (chen1995).

The muscle is the linear model of the SIMC rule, over its steepest static gain: lags of regulator
and mass, and dead time. Lifting stacks the inputs of a frame of ``FRAME`` control periods into one
vector,

    x_(k+1) = A^N x_k + [A^(N-1) B ... B] U_k

so that state and integral are fed back once a frame, and each of its setpoints has a gain of its
own: a multirate controller whose outer loop, at a quarter of the control rate, may run on slower
electronics. Its gains are those of python-control's ``dlqr`` on the lifted model with the integral
of the error; between frames a Kalman filter (``dlqe``) follows the sensed contraction.

Deviations count from the start of an episode, whose setpoint is held without error. The integral
pauses while setpoints are limited.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from baselines.core.controller import Prediction, Reader, RowController, encode_action, reader
from baselines.core.entry import Bounds, Entry, Spec
from baselines.linear.systems import DiscreteSystem, delayed, from_polynomials
from baselines.positioning.nominal import Nominal
from pam_envs.arrays import Array
from pam_envs.parameters import Signal
from pam_envs.plants.single_muscle.plant import SingleMuscle

FRAME = 4
"""Control periods of a frame."""
INTEGRAL_TIME = 0.3
"""Time [s] in which the integral of an error weighs as much as the error."""
EFFORT = 0.2
"""Weight of a squared setpoint, in contraction at the static gain, over a squared error."""
DRIFT = 10.0
"""RMS of the process noise over that of the sensor, in contraction at the static gain."""
KNOBS: Bounds = {"integral_time": (0.25, 4.0), "effort": (0.1, 10.0)}


class LiftedGains(NamedTuple):
    """Gains of the setpoints of a frame.

    On the estimated state, shape (FRAME, n), on the integral, (FRAME,), and of the Kalman filter,
    (n,).
    """

    state: Array
    integral: Array
    filter: Array


class LqiState(NamedTuple):
    """Estimated state, integral [m s], setpoints of the frame [Pa], period in it, and start.

    Setpoint [Pa] and contraction [m] of the start have the shape (n_env,).
    """

    state: Array
    integral: Array
    frame: Array
    period: NDArray[np.int64]
    set_point: Array
    contraction: Array


@dataclass(frozen=True)
class LiftedLqi(RowController):
    """Lifted state feedback with integral action; see the module.

    ``model`` has the static gain 1, ``rest`` is its state at an output of 1, and ``gain`` the
    static gain of the muscle [m/Pa].
    """

    model: DiscreteSystem
    gains: LiftedGains
    rest: Array
    gain: float
    reader: Reader
    action_signal: Signal

    def initial_state(self, observation: ArrayLike) -> LqiState:
        """Return the state at rest at the first measurement."""
        contraction, set_point, _ = self.reader.rows(observation)
        n = len(contraction)
        frame = np.repeat(set_point[:, None], FRAME, axis=1)
        zeros, count = np.zeros(n), np.zeros(n, np.int64)
        state = self.model.initial_state(n)
        return LqiState(state, zeros, frame, count, set_point, contraction)

    def respond(self, observation: ArrayLike, now: LqiState) -> Prediction:
        """Return the action and the next state."""
        contraction, _, reference = self.reader.rows(observation)
        measured, desired = contraction - now.contraction, reference - now.contraction
        innovation = measured - self.model.output(0.0, now.state)
        state = now.state + innovation[:, None] * self.gains.filter
        distance = state - desired[:, None] * self.rest
        feedback = np.add.reduce(self.gains.state * distance[:, None, :], axis=2)
        feedback = feedback + self.gains.integral * now.integral[:, None]
        unlimited = now.set_point[:, None] + (desired[:, None] - feedback) / self.gain
        signal, begins = self.action_signal, (now.period == 0)[:, None]
        fresh = np.minimum(np.maximum(unlimited, signal.low), signal.high)
        frame = np.where(begins, fresh, now.frame)
        command = frame[np.arange(len(frame)), now.period]
        limited = np.any(fresh != unlimited, axis=1)
        grown = now.integral + np.where(limited, 0.0, self.model.period * (desired - measured))
        after = LqiState(
            self.model.advance(self.gain * (command - now.set_point), state),
            grown,
            frame,
            (now.period + 1) % FRAME,
            now.set_point,
            now.contraction,
        )
        return encode_action(signal, command, observation), after


def lifted(model: DiscreteSystem) -> tuple[Array, Array]:
    """Return the matrices ``A^N`` and ``[A^(N-1) B, A^(N-2) B, up to B]`` of a frame."""
    powers = [np.linalg.matrix_power(model.a, k) for k in range(FRAME + 1)]
    return powers[FRAME], np.array([power @ model.b for power in powers[FRAME - 1 :: -1]]).T


def design_lqi(model: DiscreteSystem, integral_time: float, effort: float) -> LiftedGains:
    """Return the gains for a model of static gain 1."""
    import control

    a, b = lifted(model)
    n, frame_time = len(a), FRAME * model.period
    whole = np.block([[a, np.zeros((n, 1))], [-frame_time * model.c[None], np.ones((1, 1))]])
    drive = np.vstack([b, np.zeros((1, FRAME))])
    seen = np.append(model.c, 0.0)
    weight = np.outer(seen, seen)
    weight[-1, -1] = 1.0 / integral_time**2
    found, _, _ = control.dlqr(whole, drive, weight, effort / FRAME * np.eye(FRAME))
    noise = DRIFT**2 * np.outer(model.b, model.b) + 1e-9 * np.eye(n)
    kalman, _, _ = control.dlqe(model.a, np.eye(n), model.c[None], noise, np.eye(1))
    return LiftedGains(np.asarray(found[:, :n]), np.asarray(found[:, n]), np.asarray(kalman[:, 0]))


def make_lifted_lqi(spec: Spec[SingleMuscle]) -> LiftedLqi:
    """Return the controller."""
    plant, nominal = spec.plant, Nominal(spec.plant)
    gain, period = nominal.steepest_gain, plant.control_period
    lags = np.polymul([plant.regulator.time_constant, 1.0], [nominal.mechanical_lag, 1.0])
    model = delayed(from_polynomials([1.0], lags), plant.regulator.dead_time, period)
    times = spec.knob("integral_time") * INTEGRAL_TIME, spec.knob("effort") * EFFORT
    return LiftedLqi(
        model,
        design_lqi(model, *times),
        model.rest_state(1.0),
        gain,
        reader(spec.signals, ["contraction", "set_point", "reference"]),
        spec.actions["pressure_set_point"],
    )


ENTRIES = {
    "lifted_lqi": Entry(
        "multirate linear-quadratic control with integral action, by lifting over four periods",
        "nominal model",
        make_lifted_lqi,
        feedback=True,
        citation="chen1995; skogestad2003",
        plants=(SingleMuscle,),
        knobs=KNOBS,
    ),
}
