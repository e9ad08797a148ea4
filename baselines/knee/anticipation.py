"""Anticipating inverse: the inverse of the knee orthosis over a preview horizon.

    plan, shifted -> tensions over the horizon -> inverse hysteresis -> pressures p*_k
    -> best rate-limited path -> inverse lag -> setpoint, one dead time ahead

The inverse of yeh2010 is static, and switches between swing and stance when the heel load is
sensed. The regulator then needs dead time, lag and, for the fall of the tension after heel contact,
0.3 s at its rate limit. Here the nominal pressure is that at which a setpoint takes effect, one
dead time ahead. From there on, the path of the pressure is the best one within the rate limit
(:mod:`baselines.predictive.rate_limited`; in a gait :mod:`baselines.knee.pushed_path`), with a
small weight in swing, where the tension is not tracked. Heel contact and toe-off are those of the
plan, shifted by the wearer's phase (:mod:`baselines.knee.plan`), and therefore anticipated. While
stance is sensed, toe-off is planned 20 ms later, because an early switch costs more than a late
one.

A planned sample is in stance where it differs from the tension of zero torque at the planned angle.
In swing both are equal but for a constant offset, which is observed there.

The torque of a gait's plan is that of the wearer but for a difference, which is predicted from the
sensed ones (:mod:`baselines.knee.torque_ahead`). The tension that gives it depends on the angle,
which is the plan's, moved by the deviation of the wearer's knee under the assistance
(:mod:`baselines.knee.wearer`) and by a filtered difference.

The adaptive form also estimates the regulator, as the best of a bank of models, and the gain of the
muscle, as the ratio of the mean products of sensed and nominal tension over a fading memory. With
an exact model both keep their nominal values. Without it, measurements still correct the phase, the
wearer's deviation and the planned torque, but not the tension itself.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import (
    Prediction,
    Reader,
    RowController,
    Rows,
    encode_action,
    preview_names,
    reader,
)
from baselines.core.entry import KNEE, Entry, Spec
from baselines.knee.nominal import KneeObserver, KneeView, make_knee_observer
from baselines.knee.plan import SCALES, PhaseFilter, Plan
from baselines.knee.pushed_path import Push, pushed_path
from baselines.knee.stride import NominalStride
from baselines.knee.torque_ahead import PAST, TorqueAhead
from baselines.knee.wearer import WearerModel
from baselines.predictive.preview import PreviewMemory
from baselines.predictive.rate_limited import best_path
from baselines.predictive.regulator import Arrival, BankState, RegulatorBank
from pam_envs.arrays import Array
from pam_envs.hysteresis.protocol import RowsState
from pam_envs.kernels.build import entry
from pam_envs.parameters import Signal
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis

SWING = 0.001
"""Weight of a squared tension error in swing, which is not tracked, relative to stance."""
UNKNOWN = 0.3
"""Weight of samples of an aperiodic reference beyond its preview."""
BLOCKS = (1,) * 8 + (2,) * 6 + (4,) * 10
"""Control periods between the nodes of the horizon: 0.6 s."""
ANGLE_NOISE = 0.005
"""Difference [rad] of the path from the plan."""
STANCE_NOISE = 0.02
"""Difference [rad] of the sensed angle in stance, less the predicted deviation, from the plan."""
TORQUE_NOISE = 0.4
"""Difference [N m] of the torque in stance from the plan."""
USUAL_STRETCH = 0.05
"""Stretch [m] whose errors of the tension have the weight 1."""
KEPT = 300.0
"""Time constant [periods] for which the plan keeps its distance from the nominal stride."""
FILTERED = 0.5
"""Share of a difference of the angle that is attributed to the path in a period."""
YIELDING = np.array([0.001, 0.03])
"""Weights [rad2] of the nominal deviation in swing and in stance, against those that are sensed."""
LIGHT = 0.05
"""Load on the leg [1] below which it counts as none."""
MISMATCH = 0.1
"""Likelihood that the plan is in stance and the wearer not, or the reverse, at the right shift."""
SPREAD = 0.5**0.5
"""Standard deviation of a stride's beginning over that of durations."""
EARLY = 0.5
"""Time [periods] before the first sample of a stance from which a node counts as in stance."""
LATE = 2.0
"""Time [periods] after the last sample of a stance up to which a node counts as in stance, while
stance is sensed."""
RIVAL = 1.0
"""Distance [N m] of the torque in swing from the nominal stride beyond which it counts as none."""
FARTHEST = 0.3
"""Largest predicted deviation of the knee [rad]; about the largest that an episode may have."""
BESIDE = 0.01
"""Difference of the angle [rad] from which slopes are computed."""
ENDS = np.cumsum(BLOCKS).astype(float)
"""Nodes of the horizon [periods] from when a setpoint takes effect."""
MEMORY = 200.0
"""Time constant [periods] of the moments that give the gain."""
USUAL = MEMORY * 100.0**2
"""Moments [N2] of the nominal gain at the start."""
SMALLEST = 0.5
"""Difference [N] from zero torque that counts as stance."""


