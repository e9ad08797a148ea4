"""PID control with limited output, and the SIMC tuning rule (skogestad2003).

A plant of two lags and a dead time, ``K exp(-theta s) / ((tau_1 s + 1) (tau_2 s + 1))``, has the
cascade form

    K_c = tau_1 / (K (tau_c + theta)),  tau_I = min(tau_1, 4 (tau_c + theta)),  tau_D = tau_2

The rule's one choice is the time constant ``tau_c`` of the closed loop; its recommendation, "fast,
with good robustness", is ``tau_c = theta``.

``theta`` includes one and a half control periods besides the plant's dead time: half a period of
the hold, and one of computing on a real rig. The environments have no computing delay (an action
applies from the instant of its observation), so that in simulation the whole period is margin.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, RowController, encode_action
from baselines.core.entry import AS_DESIGNED, Bounds, Knobs
from pam_envs.arrays import Array
from pam_envs.parameters import Signal

DELAY_PERIODS = 1.5
"""Control periods of dead time: hold and computing."""
FILTER = 8.0
"""Derivative time over the time constant of its filter."""
PI_KNOBS: Bounds = {"closed_loop_time": (0.1, 10.0), "integral_time": (0.25, 4.0)}
PID_KNOBS: Bounds = {**PI_KNOBS, "derivative_time": (0.25, 16.0)}
"""Factors on ``tau_c``, ``tau_I`` and ``tau_D``."""


class Gains(NamedTuple):
    """Gains of the parallel form, in units of the output over those of the measurement.

    Attributes
    ----------
    derivative : float
        Gain [s times the unit of the gains] on the derivative of the measurement, without a kick at
        reference steps.
    filter_time : float
        Time constant [s] of the first-order filter on the derivative.
    tracking_time : float
        Time constant [s] of the integral's back-calculation while the output is saturated.
    """

    proportional: float
    integral: float
    derivative: float
    filter_time: float
    tracking_time: float


class Simc(NamedTuple):
    """Parameters of the cascade form: ``K_c``, ``tau_I`` [s] and ``tau_D`` [s]."""

    gain: float
    integral_time: float
    derivative_time: float

    def parallel(self, filter_time: float) -> Gains:
        """Return the gains of the parallel form, with a filter [s] on the derivative."""
        return Gains(
            self.gain * (1.0 + self.derivative_time / self.integral_time),
            self.gain / self.integral_time,
            self.gain * self.derivative_time,
            filter_time,
            tracking_time=self.integral_time,
        )


def simc_rule(
    gain: float,
    slow: float,
    fast: float,
    dead_time: float,
    closed_loop_time: float | None = None,
    knobs: Knobs = AS_DESIGNED,
) -> Simc:
    """Return the parameters of the rule; see the module.

    For ``K``, ``tau_1``, ``tau_2`` (0 for a PI), ``theta`` and ``tau_c`` (default ``theta``). The
    knobs are those of ``PID_KNOBS``; the factor on ``tau_c`` acts before the rule.
    """
    chosen = dead_time if closed_loop_time is None else closed_loop_time
    total = dead_time + knobs.get("closed_loop_time", 1.0) * chosen
    return Simc(
        slow / (gain * total),
        knobs.get("integral_time", 1.0) * min(slow, 4.0 * total),
        knobs.get("derivative_time", 1.0) * fast,
    )


class PidState(NamedTuple):
    """Integral part of the output, last measurement and its filtered slope, shapes (n_env,)."""

    integral: Array
    measured: Array
    slope: Array


def pid_start(output: Array, measured: Array) -> PidState:
    """Return the state that gives ``output`` while the error is 0."""
    return PidState(output, measured, np.zeros_like(measured))


def pid_step(
    gains: Gains,
    state: PidState,
    error: Array,
    measured: Array,
    low: Array | float,
    high: Array | float,
    period: float,
) -> tuple[Array, PidState]:
    """Return the output, held between ``low`` and ``high``, and the state after a period [s].

    Anti-windup by back-calculation: the limited part is subtracted from the integral with the
    tracking time, and the integral itself stays within the limits.
    """
    pole = gains.filter_time / (gains.filter_time + period)
    slope = pole * state.slope + (1.0 - pole) * (measured - state.measured) / period
    unlimited = gains.proportional * error + state.integral - gains.derivative * slope
    output = np.minimum(np.maximum(unlimited, low), high)
    back = (output - unlimited) * min(1.0, period / gains.tracking_time)
    integral = state.integral + gains.integral * period * error + back
    integral = np.minimum(np.maximum(integral, low), high)
    return output, PidState(integral, measured, slope)


class PidView(NamedTuple):
    """Setpoint, measurement, reference and limits of the setpoint, shapes (n_env,)."""

    set_point: Array
    measured: Array
    reference: Array
    low: Array | float
    high: Array | float


@dataclass(frozen=True)
class Pid(RowController):
    """PID of one signal with a control period [s]; ``view`` reads it from an observation."""

    gains: Gains
    view: Callable[[ArrayLike], PidView]
    action_signal: Signal
    period: float

    def initial_state(self, observation: ArrayLike) -> PidState:
        """Return the state that holds the present setpoint."""
        view = self.view(observation)
        return pid_start(view.set_point, view.measured)

    def respond(self, observation: ArrayLike, state: PidState) -> Prediction:
        """Return the action and the next state."""
        _, measured, reference, low, high = self.view(observation)
        error = reference - measured
        output, after = pid_step(self.gains, state, error, measured, low, high, self.period)
        return encode_action(self.action_signal, output, observation), after
