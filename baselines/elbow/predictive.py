"""Predictive allocation of the elbow: torque and stiffness one dead time ahead.

The allocation of :mod:`baselines.elbow.allocation` computes the pressures for the present angle.
The bundles reach these pressures a dead time and a lag later, when the elbow has moved. Here torque
and stiffness are allocated for the time at which a setpoint takes effect:

    angle       q + q' t + q'' t^2 / 2, from a Kalman filter of the sensed angle
    references  Q + dQ/dq (q(t) - q) for the torque, and likewise for the stiffness
    friction    that of the nominal bundles at the predicted angle
    pressures   those that the regulators can reach in one period; the torque has priority

The filter models the acceleration as a random walk (barshalom2001). The references are functions of
the sensed angle; their slopes are estimated by regression over the latest readings. The model of
the regulators is selected from a bank by the sensed pressures, one model for both bundles
(:mod:`baselines.predictive.regulator`).

On/off valves accept a pulse only once per cycle; for a plant with such valves the controller is
``elbow_allocation_early`` as designed.
"""

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_discrete_are

from baselines.core.controller import Prediction, RowController
from baselines.core.entry import Bounds, Spec
from baselines.elbow.allocation import ElbowAllocation, make_elbow_allocation
from baselines.elbow.nominal import (
    ELBOW_ENTRY,
    ElbowFriction,
    ElbowSignalMap,
    ElbowView,
    make_elbow_friction,
    make_elbow_signal_map,
    pressures_for,
)
from baselines.predictive.regulator import BankState, RegulatorBank
from pam_envs.arrays import Array
from pam_envs.hysteresis.protocol import RowsState
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis

ACCELERATION_STEP = 0.1
"""Random step of the acceleration per period [rad/s2]."""
LEAST_NOISE = 1e-4
"""Smallest noise [rad] of the sensed angle for which the filter is designed."""
MEMORY = 4.0
"""Time constant [periods] of the regression of the references on the angle."""
LEAST_SPREAD = 1e-9
"""Variance [rad2] added to that of the angle, so that the slopes are 0 without motion."""
KNOBS: Bounds = {"lead": (0.25, 4.0), "agility": (0.05, 20.0), "memory": (0.25, 4.0)}
"""Factors on the prediction time, on the random step of the acceleration, and on ``MEMORY``."""


class ElbowState(NamedTuple):
    """State of the controller; the first axis is n_env.

    Attributes
    ----------
    bank, friction
        State of the bank of regulators, grouped by environment, and of the bundles' friction.
    motion : ndarray, shape (n_env, 3)
        Angle [rad], rate [rad/s] and acceleration [rad/s2].
    mean : ndarray, shape (n_env, 3)
        Means of angle [rad], torque [N m] and stiffness [N m/rad] of the references.
    spread : ndarray, shape (n_env, 3)
        Covariances [rad2, rad N m and N m] of the angle with these three quantities.
    """

    bank: BankState
    friction: RowsState
    motion: Array
    mean: Array
    spread: Array