Correction = Callable[[Array], Array]
"""From times of the plan [control periods], (n_env, n_times), to tensions [N]."""
Inverse = Callable[[Array, RowsState], Array]
"""From stiffnesses [N/m], (n_env, n_nodes), and the state of the hysteresis when a setpoint takes
effect, to pressures [Pa]."""


class Demand(NamedTuple):
    """What is demanded at the nodes of a gait, each of shape (n_env, n_nodes).

    ``torque`` is that in stance [N m], to which ``correction`` adds a tension [N].
    """

    stance: Rows
    torque: Array
    correction: Array


class Held(NamedTuple):
    """Nominal muscle under the pressures until a setpoint of now takes effect.

    ``stiffness`` is that at the ends of the stages [N/m], shape (n_env, n_stages); ``hysteresis``
    is the state after them.
    """

    stiffness: Array
    hysteresis: RowsState


class Course(NamedTuple):
    """Plan of a gait at the times that a period needs.

    Samples have the shape (n_env, 2, n_times): ``samples`` at the nodes, ``soon`` at ``EARLY``
    after them, ``whole`` at every control period from the last one on.

    The others, shape (n_env, n_times), say what is in stance: ``whole_stance`` those periods,
    ``stance`` the nodes, ``begins`` the times ``EARLY`` after them, ``ended`` those ``LATE`` before
    them, ``past`` the last control periods, the newest first. All but the first require it of the
    planned samples on both sides.
    """

    samples: Array
    soon: Array
    whole: Array
    whole_stance: Rows
    stance: Rows
    begins: Rows
    ended: Rows
    past: Rows


class AnticipationState(NamedTuple):
    """States of regulator, hysteresis and plan, offset of the reference in swing [N], and moments.

    ``moments``, shape (n_env, 2), are the sums of squares of the nominal tension, and of its
    product with the sensed one [N2]. ``wearer``, shape (n_env, 3), are the deviation of the knee
    [rad], its rate [rad/s], and the difference of the path from the plan [rad]. ``yielding``, shape
    (n_env, 2, 2), in swing and in stance, are the sums of squares of the deviation, and of its
    product with the sensed one [rad2]. ``torque``, shape (n_env, n_nodes), are the torques of the
    brace [N m] that were planned in the last period, and ``place``, shape (n_env,), is the present
    in the nominal stride [control periods]. ``past``, shape (n_env, n_past), are the last torque
    references [N m], the newest first.
    """

    bank: BankState
    hysteresis: RowsState
    plan: Plan
    offset: Array
    moments: Array
    wearer: Array
    yielding: Array
    torque: Array
    place: Array
    past: Array


