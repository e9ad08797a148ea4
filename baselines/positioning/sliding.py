"""Integral sliding mode on the predictive inverse of the single muscle (utkin1996, shtessel2014).

    s = e + (1 / tau_I) integral of e dt,   e = nominal contraction - sensed contraction
    setpoint = predictive inverse + K sat(s / Phi)

The integral makes ``s = 0`` at the start of an episode: the plant is on the sliding surface from
the first instant (no reaching phase, bumpless), and on it the error decays with ``tau_I``. ``K`` is
the authority: the largest error of the model, in pressure, that is corrected. A dead time rules out
ideal sliding, which would chatter with an amplitude of the dead time times the rate limit; within
the boundary layer ``Phi`` the gain is that of the SIMC rule
(:mod:`baselines.positioning.pid`). Unlike a PI, the correction is bounded by ``K`` whatever the
error, and the integral rests outside the layer.
"""

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, RowController, encode_action
from baselines.core.entry import Bounds, Spec
from baselines.positioning.pid import simc
from baselines.positioning.predictive import (
    PREDICTIVE,
    PredictiveInverse,
    PredictiveState,
    make_predictive,
)
from pam_envs.arrays import Array
from pam_envs.plants.single_muscle.plant import SingleMuscle

AUTHORITY = 0.15
"""Largest correction over the full pressure (assumed): 0.9 bar."""
KNOBS: Bounds = {"authority": (0.25, 4.0), "integral_time": (0.25, 4.0)}


class SlidingState(NamedTuple):
    """State of the predictive inverse, and integral of the error over ``tau_I`` [m], (n_env,)."""

    forward: PredictiveState
    integral: Array


@dataclass(frozen=True)
class SlidingInverse(RowController):
    """Predictive inverse and integral sliding mode; see the module.

    Attributes
    ----------
    authority : float
        K [Pa].
    layer : float
        Phi [m].
    integral_time : float
        tau_I [s].
    """

    forward: PredictiveInverse
    authority: float
    layer: float
    integral_time: float

    def initial_state(self, observation: ArrayLike) -> SlidingState:
        """Return the state on the sliding surface."""
        forward = self.forward.initial_state(observation)
        return SlidingState(forward, np.zeros_like(forward.expected))

    def respond(self, observation: ArrayLike, state: SlidingState) -> Prediction:
        """Return the action and the next state."""
        forward, signal = self.forward, self.forward.action_signal
        now = forward.observed(observation, state.forward)
        command = forward.command(observation, now)
        error = now.expected - forward.reader.rows(observation)[0]
        surface = (error + state.integral) / self.layer
        switched = self.authority * np.minimum(np.maximum(surface, -1.0), 1.0)
        moved = state.integral + error * (forward.bank.period / self.integral_time)
        outside = (np.abs(surface) > 1.0) & (surface * error > 0.0)
        integral = np.where(outside, state.integral, moved)
        after = now._replace(bank=forward.bank.advance(now.bank, command))
        return encode_action(signal, command + switched, observation), SlidingState(after, integral)


def make_sliding(spec: Spec[SingleMuscle]) -> SlidingInverse:
    """Return the controller."""
    gains = simc(spec.plant)
    authority = spec.knob("authority") * AUTHORITY * spec.plant.regulator.max_pressure
    integral_time = spec.knob("integral_time") * gains.proportional / gains.integral
    layer = authority / gains.proportional
    return SlidingInverse(make_predictive(spec), authority, layer, integral_time)


ENTRIES = {
    "predictive_inverse_sliding": partial(PREDICTIVE, feedback=True)(
        "predictive_inverse and integral sliding mode with a boundary layer",
        make=make_sliding,
        citation="krejci2001; bertsekas2017; utkin1996; shtessel2014; skogestad2003",
        knobs=KNOBS,
    ),
}
