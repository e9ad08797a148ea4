"""Predictive inverse of joints with an observer of the disturbance torque.

    preview -> torques along the reference -> setpoints that exert them there
    -> best rate-limited path -> setpoint, one dead time ahead

This is model predictive control of the nominal joint or arm, solved by exploiting its structure, as
for the single muscle (:mod:`baselines.positioning.predictive`). Friction is driven by the length of
the muscles, and hence by the angle, so that it is known in advance along a previewed reference
``r``. To follow the reference the muscles have to exert

    torque = M r'' + D r' + weight(r) - d + P e + Q e'

where ``d`` is the disturbance torque, and ``e = r - q`` the error predicted for the time at which a
setpoint takes effect. ``M`` is the mass matrix of the straight joints; in an arm it couples the
joints. The static law less the friction of each muscle gives the setpoints at which the muscles
exert this torque at the angle ``r``; a muscle whose friction exceeds the force of its static law is
slack and exerts no force. The difference between the two pressures of a joint, which changes by at
most twice the rate limit, follows the best rate-limited path towards the differences of those
setpoints (:mod:`baselines.predictive.rate_limited`).

A Kalman filter compares the sensed angle with the motion of the nominal joint under the estimated
pressures, and corrects angle, rate and ``d`` (pannocchia2003): an undeclared payload, a wrong force
law and wrong friction act as such a torque. ``P`` and ``Q`` are the gains of a linear-quadratic
regulator for the linear motion (anderson2007). With an exact model and ideal sensors ``d`` and
``e`` are zero. The model of the pressure regulators is selected from a bank
(:mod:`baselines.predictive.regulator`) by the sensed pressures, one model for all muscles.

In an arm, a joint whose setpoint is at the end of its range cannot reach its reference; the other
joints compensate for the error of the tool by damped least squares (nakamura1986).

For a plant without muscles, or with friction driven by pressure, whose inverse acts on the
setpoint, the controller is the model-following one (``joint_mfc_mu_ahead``) as designed.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, Reader, RowController, by_load, reader
from baselines.core.entry import Bounds, Spec
from baselines.joint.base import (
    JOINT_ENTRY,
    LARGEST_TORQUE,
    Gravity,
    JointSignalMap,
    JointView,
    make_joint_signal_map,
)
from baselines.joint.model_following import ModelFollowing, make_model_following
from baselines.joint.pair_model import LinearMotion, PairModel
from baselines.predictive.preview import Preview, PreviewMemory
from baselines.predictive.rate_limited import best_path
from baselines.predictive.regulator import BankState, RegulatorBank
from pam_envs.arrays import Array

BLOCKS = np.array((1.0,) * 10 + (2.0,) * 6 + (4.0,) * 8)
"""Control periods between the nodes of the horizon, 0.54 s in total."""
ENDS = np.cumsum(BLOCKS)
"""Nodes of the horizon [periods], counted from the time at which a setpoint takes effect."""
APART = 3.0
"""Spacing [periods] of the samples whose differences give rate and acceleration of a reference."""
LEAD = 0.5
"""Share of the damping of muscles and link that is compensated by a lead of the reference; the rest
is compensated by a torque proportional to the rate of the reference."""
LEAST_NOISE = 1e-4
"""Smallest noise [rad] of the sensed angle for which the observer is designed."""
RATE_STEP, TORQUE_STEP = 0.002, 0.01
"""Random steps per period of the rate [rad/s] and of the disturbance torque [N m]. With an accurate
sensor, the estimate of a steadily changing torque lags by the inertia times the first over the
second: by 0.2 s per kg m2. In an arm the inertia is up to 0.8 kg m2."""
LARGEST_ERROR, LARGEST_RATE_ERROR = 0.05, 0.5
"""Limits of the errors of angle [rad] and rate [rad/s] that are fed back."""
END_TOLERANCE = 1e-4
"""Distance [rad] from the end of its range within which a setpoint counts as at the end."""
SMALLEST_SHORTFALL, LARGEST_SHIFT = 5e-4, 0.1
"""Shortfall [rad] of a joint above which the other joints compensate for it, and largest
compensation [rad]."""
SETTLING = 10.0
"""Time constant [periods] of the filter of the shortfalls."""
TOOL = 0.1
"""Length [m] by which an error of the tool's direction is weighted against one of its position."""
COMPENSATION_DAMPING = 0.02
"""Damping of the least squares [m/rad]."""
GRADIENT = 1e-4
"""Step of the angle [rad] with which the stiffness due to the weight is computed."""
KNOBS: Bounds = {"lead": (0.1, 4.0), "observer": (0.03, 10.0), "feedback": (0.1, 10.0)}
"""Factors on the lead, on the random step of the torque for which the observer is designed, and on
the weight of an angle error in the linear-quadratic regulator."""