@dataclass(frozen=True)
class KneeAnticipation(RowController):
    """Anticipating inverse; see the module.

    Attributes
    ----------
    observer : KneeObserver
        Reader of the signals, and the nominal orthosis.
    phase : PhaseFilter
        Previewed stride, and the wearer's shift in it.
    channels : tuple of Reader
        Readers of the previewed reference, and of the previewed angle with a gait.
    torque : Reader, optional
        Reader of the torque reference of a gait, and of the ground force.
    pressure : Reader
        Reader of the sensed pressure.
    bank : RegulatorBank
        Candidates of the regulator, or the nominal one.
    stride : NominalStride, optional
        Nominal stride of a gait.
    adaptive : bool
        Whether regulator and gain are estimated.
    """

    observer: KneeObserver
    phase: PhaseFilter
    channels: tuple[Reader, ...]
    torque: Reader | None
    pressure: Reader
    bank: RegulatorBank
    stride: NominalStride | None
    adaptive: bool
    action_signal: Signal

    def initial_state(self, observation: ArrayLike) -> AnticipationState:
        """Return the state at rest under the present setpoint."""
        view, plan = self.observer.read(observation), self.phase.start(self._samples(observation))
        torque = self.observer.nominal.plant.lever.torque(view.tension, view.angle)
        return AnticipationState(
            self.bank.start(view.set_point),
            self.observer.nominal.inflated(view.set_point),
            plan,
            np.zeros_like(view.set_point),
            np.full((len(view.set_point), 2), USUAL),
            np.zeros((len(view.set_point), 3)),
            np.tile(YIELDING[:, None], (len(view.set_point), 1, 2)),
            np.repeat(torque[:, None], len(ENDS), axis=1),
            np.zeros(len(view.set_point)),
            np.zeros((len(view.set_point), PAST)),
        )

    def respond(self, observation: ArrayLike, state: AnticipationState) -> Prediction:
        """Return the action and the next state."""
        return self.answer(observation, self.observed(observation, state))

    def answer(
        self,
        observation: ArrayLike,
        now: AnticipationState,
        more: Correction | None = None,
        inverse: Inverse | None = None,
    ) -> Prediction:
        """Return the action and the next state after :meth:`observed`.

        ``more`` returns a correction [N] of the tension in stance at times of the plan;
        ``inverse`` replaces that of the nominal muscle with the estimated gain.
        """
        view, signal = self.observer.read(observation), self.action_signal
        arrival = self.bank.arrival(now.bank)
        nominal, ends = self.observer.nominal, arrival.delay[:, None] + ENDS
        pressures = inverse or partial(self._inverse, now.moments)
        reach = (arrival.rate * self.bank.period)[:, None] * np.array(BLOCKS, float)
        start = arrival.pressures[-1]
        if self.observer.gait:
            course, held = self._course(now, ends), self._held(now, arrival)
            angle, response = self._angles_ahead(observation, now, arrival, ends, course, held)
            demand = self._demand(view, now, ends, course, more)
            angles = angle + BESIDE * np.array([0.0, -1.0, 1.0])[:, None, None]
            stiffness, weight = self._stiffness(demand, angles), self._weight(demand, angle)
            path = pressures(stiffness[0], held.hysteresis)
            slope = nominal.per_stiffness * now.moments[:, :1] / now.moments[:, 1:]
            push, full = self._push(now, ends, angles, stiffness, slope), nominal.full_pressure
            best, off = pushed_path(start, path, weight, reach, push, response, full)
            reached, angle = stiffness[0] + (best - path) / slope, angle + _near(off)
            torque = self._torque(np.clip(reached, 0.0, full / slope), angle)
            now = now._replace(torque=torque)
        else:
            demanded, weight = self._demand_of_brace(now, ends)
            later = nominal.along(arrival.pressures, now.hysteresis)
            best = best_path(start, pressures(demanded, later), weight, reach)
        command = arrival.set_point(best[:, 0], self.bank.period)
        command = np.minimum(np.maximum(command, signal.low), signal.high)
        after = now._replace(bank=self.bank.advance(now.bank, command))
        return encode_action(signal, command, observation), after

    def _torque(self, stiffness: Array, angle: Array) -> Array:
        """Return the torques [N m] of a muscle of stiffnesses [N/m] at angles [rad]."""
        tension = np.maximum(stiffness, 0.0) * self.observer.nominal.stretch(angle)
        return self.observer.nominal.plant.lever.torque(tension, angle)

    def _push(
        self, now: AnticipationState, ends: Array, angles: Array, stiffness: Array, slope: Array
    ) -> Push:
        """Return the linear model of the pushed knee at predicted angles.

        Parameters
        ----------
        now, ends
            State, and the nodes [control periods], shape (n_env, n_nodes).
        angles, stiffness : ndarray, shape (3, n_env, n_nodes)
            Predicted angles [rad], those less and those more, and the stiffnesses demanded there
            [N/m].
        slope : ndarray, shape (n_env, 1)
            Pressure over stiffness [Pa m/N].
        """
        nominal, lever, wide = self.observer.nominal, self.observer.nominal.plant.lever, 2 * BESIDE
        here, less, more = self._torque(stiffness[0], angles)
        return Push(
            excess=here - _planned_torque(now, ends, ends),
            per_pressure=nominal.stretch(angles[0]) * lever.lever_arm(angles[0]) / slope,
            per_angle=(more - less) / wide,
            pressure_per_angle=(stiffness[2] - stiffness[1]) / wide * slope,
        )

    def _held(self, now: AnticipationState, arrival: Arrival) -> Held:
        """Return stiffnesses and hysteresis until a setpoint of now takes effect."""
        stiffness, hysteresis = np.empty(arrival.pressures.T.shape), now.hysteresis
        for k, pressure in enumerate(arrival.pressures):
            stiffness[:, k], hysteresis = self.observer.nominal.forward(pressure, hysteresis)
        return Held(stiffness, hysteresis)

    def _inverse(self, moments: Array, stiffness: Array, later: RowsState) -> Array:
        """Return the pressures [Pa] of stiffnesses [N/m] for the gain of the moments."""
        return self.pressures(stiffness * (moments[:, 0] / moments[:, 1])[:, None], later)

    def pressures(self, stiffness: Array, later: RowsState) -> Array:
        """Return the nominal muscle's pressures [Pa] of stiffnesses [N/m], (n_env, n_nodes)."""
        held = tuple(np.repeat(part, stiffness.shape[1], axis=0) for part in later)
        found = self.observer.nominal.pressure_for(stiffness.ravel(), held)
        return found.reshape(stiffness.shape)

    def _samples(self, observation: ArrayLike) -> Array:
        """Return the previewed channels, shape (n_env, n_channels, n_samples)."""
        return np.array([r.rows(observation).T for r in self.channels]).swapaxes(0, 1)

    def observed(self, observation: ArrayLike, state: AnticipationState) -> AnticipationState:
        """Return the state with what an observation shows of plan, wearer and plant."""
        view = self.observer.read(observation)
        nominal, bank, moments = self.observer.nominal, state.bank, state.moments
        if self.adaptive:
            bank = self.bank.observe(bank, self.pressure.rows(observation)[0])
        pressure = self.bank.now(bank)
        hysteresis = nominal.advance(pressure, state.hysteresis)
        if self.adaptive:
            stiffness = nominal.stiffness_after(pressure, hysteresis)
            expected = np.maximum(stiffness, 0.0) * view.stretch
            products = expected[:, None] * np.stack([expected, view.tension], axis=1)
            moments = (1.0 - 1.0 / MEMORY) * moments + products
            moments = np.clip(moments, moments[:, :1] / 2.0, moments[:, :1] * 2.0)
        plan = self.phase.add(state.plan, self._samples(observation))
        place = self._place(plan, state.place + 1.0)
        now = state._replace(
            bank=bank, hysteresis=hysteresis, plan=plan, moments=moments, place=place
        )
        if self.torque is None:
            return now
        torque = self.torque.rows(observation)[0][:, None]
        now = now._replace(past=np.concatenate([torque, now.past[:, :-1]], axis=1))
        plan = self.phase.follow(plan, partial(self._likelihood, view, observation, now))
        now = self._pushed(view, observation, now._replace(plan=plan))
        free = nominal.free_tension(view.angle)
        swing = ~view.stance & (free > SMALLEST)
        offset = np.where(swing, view.reference - free, state.offset)
        return now._replace(offset=offset)

    @cached_property
    def _leg(self) -> WearerModel:
        return WearerModel(self.observer.nominal.plant)

    def _pushed(
        self, view: KneeView, observation: ArrayLike, now: AnticipationState
    ) -> AnticipationState:
        """Return the state with the wearer's deviation under the sensed tension.

        In swing the wearer's path is given, so that his deviation is sensed.
        """
        assert self.torque is not None
        lever, ground = self.observer.nominal.plant.lever, self.torque.rows(observation)[1]
        path = self.phase.read(now.plan, np.tile([-1.0, 0.0, 1.0], (len(view.angle), 1)))[0][:, 1]
        torque = lever.torque(view.tension, view.angle)[:, None] + self._leg.passive(path)
        load = self._leg.load(ground)[:, None]
        off, rate = self._leg.along(now.wearer[:, :2], torque, load)[:, 1].T
        sensed = view.angle - np.where(view.stance, path[:, 1], view.angle_reference)
        phase = np.stack([~view.stance, view.stance], axis=1)
        products = np.stack([off, sensed], axis=1) * off[:, None]
        yielding = now.yielding + np.where(phase[..., None], products[:, None], 0.0)
        yielding[..., 1] = np.clip(yielding[..., 1], 0.5 * yielding[..., 0], 2.0 * yielding[..., 0])
        ratio = _yielded(yielding)
        scaled = np.where(view.stance, ratio[:, 1], ratio[:, 0]) * off
        differs = view.angle - path[:, 1] - scaled
        differs = now.wearer[:, 2] + FILTERED * (differs - now.wearer[:, 2])
        return now._replace(wearer=np.stack([off, rate, differs], axis=1), yielding=yielding)

    def _angles_ahead(
        self, observation: ArrayLike, now: AnticipationState, arrival: Arrival, ends: Array,
        course: Course, held: Held,
    ) -> tuple[Array, Array]:  # fmt: skip
        """Return the predicted angles [rad] at the nodes of a gait, (n_env, n_nodes).

        The second array is their response to torques at the nodes (:mod:`baselines.knee.wearer`).
        Until a setpoint of now takes effect the torque is that of the nominal muscle under the
        pressures to come; afterwards that of the path planned in the last period.
        """
        nominal, path = self.observer.nominal, course.whole[:, 1]
        lever, last = nominal.plant.lever, path.shape[1] - 3
        here = now.wearer[:, [0, 2]].sum(axis=1)[:, None]
        halves = np.arange(last) + 0.5
        torque = _planned_torque(now, ends, np.tile(halves, (len(ends), 1)))
        stages = held.stiffness.shape[1]
        middle = (0.5 * (path[:, 1:-2] + path[:, 2:-1]) + here)[:, :stages]
        gain = (now.moments[:, 1] / now.moments[:, 0])[:, None]
        tension = gain * np.maximum(held.stiffness, 0.0) * nominal.stretch(middle)
        given, early = lever.torque(tension, middle), halves[:stages] < arrival.delay[:, None]
        torque[:, :stages] = np.where(early, given, torque[:, :stages])
        torque = torque + self._leg.passive(path)[:, :last]
        load = self._loads_ahead(observation, now, halves)
        along = self._leg.along(now.wearer[:, :2], torque, load)[..., 0]
        ratio = _yielded(now.yielding)
        scale = np.where(course.whole_stance[:, 1:-1], ratio[:, 1:], ratio[:, :1])
        response = self._leg.response(load, scale, ends, arrival.delay)
        along = along * scale
        whole = np.floor(ends).astype(np.int64)
        low = np.take_along_axis(along, whole, axis=1)
        high = np.take_along_axis(along, whole + 1, axis=1)
        off = low + (ends - whole) * (high - low) + now.wearer[:, 2:]
        return course.samples[:, 1] + _near(off), response

    def _loads_ahead(self, observation: ArrayLike, now: AnticipationState, times: Array) -> Array:
        """Return the loads on the leg [1] after periods, (n_env, n_times).

        They are those of the nominal stride, in proportion to the sensed load until it ends.
        """
        assert self.torque is not None and self.stride is not None
        sensed = self._leg.load(self.torque.rows(observation)[1])
        here = _point(now)
        present = self.stride.load(here)
        load = self.stride.load(here[:, None] + times)
        both = (sensed > LIGHT) & (present > LIGHT)
        ratio = np.clip(sensed / np.maximum(present, LIGHT), 0.5, 2.0)
        same = np.logical_and.accumulate(load > LIGHT, axis=1)
        return np.where(both[:, None] & same, ratio[:, None] * load, load)

    def _likelihood(
        self, view: KneeView, observation: ArrayLike, now: AnticipationState, samples: Array
    ) -> Array:
        """Return the likelihood of an observation for planned samples."""
        assert self.torque is not None
        tension, angle = samples[:, 0], samples[:, 1]
        planned, stance = self._in_stance(tension, angle, now), view.stance[:, None]
        torque = self.observer.nominal.plant.lever.torque(tension, angle)
        given = self.torque.rows(observation)[0][:, None, None]
        off = (given - SCALES[:, None] * torque[:, None]) / TORQUE_NOISE
        path = ((view.angle_reference[:, None] - angle) / ANGLE_NOISE)[:, None]
        pushed = _yielded(now.yielding)[:, 1] * now.wearer[:, 0]  # in the last period
        held = (view.angle - pushed)[:, None] - angle
        held = (held / STANCE_NOISE)[:, None]
        fit = np.exp(-0.5 * np.where(stance[..., None], off**2 + held**2, path**2))
        sure = np.where(stance, MISMATCH, MISMATCH * fit[:, 0])[:, None]
        slack = self.observer.nominal.free_tension(angle) <= SMALLEST
        return np.where(((planned | (stance & slack)) == stance)[:, None], fit, sure)

    def _demand_of_brace(self, now: AnticipationState, ends: Array) -> tuple[Array, Array]:
        """Return stiffnesses [N/m] of the brace alone at the nodes, and the weights of errors."""
        samples, known = self.phase.read(now.plan, ends)
        weight = np.where(known, 1.0, UNKNOWN) * np.array(BLOCKS, float)
        return self._brace_stiffness(now, ends, samples[:, 0]), weight

    def _demand(
        self, view: KneeView, now: AnticipationState, ends: Array, course: Course,
        more: Correction | None,
    ) -> Demand:  # fmt: skip
        """Return what is demanded at the nodes of a gait.

        The nodes up to ``EARLY`` before heel contact are those of the stance that begins. Those up
        to ``LATE`` after toe-off are in stance while stance is sensed, with the nominal stride's
        torque.
        """
        assert self.stride is not None
        nominal, place = self.observer.nominal, _point(now)[:, None]
        soon = course.begins & ~course.stance
        samples = np.where(soon[:, None], course.soon, course.samples)
        torque = nominal.plant.lever.torque(samples[:, 0], samples[:, 1])
        late = course.ended & view.stance[:, None] & ~(course.stance | soon)
        torque = np.where(late, self.stride.torque(place + ends), torque)
        torque = torque + self._excess_ahead(now, ends, course.past)
        slack = (nominal.free_tension(samples[:, 1]) <= SMALLEST) & (samples[:, 0] <= SMALLEST)
        stance = course.stance | late | soon
        stance = stance | (slack & self.stride.in_stance(place + ends))
        correction = np.zeros_like(ends)
        if more is not None:
            correction = more(self.phase.present(now.plan)[:, None] + ends)
        return Demand(stance, torque, correction)

    def _excess_ahead(self, now: AnticipationState, ends: Array, past: Rows) -> Array:
        """Return the distances [N m] of the torque from the plan at the nodes.

        ``past`` is that of the course. In swing, where the plan has no torque, the distance is that
        from the nominal stride.
        """
        assert self.stride is not None
        plan, back = now.plan, np.arange(PAST)
        times = np.tile(-back.astype(float), (len(ends), 1))
        samples, known = self.phase.read(plan, times)
        planned = self.observer.nominal.plant.lever.torque(samples[:, 0], samples[:, 1])
        swing = now.past - self.stride.torque(_point(now)[:, None] + times)
        swing = np.where(np.abs(swing) < RIVAL, swing, 0.0)
        excess = np.where(known & past, now.past - planned, swing)
        first = np.minimum(back, plan.seen.step[:, None])  # nothing was sensed before the start
        return self._predictor.predict(np.take_along_axis(excess, first, axis=1), ends)

    @cached_property
    def _predictor(self) -> TorqueAhead:
        farthest = np.max(self.bank.dead_time) / self.bank.period + ENDS[-1]
        return TorqueAhead(math.ceil(farthest) + 1)

    def _stiffness(self, demand: Demand, angle: Array) -> Array:
        """Return the demanded stiffnesses [N/m] at angles [rad], shapes (..., n_env, n_nodes)."""
        nominal = self.observer.nominal
        tension = nominal.plant.lever.tension(demand.torque, angle) + demand.correction
        demanded = np.where(demand.stance, np.maximum(tension, 0.0), nominal.free_tension(angle))
        return np.asarray(demanded / nominal.stretch(angle))

    def _weight(self, demand: Demand, angle: Array) -> Array:
        """Return the weights of squared errors of the pressure at the nodes."""
        usual = self.observer.nominal.stretch(angle) / USUAL_STRETCH
        return np.array(BLOCKS, float) * np.where(demand.stance, 1.0, SWING) * usual**2

    def _course(self, now: AnticipationState, ends: Array) -> Course:
        """Return the plan of a gait around nodes, shape (n_env, n_nodes).

        A tension interpolated between stance and swing belongs to neither, hence the samples on
        both sides.
        """
        n, nodes = ends.shape
        whole = np.tile(np.arange(-1.0, math.ceil(ends.max()) + 3.0), (n, 1))
        past = np.tile(-np.arange(PAST, dtype=float), (n, 1))
        present = self.phase.present(now.plan)[:, None]
        sought = np.concatenate([ends, ends + EARLY, ends - LATE, past], axis=1)
        times = self.phase.memory.within(now.plan.seen, present + sought)
        sides = [np.floor(times) - present, np.ceil(times) - present]
        at = np.concatenate([ends, ends + EARLY, whole, *sides], axis=1)
        samples, stance = self._ahead(now, at)
        first, count = 2 * nodes + whole.shape[1], sought.shape[1]
        both = stance[:, first : first + count] & stance[:, first + count :]
        return Course(
            samples[..., :nodes],
            samples[..., nodes : 2 * nodes],
            samples[..., 2 * nodes : first],
            stance[:, 2 * nodes : first],
            *np.split(both, [nodes, 2 * nodes, 3 * nodes], axis=1),
        )

    def _place(self, plan: Plan, before: Array) -> Array:
        """Return the present in the nominal stride; it is sought until that is in the plan."""
        if self.stride is None:
            return before
        memory, step = self.phase.memory, plan.seen.step
        sought = step + memory.ahead[-1] <= self.stride.length
        if not np.any(sought):
            return before
        ahead = memory.ahead[1:] if len(memory.ahead) > 1 else memory.ahead
        seen, _ = memory.read(plan.seen, step[:, None] + ahead.astype(float))
        return self.stride.phase(seen, ahead, sought, before)

    def _ahead(self, now: AnticipationState, ends: Array) -> tuple[Array, Rows]:
        """Return the planned samples after ``ends`` periods, and where they are in stance.

        Unknown ones are those of the nominal stride, whose differences at the end of the preview
        fade.
        """
        assert self.stride is not None
        plan, memory = now.plan, self.phase.memory
        samples, known = self.phase.read(plan, ends)
        if np.all(known):
            return samples, self._in_stance(samples[:, 0], samples[:, 1], now)
        later = self.phase.present(plan)[:, None] + ends - plan.seen.step[:, None]
        last = np.full((len(ends), 1), float(memory.ahead[-1]))
        end, _ = memory.read(plan.seen, plan.seen.step[:, None] + last)
        place, stride = now.place[:, None], self.stride
        point, end_point = stride.nearest(place + later), stride.nearest(place + last)
        nominal, there = stride.samples[:, point], stride.samples[:, end_point]
        fades = np.exp(-np.maximum(later - last, 0.0) / KEPT)
        angle = nominal[1] + (end[:, 1] - there[1]) * fades
        angle = np.where(known, samples[:, 1], angle)
        off = np.where(self._loaded[end_point], end[:, 0] - there[0], 0.0)
        free, offset = self.observer.nominal.free_tension(angle), now.offset[:, None]
        tension = np.where(self._loaded[point], nominal[0] + off * fades, free + offset)
        tension = np.where(known, samples[:, 0], np.maximum(tension, 0.0))
        stance = np.abs(tension - free - offset) > SMALLEST
        return np.stack([tension, angle], axis=1), stance

    @cached_property
    def _loaded(self) -> Rows:
        """Where the samples of the nominal stride are in stance, shape (n_points,)."""
        assert self.stride is not None
        tension, angle = self.stride.samples
        return np.asarray(np.abs(tension - self.observer.nominal.free_tension(angle)) > SMALLEST)

    def _brace_stiffness(self, now: AnticipationState, ends: Array, reference: Array) -> Array:
        """Return stiffnesses [N/m] of the brace alone for previewed references."""
        nominal = self.observer.nominal
        if self.observer.stiffness:
            return np.maximum(reference, 0.0)
        return np.maximum(reference / nominal.stretch(nominal.angle_of(reference)), 0.0)

    def _in_stance(self, tension: Array, angle: Array, now: AnticipationState) -> Rows:
        """Return where planned samples are in stance, shape (n_env, n_times)."""
        free = self.observer.nominal.free_tension(angle)
        return np.asarray(np.abs(tension - free - now.offset[:, None]) > SMALLEST)


