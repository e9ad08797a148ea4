"""PID control of the contraction, SIMC tuning from the nominal plant (skogestad2003).

SIMC for a second-order plant with dead time (:mod:`baselines.linear.simc`), with K the steepest
static gain of the nominal muscle over its stroke (so that the loop is stable at the steepest
point), tau_1 the regulator's lag, tau_2 the lag of the mass, and theta the regulator's dead time,
half a control period of the hold, and one of computing. tau_c = theta, increased only where the
bandwidth would otherwise come within a factor of ``SWING`` of the natural frequency of the load on
the muscle, which the rule's real lags do not describe.

The regulator's slew limit causes windup as its range does: the set-point is limited about the
*measured* pressure, to ``REACH`` times the smallest lead that keeps the nominal regulator at its
slew limit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import (
    Array,
    Prediction,
    Reader,
    RowController,
    encode_action,
    reader,
)
from baselines.core.entry import Entry
from baselines.core.knobs import AS_DESIGNED, Bounds, Knobs, knob
from baselines.linear.simc import DELAY_PERIODS, PID_KNOBS, simc_rule
from baselines.positioning.nominal import Nominal
from pam_envs.parameters import Signal, Signals
from pam_envs.plants.single_muscle.plant import SingleMuscle

FILTER = 8.0
"""Derivative time over the time constant of its filter."""
SWING = 4.0
"""Least natural frequency of the load over the loop's bandwidth ``1 / (tau_c + theta)``."""

REACH = 1.5
"""Margin for a regulator slower than the nominal one; the overshoot of a step increases with it
(0.5 % of the step at 1, 10 % at 1.5, 25 % at 2)."""
KNOBS: Bounds = {**PID_KNOBS, "reach": (0.67, 2.0)}


@dataclass(frozen=True)
class Gains:
    """Gains of the parallel form, SI.

    Attributes
    ----------
    proportional : float
        [Pa/m].
    integral : float
        [Pa/(m s)].
    derivative : float
        [Pa s/m]; on the measurement, without a kick at reference steps.
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


def simc(
    plant: SingleMuscle, closed_loop_time: float | None = None, knobs: Knobs = AS_DESIGNED
) -> Gains:
    """Return the gains of the SIMC rule for a nominal plant; see the module.

    Parameters
    ----------
    plant : SingleMuscle
        Nominal plant.
    closed_loop_time : float, optional
        ``tau_c`` [s]; default: see the module.
    knobs : mapping
        Of :data:`baselines.linear.simc.PID_KNOBS`.
    """
    nominal, period = Nominal(plant), plant.control_period
    theta = plant.regulator.dead_time + DELAY_PERIODS * period
    tau_1, tau_2 = plant.regulator.time_constant, nominal.mechanical_lag
    tau_c = max(theta, SWING / nominal.slowest_swing - theta)
    if closed_loop_time is not None:
        tau_c = closed_loop_time
    gain, reset, rate = simc_rule(nominal.steepest_gain, tau_1, tau_2, theta, tau_c, knobs)
    return Gains(
        proportional=gain * (1.0 + rate / reset),
        integral=gain / reset,
        derivative=gain * rate,
        filter_time=max(tau_2 / FILTER, 0.5 * period),
        tracking_time=reset,
    )


class PidState(NamedTuple):
    """State of a PID, shapes (n_env,).

    Attributes
    ----------
    integral : ndarray
        Integral part of the output [Pa].
    measured : ndarray
        Last measurement [m].
    slope : ndarray
        Its filtered derivative [m/s].
    """

    integral: Array
    measured: Array
    slope: Array


def pid_start(output: Array, measured: Array) -> PidState:
    """Return the state at rest with an output [Pa] and a measurement [m], shapes (n_env,)."""
    return PidState(output, measured, np.zeros_like(measured))


def pid_step(
    gains: Gains,
    state: PidState,
    error: Array,
    measured: Array,
    low: ArrayLike,
    high: ArrayLike,
    period: float,
) -> tuple[Array, PidState]:
    """Return the output [Pa], held between ``low`` and ``high``, and the next state.

    Anti-windup by back-calculation: the limited part is subtracted from the integral with the
    tracking time, and the integral itself stays within the limits.

    Parameters
    ----------
    gains : Gains
    state : PidState
        Not changed.
    error, measured : ndarray, shape (n_env,)
        Reference less measured, and measured contraction [m].
    low, high : float or ndarray, shape (n_env,)
        Limits [Pa] of the output.
    period : float
        Control period [s].
    """
    pole = gains.filter_time / (gains.filter_time + period)
    slope = pole * state.slope + (1.0 - pole) * (measured - state.measured) / period
    unlimited = gains.proportional * error + state.integral - gains.derivative * slope
    output = np.minimum(np.maximum(unlimited, low), high)
    back = (output - unlimited) * min(1.0, period / gains.tracking_time)
    integral = state.integral + gains.integral * period * error + back
    integral = np.minimum(np.maximum(integral, low), high)
    return output, PidState(integral, measured, slope)


@dataclass(frozen=True)
class Pid(RowController):
    """PID from the present reference and the measured contraction and pressure.

    Attributes
    ----------
    gains : Gains
    reader : Reader
        Of contraction, pressure, set-point and reference.
    action_signal : Signal
    period : float
        Control period [s].
    reach : float
        Largest distance [Pa] of the set-point from the measured pressure.
    """

    gains: Gains
    reader: Reader
    action_signal: Signal
    period: float
    reach: float = math.inf

    def initial_state(self, observation: ArrayLike) -> PidState:
        """See :class:`~baselines.core.controller.RowController`."""
        contraction, _, set_point, _ = self.reader.rows(observation)
        return pid_start(set_point, contraction)

    def respond(self, observation: ArrayLike, state: PidState) -> Prediction:
        """See :class:`~baselines.core.controller.RowController`."""
        contraction, pressure, _, reference = self.reader.rows(observation)
        signal = self.action_signal
        output, after = pid_step(
            self.gains,
            state,
            reference - contraction,
            contraction,
            np.maximum(pressure - self.reach, signal.low),
            np.minimum(pressure + self.reach, signal.high),
            self.period,
        )
        return encode_action(signal, output, observation), after


def make_pid(
    plant: SingleMuscle,
    signals: Signals,
    action_signals: Signals,
    gains: Gains | None = None,
    knobs: Knobs = AS_DESIGNED,
) -> Pid:
    """Return the controller, with the gains of :func:`simc` unless others are given.

    Its ``knobs`` are those of ``KNOBS``: "reach" is a factor on the margin ``REACH``.
    """
    law = plant.regulator
    return Pid(
        simc(plant, knobs=knobs) if gains is None else gains,
        reader(signals, ["contraction", "pressure", "set_point", "reference"]),
        action_signals["pressure_set_point"],
        plant.control_period,
        reach=knob(knobs, "reach") * REACH * law.slew_rate * (law.dead_time + law.time_constant),
    )


ENTRIES = {
    "pid": Entry(
        "PID on the present error, SIMC tuning",
        "nominal model",
        make_pid,
        feedback=True,
        citation="skogestad2003",
        plants=(SingleMuscle,),
        knobs=KNOBS,
    ),
}