class PredictiveState(NamedTuple):
    """State of the controller; the first axis is n_env, the second n_joints.

    Attributes
    ----------
    bank, seen
        State of the bank of regulators, grouped by environment, and stored preview.
    pressure : ndarray, shape (n_env, n_joints, 2)
        Estimated pressures [Pa] of the muscles.
    sliders : ndarray, shape (n_env, n_joints, 2, elements)
        Positions [1] of the sliders of the friction elements.
    angle, rate, disturbance : ndarray, shape (n_env, n_joints)
        Estimated angle [rad], rate [rad/s] and disturbance torque [N m].
    shortfall : ndarray, shape (n_env, n_joints)
        Angles [rad] by which joints at the end of their range miss the reference.
    """

    bank: BankState
    seen: Preview
    pressure: Array
    sliders: Array
    angle: Array
    rate: Array
    disturbance: Array
    shortfall: Array


class Demand(NamedTuple):
    """Reference at the nodes of the horizon, (n_env, n_joints, n_nodes), and feedback torque.

    ``angle`` [rad] is the reference at the nodes. ``led`` [rad] is the reference one lead later, at
    which ``rate`` [rad/s] and ``acceleration`` [rad/s2] are taken as well. ``feedback`` [N m],
    shape (n_env, n_joints), is added to the torque.
    """

    angle: Array
    led: Array
    rate: Array
    acceleration: Array
    feedback: Array


@dataclass(frozen=True)
class StraightMotion:
    """Motion of the straight joints with a payload, and the gains designed for it.

    ``observer`` and ``feedback`` are factors; see ``KNOBS``.
    """

    plant: Any
    model: PairModel
    observer: float
    feedback: float

    @cached_property
    def damping(self) -> Array:
        """Damping [N m s/rad] in addition to that of the muscles and their link, (n_joints,)."""
        plant = self.plant
        if plant.stages == 1:
            return np.zeros(1)
        return np.asarray(plant.arm.damping_factor * np.array(plant.joint_damping))

    @cached_property
    def mass(self) -> Callable[[float], Array]:
        """Function from a payload [kg] to the mass matrix [kg m2], cached."""
        return cache(self._mass)

    @cached_property
    def gains(self) -> Callable[[float], tuple[Array, Array]]:
        """Function from a payload [kg] to the gains of observer and regulator, cached.

        Their shapes are (3 n_joints, n_joints) and (n_joints, 2 n_joints)
        (:class:`~baselines.joint.pair_model.LinearMotion`).
        """
        return cache(self._gains)

    def _mass(self, payload: float) -> Array:
        if self.plant.stages > 1:
            found = self.plant.chain.mass_matrix(np.zeros(self.plant.stages), payload)
            return np.asarray(found)
        link = self.plant.link
        return np.array([[link.inertia + payload * link.length**2]])

    def linear(self, payload: float) -> LinearMotion:
        """Return the linear motion about the straight pose with a payload [kg]."""
        plant, model, unit = self.plant, self.model, np.eye(self.plant.stages)
        held, weight = np.full(len(unit), payload), Gravity(plant).torque
        slope = weight(GRADIENT * unit, held) - weight(-GRADIENT * unit, held)
        stiffness = model.stiffness * unit + slope / (2.0 * GRADIENT)
        damping = model.damping + self.damping
        return LinearMotion.make(self._mass(payload), damping, stiffness, plant.control_period)

    def _gains(self, payload: float) -> tuple[Array, Array]:
        plant, motion = self.plant, self.linear(payload)
        noise = max(LEAST_NOISE, math.hypot(plant.angle.noise, plant.angle.resolution / 12**0.5))
        steps = (RATE_STEP, self.observer * TORQUE_STEP)
        regulator = motion.regulator(self.feedback * self.model.stiffness)
        return motion.observer(noise, *steps), regulator


