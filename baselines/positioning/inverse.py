"""Feedforward control by the exact inverse of the identified muscle.

    reference, previewed -> inverse static law -> inverse hysteresis -> inverse regulator

The input of the hysteresis is the pressure of the nominal regulator (first-order lag, slew limit)
instead of the commanded one: a pressure that was not reached does not affect the muscle. The
initial state is the simplest history that explains the first measurement of an episode; later
measurements are not used.

Lead. A setpoint affects the contraction after the dead time, the horizon in which the regulator is
driven to its target, and the lag of the mass. With preview, the target is the reference ahead by
this lead, linearly interpolated. Without preview it is the present reference.

Early start. For a step, the regulator at its slew limit takes longer than the lead. The error of
the transition is smallest if half of it precedes the step: a later sample of the preview becomes
the target when the travel time to it exceeds ``EARLY`` times the remaining time.

With feedback (astrom2006, chapter 5), a PID compares the contraction with that of the *nominal*
muscle under the same commands (dead time, regulator, hysteresis and static law, with the lag of the
mass as a delay). A comparison with the reference would make it counteract the dead time, the slew
limit and every early start. With an exact model the PID is at rest; it corrects a wrong history, a
wrong parameter or an undeclared load. (Two degrees of freedom with an internal model.)
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import (
    Prediction,
    Reader,
    RowController,
    encode_action,
    preview_names,
    preview_weights,
    reader,
)
from baselines.core.entry import Bounds, Entry, Spec
from baselines.linear.pid import PID_KNOBS, Gains, PidState, pid_start, pid_step
from baselines.positioning.nominal import LoadedMuscle, Nominal
from baselines.positioning.pid import simc
from pam_envs.arrays import Array
from pam_envs.hysteresis.protocol import RowsState
from pam_envs.parameters import Signal
from pam_envs.plants.single_muscle.plant import SingleMuscle

HORIZON = 0.02
"""Time [s] in which the setpoint would take the nominal pressure to its target."""
EARLY = 1.6
"""Travel time over remaining time at which a step is started. 2 would centre the transition on the
first preview sample after the step; the step itself is up to one preview spacing earlier."""
KNOBS: Bounds = {"horizon": (0.5, 8.0), "lead": (0.5, 4.0), "early": (0.5, 4.0)}


class InverseState(NamedTuple):
    """Nominal pressure and effective pressure [Pa] and hysteresis, one dead time ahead."""

    pressure: Array
    drive: Array
    hysteresis: RowsState


@dataclass(frozen=True)
class Inverse(RowController):
    """Exact inverse of the nominal muscle; see the module.

    The signals read are contraction, setpoint, load, reference and its preview. ``aims``, shape
    (n_aims, n_preview + 1), holds the weights of each target, the nearest first, and ``due`` the
    travel time [s] from which it replaces the earlier ones. The setpoint would take the nominal
    pressure to its target within ``horizon`` [s], above 0; a longer horizon gives a smoother
    setpoint.
    """

    nominal: Nominal
    reader: Reader
    action_signal: Signal
    aims: Array
    due: Array
    horizon: float

    @cached_property
    def lag_gain(self) -> float:
        """Reciprocal of the share of a step that the regulator completes in the horizon."""
        return -1.0 / math.expm1(-self.horizon / self.nominal.plant.regulator.time_constant)

    def initial_state(self, observation: ArrayLike) -> InverseState:
        """Return the state that explains the first measurement."""
        return self.explaining_state(self.reader.rows(observation))

    def respond(self, observation: ArrayLike, now: InverseState) -> Prediction:
        """Return the action and the next state."""
        measured = self.reader.rows(observation)
        set_point = self.feed_forward(measured, now)
        after = self.advance(now, set_point, measured[2])
        return encode_action(self.action_signal, set_point, observation), after

    def explaining_state(self, measured: Array) -> InverseState:
        """Return the state that explains first measurements, rows as in ``reader``."""
        contraction, pressure, load = measured[:3]

        def explained(muscle: LoadedMuscle, x: Array, p: Array) -> tuple[Array, RowsState]:
            hysteresis = muscle.explain(x, p)
            return muscle.advance(p, hysteresis)[0], hysteresis

        return InverseState(pressure, *self.nominal.each(load, explained, contraction, pressure))

    def feed_forward(self, measured: Array, now: InverseState) -> Array:
        """Return the setpoint [Pa], shape (n_env,), for the reference."""
        target = self._target(measured, now)
        set_point = now.pressure + self.lag_gain * (target - now.pressure)
        signal = self.action_signal
        return np.asarray(np.minimum(np.maximum(set_point, signal.low), signal.high))

    def _target(self, measured: Array, now: InverseState) -> Array:
        """Return the target pressure [Pa]: that of the last target that is due."""
        load = measured[2]
        aims = np.add.reduce(self.aims[:, :, None] * measured[3:], axis=1)

        def pressures(muscle: LoadedMuscle, aims: Array, hysteresis: RowsState) -> Array:
            held = tuple(np.repeat(a, aims.shape[1], axis=0) for a in hysteresis)
            return muscle.pressure_for(muscle.drive_for(aims.ravel()), held).reshape(aims.shape)

        target = self.nominal.each(load, pressures, aims.T, now.hysteresis).T
        travel = np.abs(target - now.pressure) / self.nominal.plant.regulator.slew_rate
        due = travel >= self.due[:, None]
        last = len(aims) - 1 - np.argmax(due[::-1], axis=0)
        return np.asarray(target[last, np.arange(len(load))])

    def advance(self, now: InverseState, set_point: Array, load: Array) -> InverseState:
        """Return the nominal muscle's state one control period later."""
        pressure = self.nominal.next_pressure(now.pressure, set_point)
        after = self.nominal.each(load, LoadedMuscle.advance, pressure, now.hysteresis)
        return InverseState(pressure, *after)