def _point(now: AnticipationState) -> Array:
    """Return the wearer's point in the nominal stride [control periods], shape (n_env,)."""
    return np.asarray(now.place + now.plan.shift)


def _yielded(yielding: Array) -> Array:
    """Return the sensed deviation over the nominal one [1], in swing and in stance, (n_env, 2)."""
    return np.asarray(yielding[..., 1] / yielding[..., 0])


def _planned_torque(now: AnticipationState, ends: Array, times: Array) -> Array:
    """Return the torques [N m] planned in the last period at times, (n_env, n_times)."""
    found = np.empty_like(times, order="C")
    between_rows(np.ascontiguousarray(times), ends - 1.0, now.torque, found)
    return found


@entry
def between_rows(times: Array, nodes: Array, values: Array, found: Array) -> None:
    """Write the values at times that increase, linear between nodes, constant beyond them."""
    last = nodes.shape[1] - 1
    for i in range(len(times)):
        k = 0
        for j in range(times.shape[1]):
            time = times[i, j]
            while k < last and nodes[i, k + 1] <= time:
                k += 1
            if time <= nodes[i, 0]:
                found[i, j] = values[i, 0]
            elif k == last:
                found[i, j] = values[i, last]
            else:
                rate = (values[i, k + 1] - values[i, k]) / (nodes[i, k + 1] - nodes[i, k])
                found[i, j] = rate * (time - nodes[i, k]) + values[i, k]