@dataclass(frozen=True)
class JointPredictive(RowController):
    """Predictive inverse; see the module.

    Attributes
    ----------
    pressures : Reader
        Reader of the sensed pressures; those of the two muscles of a joint are adjacent.
    lead : float
        Lead of the reference [s].
    """

    model: PairModel
    signals: JointSignalMap
    gravity: Gravity
    pressures: Reader
    memory: PreviewMemory
    bank: RegulatorBank
    motion: StraightMotion
    lead: float

    def initial_state(self, observation: ArrayLike) -> PredictiveState:
        """Return the state at rest at the present angles and setpoints."""
        view = self.signals.read(observation)
        held, still = self.model.pressures(view.set_point), np.zeros_like(view.angle)
        sliders = self.model.initial(view.angle.ravel(), held.reshape(-1, 2))
        return PredictiveState(
            self.bank.start(held.ravel()).grouped(held[0].size),
            self.memory.start(view.samples),
            held,
            sliders.reshape(*held.shape, -1),
            view.angle,
            still,
            still,
            still,
        )

    def respond(self, observation: ArrayLike, state: PredictiveState) -> Prediction:
        """Return the action and the next state."""
        view = self.signals.read(observation)
        now = self.observed(observation, view, state)
        set_point, shortfall = self._set_points(view, now)
        bank = self.bank.advance(now.bank, self.model.pressures(set_point).ravel())
        bank = bank.grouped(now.pressure[0].size)
        after = now._replace(bank=bank, shortfall=shortfall)
        return self.signals.write(set_point, observation), after

    def observed(
        self, observation: ArrayLike, view: JointView, state: PredictiveState
    ) -> PredictiveState:
        """Return the state updated with an observation of reference and plant."""
        sensed = self.pressures.rows(observation).T
        bank = self.bank.alike(
            self.bank.observe(state.bank.flat(), sensed.ravel()), sensed.shape[1]
        )
        pressure = self.bank.now(bank).reshape(state.pressure.shape)
        expected = self._moved(view, state, pressure[None], np.ones((1, len(sensed))))
        n = view.angle.shape[1]
        gains, _ = self._gains(view.payload)
        more = _product(gains, view.angle - expected.angle)
        angle = expected.angle + more[:, :n]
        flat = angle.reshape(-1, 1), pressure.reshape(-1, 2), _flat(state.sliders)
        sliders = self.model.friction(*flat)[1].reshape(state.sliders.shape)
        return expected._replace(
            bank=bank,
            seen=self.memory.add(state.seen, view.samples),
            sliders=sliders,
            angle=angle,
            rate=expected.rate + more[:, n : 2 * n],
            disturbance=np.clip(
                state.disturbance + more[:, 2 * n :], -LARGEST_TORQUE, LARGEST_TORQUE
            ),
        )

    def _moved(
        self, view: JointView, state: PredictiveState, stages: Array, times: Array
    ) -> PredictiveState:
        """Return the state after stages, at the end of each of which the pressures [Pa] are given.

        ``stages`` has the shape (n_stages, n_env, n_joints, 2), ``times`` [periods] (n_stages,
        n_env). The midpoint rule is linearly implicit and therefore stable for every stiffness.
        """
        angle, rate, was, sliders = state.angle, state.rate, state.pressure, _flat(state.sliders)
        mass, unit = self._masses(view.payload), np.eye(angle.shape[1])
        for stage, time in zip(stages, times, strict=True):
            if not time.any():
                continue
            h = (time * self.bank.period)[:, None]
            ahead, middle = angle + 0.5 * h * rate, 0.5 * (was + stage)
            found, slid = self.model.pull(ahead.ravel(), middle.reshape(-1, 2), sliders)
            torque, stiffness, damping = (part.reshape(angle.shape) for part in found)
            damping = damping + self.motion.damping
            net = torque + state.disturbance - self.gravity.torque(ahead, view.payload)
            left = mass + (0.5 * h * damping + 0.25 * h * h * stiffness)[..., None] * unit
            gained = _solved(left, h * (net - damping * rate))
            angle, rate = angle + h * (rate + 0.5 * gained), rate + gained
            moving = np.repeat(time > 0.0, angle.shape[1])[:, None, None]
            sliders, was = np.where(moving, slid, sliders), stage
        flat = angle.reshape(-1, 1), stages[-1].reshape(-1, 2), sliders
        shaped = self.model.friction(*flat)[1].reshape(state.sliders.shape)
        return state._replace(angle=angle, rate=rate, pressure=stages[-1], sliders=shaped)

    def _masses(self, payload: Array) -> Array:
        """Return the mass matrices [kg m2] of the rows, shape (n_env, n_joints, n_joints)."""

        def repeated(load: float, rows: Array) -> Array:
            return np.repeat(self.motion.mass(load)[None], len(rows), axis=0)

        return np.asarray(by_load(payload, repeated, payload))

    def _gains(self, payload: Array) -> tuple[Array, Array]:
        """Return the gains of observer and regulator of the rows."""

        def repeated(load: float, rows: Array) -> tuple[Array, ...]:
            return tuple(
                np.repeat(part[None], len(rows), axis=0) for part in self.motion.gains(load)
            )

        observer, regulator = by_load(payload, repeated, payload)
        return observer, regulator

    def _set_points(self, view: JointView, now: PredictiveState) -> tuple[Array, Array]:
        """Return the setpoints [rad] and the shortfalls [rad], shape (n_env, n_joints)."""
        shape, period = view.angle.shape, self.bank.period
        arrival = self.bank.arrival(now.bank)
        stages = arrival.pressures.reshape(-1, *shape, 2)
        delay, rate, lag = (
            part.reshape(*shape, 2)[..., 0] for part in (arrival.delay, arrival.rate, arrival.lag)
        )
        count, whole = np.arange(len(stages))[:, None], np.floor(delay[:, 0])
        first = np.where(count == 0, delay[:, 0] - whole, 1.0)
        then = self._moved(view, now, stages, np.where(count <= whole, first, 0.0))
        shortfall = self._shortfall(view, now)
        shift = self._compensation(view, shortfall)
        demand = self._demand(view, now, then, delay[:, 0], shift)
        later = then.pressure.reshape(-1, 2)
        wanted = self.model.difference(self._levels(view, then, demand)).reshape(len(later), -1)
        weight, reach = np.tile(BLOCKS, (len(later), 1)), 2.0 * period * rate.reshape(-1, 1)
        path = best_path(later[:, 0] - later[:, 1], wanted, weight, reach * BLOCKS)
        found = self.model.command(later, path[:, 0], lag.ravel(), rate.ravel(), period)
        return found.reshape(shape), shortfall

    def _demand(
        self,
        view: JointView,
        now: PredictiveState,
        then: PredictiveState,
        delay: Array,
        shift: Array,
    ) -> Demand:
        """Return the demand on setpoints that take effect after a delay [periods], shape (n_env,).

        ``then`` is the predicted state at that time. ``shift``, shape (n_env, n_joints), is added
        to the reference [rad].
        """
        period = self.bank.period
        start = (now.seen.step + delay)[:, None]
        at = start + ENDS + self.lead / period
        around = start + np.array([-1.0, 0.0, 1.0])
        times = (start + ENDS, at - APART, at, at + APART, around)
        given = np.maximum(np.concatenate(times, axis=1), 0.0)
        samples = self.memory.read(now.seen, given)[0] + shift[..., None]
        angle, before, led, after, near = np.split(samples, np.arange(1, 5) * len(ENDS), axis=2)
        ahead = APART * period
        off = near[..., 1] - then.angle
        slow = (near[..., 2] - near[..., 0]) / (2.0 * period) - then.rate
        off = np.clip(off, -LARGEST_ERROR, LARGEST_ERROR)
        slow = np.clip(slow, -LARGEST_RATE_ERROR, LARGEST_RATE_ERROR)
        _, gains = self._gains(view.payload)
        return Demand(
            angle,
            led,
            (after - before) / (2.0 * ahead),
            (before - 2.0 * led + after) / ahead**2,
            _product(gains, np.concatenate([off, slow], axis=1)),
        )

    def _levels(self, view: JointView, then: PredictiveState, demand: Demand) -> Array:
        """Return the setpoints [rad] at which the muscles exert the torques of a demand.

        The friction is that at the pressures at which a setpoint takes effect, not at those of the
        nodes.
        """
        shape, model = demand.angle.shape, self.model
        flat = demand.angle.reshape(-1, shape[2])
        drag, _ = model.friction(flat, then.pressure.reshape(-1, 2), _flat(then.sliders))
        nodes = np.moveaxis(demand.angle, 2, 1)
        payload = np.repeat(view.payload, shape[2])
        weight = self.gravity.torque(nodes.reshape(-1, shape[1]), payload).reshape(nodes.shape)
        torque = np.moveaxis(weight, 1, 2) + (demand.feedback - then.disturbance)[..., None]
        damping = self.motion.damping + model.damping - self.lead * model.stiffness
        torque = torque + damping[:, None] * demand.rate
        pushed = self._masses(view.payload)[..., None] * demand.acceleration[:, None]
        torque = torque + np.add.reduce(pushed, axis=2)
        bend = 0.5 * self.lead**2 * demand.acceleration
        static = model.set_point(demand.angle, torque, drag.reshape(*shape, 2)) - demand.angle
        return demand.led - bend + static

    def _shortfall(self, view: JointView, now: PredictiveState) -> Array:
        """Return the filtered angles [rad] by which joints at the end of their range fall short."""
        low, high = self.model.plant.angle_range
        off = np.clip(now.angle - view.reference, -LARGEST_SHIFT, LARGEST_SHIFT)
        ends = np.abs(view.set_point - np.where(view.set_point > 0.0, high, low)) <= END_TOLERANCE
        short = np.where(ends & (off * view.set_point < 0.0), off, 0.0)
        return np.asarray(now.shortfall + (short - now.shortfall) / SETTLING)

    def _compensation(self, view: JointView, shortfall: Array) -> Array:
        """Return the shifts of the references [rad] that compensate for the error of the tool."""
        chain = getattr(self.model.plant, "chain", None)
        size = np.maximum(np.abs(shortfall) - SMALLEST_SHORTFALL, 0.0)
        if chain is None or not size.any():
            return np.zeros_like(shortfall)
        scale = np.repeat([1.0, TOOL], 3)[:, None]
        jacobian = scale * chain.jacobian(view.reference)
        free = np.where(size[:, None] > 0.0, 0.0, jacobian)
        error = np.add.reduce(jacobian * (np.sign(shortfall) * size)[:, None], axis=2)
        square = np.add.reduce(free[..., None] * free[:, :, None], axis=1)
        left = square + COMPENSATION_DAMPING**2 * np.eye(shortfall.shape[1])
        shift = -_solved(left, np.add.reduce(free * error[..., None], axis=1))
        return np.clip(shift, -LARGEST_SHIFT, LARGEST_SHIFT)