def aims_of(times: Sequence[float], lead: float, early: float = EARLY) -> tuple[Array, Array]:
    """Return the targets of :class:`Inverse` and their due times, for samples at times [s]."""
    later = [k for k, time in enumerate(times) if time > lead]
    aims = [preview_weights(times, lead), *np.eye(len(times))[later]]
    return np.array(aims), np.array([0.0, *(early * (times[k] - lead) for k in later)])


def make_inverse(spec: Spec[SingleMuscle], preview: bool = True) -> Inverse:
    """Return the controller; ``preview``: whether the reference is previewed."""
    nominal = Nominal(spec.plant)
    references = preview_names("reference", spec.signals) if preview else ["reference"]
    horizon = spec.knob("horizon") * HORIZON
    delay = spec.plant.regulator.dead_time + horizon + nominal.mechanical_lag
    times = [spec.signals[name].ahead for name in references]
    aims, due = aims_of(times, spec.knob("lead") * delay, spec.knob("early") * EARLY)
    return Inverse(
        nominal,
        reader(spec.signals, ["contraction", "set_point", "load", *references]),
        spec.actions["pressure_set_point"],
        aims,
        due,
        horizon,
    )


INVERSE = partial(
    Entry,
    knowledge="nominal model",
    citation="krejci2001; mayergoyz1991",
    plants=(SingleMuscle,),
)
ENTRIES = {
    "inverse_no_preview": INVERSE(
        "exact inverse of hysteresis, static law and regulator at the present reference",
        make=partial(make_inverse, preview=False),
    ),
    "inverse": INVERSE(
        "exact inverse of hysteresis, static law and regulator, with preview of dead time and lag",
        make=make_inverse,
        preview=True,
        knobs=KNOBS,
    ),
}


PID_INVERSE_KNOBS: Bounds = {**KNOBS, "closed_loop_time": PID_KNOBS["closed_loop_time"]}


class InversePidState(NamedTuple):
    """States of the feedforward and of the PID, and the delayed nominal contraction.

    ``expected``, shape (n_env, n_delay), is the nominal static contraction [m] under the pressures
    of the last periods, newest first.
    """

    inverse: InverseState
    pid: PidState
    expected: Array


@dataclass(frozen=True)
class InversePid(RowController):
    """Feedforward and PID; see the module."""

    inverse: Inverse
    gains: Gains

    @cached_property
    def delay(self) -> tuple[int, float]:
        """Delay from the model's pressure to the contraction: whole and fractional periods."""
        nominal = self.inverse.nominal
        plant = nominal.plant
        age = (plant.regulator.dead_time + nominal.mechanical_lag) / plant.control_period
        return int(age), age - int(age)

    def initial_state(self, observation: ArrayLike) -> InversePidState:
        """Return the state that explains the first measurement."""
        measured = self.inverse.reader.rows(observation)
        inverse = self.inverse.explaining_state(measured)
        expected = self._at_rest(inverse, measured[2])
        return InversePidState(
            inverse,
            pid_start(np.zeros_like(expected), measured[0] - expected),
            np.repeat(expected[:, None], self.delay[0] + 2, axis=1),
        )

    def respond(self, observation: ArrayLike, now: InversePidState) -> Prediction:
        """Return the action and the next state."""
        measured = self.inverse.reader.rows(observation)
        contraction, load = measured[0], measured[2]
        forward = self.inverse.feed_forward(measured, now.inverse)
        whole, part = self.delay
        expected = (1.0 - part) * now.expected[:, whole] + part * now.expected[:, whole + 1]
        signal, period = self.inverse.action_signal, self.inverse.nominal.plant.control_period
        error, low, high = expected - contraction, signal.low - forward, signal.high - forward
        correction, pid = pid_step(self.gains, now.pid, error, -error, low, high, period)
        inverse = self.inverse.advance(now.inverse, forward, load)
        newest = self._at_rest(inverse, load)[:, None]
        after = InversePidState(inverse, pid, np.hstack([newest, now.expected[:, :-1]]))
        return encode_action(signal, forward + correction, observation), after

    def _at_rest(self, state: InverseState, load: Array) -> Array:
        """Return the nominal contraction at rest [m], shape (n_env,)."""
        nominal = self.inverse.nominal
        return np.asarray(nominal.each(load, LoadedMuscle.contraction_at, state.drive))


def make_inverse_pid(spec: Spec[SingleMuscle], preview: bool = True) -> InversePid:
    """Return the controller; see :func:`~baselines.positioning.inverse.make_inverse`."""
    return InversePid(make_inverse(spec, preview), simc(spec.plant, knobs=spec.knobs))


INVERSE_PID = partial(INVERSE, feedback=True, citation="krejci2001; mayergoyz1991; skogestad2003")
ENTRIES |= {
    "inverse_pid_no_preview": INVERSE_PID(
        "inverse_no_preview, and a PID on the deviation from the nominal muscle",
        make=partial(make_inverse_pid, preview=False),
    ),
    "inverse_pid": INVERSE_PID(
        "inverse, and a PID on the deviation from the nominal muscle",
        make=make_inverse_pid,
        preview=True,
        knobs=PID_INVERSE_KNOBS,
    ),
}