def _near(deviation: Array) -> Array:
    """Return deviations [rad] within the largest one."""
    return np.clip(deviation, -FARTHEST, FARTHEST)


def make_knee_anticipation(spec: Spec[KneeOrthosis], adaptive: bool = False) -> KneeAnticipation:
    """Return the controller; ``adaptive``: whether regulator and gain are estimated."""
    observer, signals, plant = make_knee_observer(spec), spec.signals, spec.plant
    period, gait = plant.control_period, observer.gait
    names = [preview_names("reference", signals)]
    if gait:
        names.append(preview_names("angle_reference", signals))
    ahead = np.array([round(signals[name].ahead / period) for name in names[0]])
    stride = plant.stride.time / period if gait else np.inf
    spread = SPREAD * plant.stride.variability * stride if gait else 0.0
    return KneeAnticipation(
        observer,
        PhaseFilter(PreviewMemory.make(ahead, stride), spread),
        tuple(reader(signals, channel) for channel in names),
        reader(signals, ["torque_reference", "ground_force"]) if gait else None,
        reader(signals, ["pressure"]),
        RegulatorBank.make(plant, adaptive),
        NominalStride(plant) if gait else None,
        adaptive,
        spec.actions["pressure_set_point"],
    )


ANTICIPATION = partial(
    Entry,
    knowledge="nominal model",
    preview=True,
    citation="yeh2010; bertsekas2017; thrun2005; beck2009; wiener1949",
    envs=KNEE,
    plants=(KneeOrthosis,),
)
ENTRIES = {
    "knee_anticipating": ANTICIPATION(
        "inverse along the best rate-limited path to the previewed stride, one dead time ahead",
        make=make_knee_anticipation,
    ),
    "knee_anticipating_adaptive": ANTICIPATION(
        "knee_anticipating, its regulator and gain estimated from sensed pressure and tension",
        make=partial(make_knee_anticipation, adaptive=True),
        feedback=True,
        citation="yeh2010; bertsekas2017; thrun2005; beck2009; wiener1949; magill1965",
    ),
}