@dataclass(frozen=True)
class ElbowPredictive(RowController):
    """Predictive allocation; see the module.

    Attributes
    ----------
    step : ndarray, shape (3, 3)
        State transition matrix [SI] of the motion over a period.
    gains : ndarray, shape (3,)
        Gains [1, 1/s and 1/s2] of the filter.
    lead : float
        Factor on the time until a setpoint takes effect.
    share : float
        Weight [1] of the newest reading in the regression.
    """

    signals: ElbowSignalMap
    friction: ElbowFriction
    bank: RegulatorBank
    step: Array
    gains: Array
    lead: float
    share: float

    def initial_state(self, observation: ArrayLike) -> ElbowState:
        """Return the state at rest under the sensed pressures."""
        view = self.signals.read(observation)
        still, given = np.zeros_like(view.angle), self._given(view)
        return ElbowState(
            self.bank.start(view.pressure.T.ravel()).grouped(2),
            self.friction.initial(len(view.angle)),
            np.stack([view.angle, still, still], axis=1),
            given,
            np.zeros_like(given),
        )

    @staticmethod
    def _given(view: ElbowView) -> Array:
        """Return angle and references, shape (n_env, 3)."""
        return np.stack([view.angle, view.torque_reference, view.stiffness_reference], axis=1)

    def respond(self, observation: ArrayLike, state: ElbowState) -> Prediction:
        """Return the action and the next state."""
        view, period = self.signals.read(observation), self.bank.period
        now = self.observed(view, state)
        arrival, plant = self.bank.arrival(now.bank), self.friction.plant
        later = arrival.pressures[-1].reshape(-1, 2).T
        then = self._then(view, now, arrival.delay[::2] + 1.0, later)
        losses, _ = self.friction.losses(then, now.friction)
        references = then.torque_reference, then.stiffness_reference
        limits = self._reached(later, arrival.lag[::2], arrival.rate[::2])
        pressures = np.array(pressures_for(plant, then.angle, *references, losses, limits))
        found = arrival.set_point(pressures.T.ravel(), period)
        command = np.clip(found, 0.0, plant.full_pressure)
        after = now._replace(bank=self.bank.advance(now.bank, command).grouped(2))
        return self.signals.write(command.reshape(-1, 2).T, observation), after

    def observed(self, view: ElbowView, state: ElbowState) -> ElbowState:
        """Return the state updated with an observation."""
        bank = self.bank.observe(state.bank.flat(), view.pressure.T.ravel())
        bank = self.bank.alike(bank, 2)
        expected = np.add.reduce(state.motion[:, None] * self.step, axis=2)
        motion = expected + self.gains * (view.angle - expected[:, 0])[:, None]
        held = self.bank.now(bank).reshape(-1, 2).T
        there = view._replace(angle=motion[:, 0], pressure=held)
        _, friction = self.friction.losses(there, state.friction)
        off = self._given(view) - state.mean
        spread = (1.0 - self.share) * (state.spread + self.share * off[:, :1] * off)
        return ElbowState(bank, friction, motion, state.mean + self.share * off, spread)

    def _then(self, view: ElbowView, now: ElbowState, ahead: Array, pressure: Array) -> ElbowView:
        """Return the view predicted for ``ahead`` periods later, (n_env,), at pressures [Pa]."""
        time, (angle, rate, acceleration) = self.lead * ahead * self.bank.period, now.motion.T
        angle = angle + time * (rate + 0.5 * time * acceleration)
        angle = np.clip(angle, *self.friction.plant.angle_range)
        slope = now.spread[:, 1:] / (now.spread[:, :1] + LEAST_SPREAD)
        torque, stiffness = (slope * (angle - view.angle)[:, None]).T
        return view._replace(
            angle=angle,
            pressure=pressure,
            torque_reference=view.torque_reference + torque,
            stiffness_reference=np.maximum(view.stiffness_reference + stiffness, 0.0),
        )

    def _reached(self, pressure: Array, lag: Array, rate: Array) -> tuple[Array, Array]:
        """Return the lowest and highest pressures [Pa] reachable in a period, shapes (2, n_env)."""
        share, most = -np.expm1(-self.bank.period / lag), self.bank.period * rate
        full = self.friction.plant.full_pressure
        low = np.maximum((1.0 - share) * pressure, pressure - most)
        return low, np.minimum(pressure + share * (full - pressure), pressure + most)


def make_elbow_predictive(spec: Spec[ElbowOrthosis]) -> ElbowPredictive | ElbowAllocation:
    """Return the controller."""
    plant, h = spec.plant, spec.plant.control_period
    if plant.valves == "on_off":
        return make_elbow_allocation(replace(spec, knobs={}), hysteresis=True, early=True)
    step = np.array([[1.0, h, 0.5 * h * h], [0.0, 1.0, h], [0.0, 0.0, 1.0]])
    walk = spec.knob("agility") * ACCELERATION_STEP * np.array([0.5 * h * h, h, 1.0])
    noise = max(LEAST_NOISE, math.hypot(plant.angle.noise, plant.angle.resolution / 12**0.5))
    seen = np.array([[1.0, 0.0, 0.0]])
    cover = solve_discrete_are(step.T, seen.T, np.outer(walk, walk), [[noise**2]])
    return ElbowPredictive(
        make_elbow_signal_map(spec),
        make_elbow_friction(plant, known=True),
        RegulatorBank.make(plant, adaptive=True),
        step,
        cover[:, 0] / (cover[0, 0] + noise**2),
        spec.knob("lead"),
        -math.expm1(-1.0 / (spec.knob("memory") * MEMORY)),
    )


ENTRIES = {
    "elbow_predictive": partial(ELBOW_ENTRY, citation="chakarov2018; barshalom2001; magill1965")(
        "elbow_allocation_early for the angle, references and pressures at which a setpoint takes"
        " effect; estimated regulators",
        make=make_elbow_predictive,
        knobs=KNOBS,
    ),
}