def _flat(sliders: Array) -> Array:
    """Return the sliders with one row for each joint, shape (n_env n_joints, 2, elements)."""
    return sliders.reshape(-1, *sliders.shape[2:])


def _product(matrix: Array, rows: Array) -> Array:
    """Return ``matrix @ row`` for every row, summed in an order independent of the other rows.

    ``matrix`` has the shape (n_env, m, n), ``rows`` (n_env, n).
    """
    return np.asarray(np.add.reduce(matrix * rows[:, None], axis=2))


def _solved(left: Array, right: Array) -> Array:
    """Return the solution of the linear system of each row."""
    return np.asarray(np.linalg.solve(left, right[..., None])[..., 0])


def make_joint_predictive(spec: Spec[Any]) -> JointPredictive | ModelFollowing:
    """Return the controller of a joint or an arm."""
    plant, period = spec.plant, spec.plant.control_period
    if not PairModel.fits(plant):
        return make_model_following(replace(spec, knobs={}), gravity=True, ahead=True)
    signals, model = make_joint_signal_map(spec.signals, spec.actions), PairModel(plant)
    names = [""] if plant.stages == 1 else [str(k) for k in range(plant.stages)]
    muscles = [f"pressure_{name}{muscle}" for name in names for muscle in "ab"]
    return JointPredictive(
        model,
        signals,
        Gravity(plant),
        reader(spec.signals, muscles),
        PreviewMemory.make(np.array([round(time / period) for time in signals.times])),
        RegulatorBank.make(plant, adaptive=True),
        StraightMotion(plant, model, spec.knob("observer"), spec.knob("feedback")),
        spec.knob("lead") * LEAD * model.damping / model.stiffness,
    )


ENTRIES = {
    "joint_predictive": JOINT_ENTRY(
        "predictive control of the nominal joint or arm: torques along the previewed reference,"
        " best rate-limited path, torque observer, estimated regulator",
        make=make_joint_predictive,
        preview=True,
        feedback=True,
        citation="bertsekas2017; pannocchia2003; anderson2007; nakamura1986; magill1965",
        knobs=KNOBS,
    ),
}
