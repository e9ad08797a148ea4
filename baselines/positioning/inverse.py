"""Feedforward control by the exact inverse of the identified muscle.

    reference, previewed -> inverse static law -> inverse hysteresis -> inverse regulator

The hysteresis is driven by the pressures of the nominal regulator (first-order lag, slew limit)
instead of the commanded ones: a pressure that was not reached leaves no trace in the muscle. Its
initial state is the simplest history that explains the first measurement of an episode; later
measurements are not used.

Lead. A set-point acts on the contraction after the dead time, the horizon in which the regulator
is driven to its target, and the lag of the mass. With preview, the target is the reference later by
this lead, linearly interpolated. Without preview it is the present reference.

Early start. For a step, the regulator at its slew limit takes longer than the lead. The error of
the transition is least when half of it precedes the step: a later sample of the preview becomes the
target when the travel time to it exceeds ``EARLY`` times the remaining time.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import (
    Array,
    Prediction,
    Reader,
    RowController,
    encode_action,
    preview_names,
    reader,
)
from baselines.core.entry import Entry
from baselines.core.knobs import AS_DESIGNED, Bounds, Knobs, knob
from baselines.positioning.nominal import HysteresisState, Nominal
from pam_envs.parameters import Signal, Signals
from pam_envs.plants.single_muscle.plant import SingleMuscle

HORIZON = 0.02
"""Time [s] in which the set-point would take the nominal pressure to its target."""
EARLY = 1.6
"""Travel time over remaining time at which a step is started. 2 would centre the transition on a
step at the first sample that shows it; the step is up to a preview spacing before."""
KNOBS: Bounds = {"horizon": (0.5, 4.0), "lead": (0.5, 2.0), "early": (0.5, 2.0)}


class InverseState(NamedTuple):
    """State of the nominal muscle.

    Attributes
    ----------
    pressure : ndarray, shape (n_env,)
        Nominal pressure [Pa] one dead time later.
    drive : ndarray, shape (n_env,)
        Nominal effective pressure [Pa] then.
    hysteresis : tuple of ndarray, first axis n_env
        Nominal hysteresis then.
    """

    pressure: Array
    drive: Array
    hysteresis: HysteresisState


def preview_weights(samples: int, spacing: float, lead: float) -> Array:
    """Return weights of the reference and its preview that give the reference at a later time.

    Parameters
    ----------
    samples : int
        Number of preview samples; 0 gives the weight 1 for the present reference.
    spacing : float
        Time [s] between them; linear interpolation.
    lead : float
        The later time [s]; clipped to the preview horizon.

    Returns
    -------
    ndarray, shape (samples + 1,)
        They add up to 1.
    """
    nodes = spacing * np.arange(samples + 1)
    return np.array([np.interp(lead, nodes, row) for row in np.eye(samples + 1)])


@dataclass(frozen=True)
class Inverse(RowController):
    """Exact inverse of the nominal muscle; see the module.

    Attributes
    ----------
    nominal : Nominal
    reader : Reader
        Of contraction, set-point, load, reference and its preview.
    action_signal : Signal
    aims : ndarray, shape (n_aims, n_preview + 1)
        Weights of reference and preview of each target, the nearest first.
    due : ndarray, shape (n_aims,)
        Travel time [s] from which a target replaces the earlier ones.
    horizon : float
        Time [s], above 0, in which the set-point would take the nominal pressure to its
        target: the regulator's inverse. A longer horizon smooths the set-point.
    """

    nominal: Nominal
    reader: Reader
    action_signal: Signal
    aims: Array
    due: Array
    horizon: float = HORIZON

    @cached_property
    def _lag_gain(self) -> float:
        return 1.0 / self.nominal.arrival(self.horizon)

    def initial_state(self, observation: ArrayLike) -> InverseState:
        """See :class:`~baselines.core.controller.RowController`."""
        return self.explaining_state(self.reader.rows(observation))

    def respond(self, observation: ArrayLike, now: InverseState) -> Prediction:
        """See :class:`~baselines.core.controller.RowController`."""
        measured = self.reader.rows(observation)
        set_point = self.feed_forward(measured, now)
        after = self.advance(now, set_point, measured[2])
        return encode_action(self.action_signal, set_point, observation), after

    def explaining_state(self, measured: Array) -> InverseState:
        """Return the state that explains first measurements, rows as in ``reader``."""
        contraction, pressure, load = measured[:3]
        hysteresis: Any = None
        for muscle, rows in self.nominal.groups(load):
            part = muscle.explain(contraction[rows], pressure[rows])
            hysteresis = _placed(hysteresis, part, rows, len(load))
        drive = np.empty(len(load))
        for muscle, rows in self.nominal.groups(load):
            drive[rows] = muscle.advance(pressure[rows], _taken(hysteresis, rows))[0]
        return InverseState(pressure, drive, hysteresis)

    def feed_forward(self, measured: Array, now: InverseState) -> Array:
        """Return the set-point [Pa], shape (n_env,), for the reference."""
        target = self._target(measured, now)
        set_point = now.pressure + self._lag_gain * (target - now.pressure)
        signal = self.action_signal
        return np.asarray(np.minimum(np.maximum(set_point, signal.low), signal.high))

    def _target(self, measured: Array, now: InverseState) -> Array:
        """Return the target pressure [Pa]: that of the last target that is due."""
        load = measured[2]
        aims = np.add.reduce(self.aims[:, :, None] * measured[3:], axis=1)
        target = np.empty_like(aims)
        for muscle, rows in self.nominal.groups(load):
            drive = muscle.drive_for(aims[:, rows]).ravel()
            hysteresis = tuple(
                np.concatenate([a] * len(aims)) for a in _taken(now.hysteresis, rows)
            )
            target[:, rows] = muscle.pressure_for(drive, hysteresis).reshape(len(aims), -1)
        travel = np.abs(target - now.pressure) / self.nominal.plant.regulator.slew_rate
        due = travel >= self.due[:, None]
        last = len(aims) - 1 - np.argmax(due[::-1], axis=0)
        return np.asarray(target[last, np.arange(len(load))])

    def advance(self, now: InverseState, set_point: Array, load: Array) -> InverseState:
        """Return the nominal muscle's state one control period on."""
        pressure = self.nominal.next_pressure(now.pressure, set_point)
        drive = np.empty(len(load))
        hysteresis: Any = None
        for muscle, rows in self.nominal.groups(load):
            drive[rows], part = muscle.advance(pressure[rows], _taken(now.hysteresis, rows))
            hysteresis = _placed(hysteresis, part, rows, len(load))
        return InverseState(pressure, drive, hysteresis)


def _taken(hysteresis: HysteresisState, rows: Any) -> HysteresisState:
    return hysteresis if isinstance(rows, slice) else tuple(a[rows] for a in hysteresis)


def _placed(whole: Any, part: HysteresisState, rows: Any, n: int) -> HysteresisState:
    if isinstance(rows, slice):
        return part
    if whole is None:
        whole = tuple(np.empty((n, *a.shape[1:]), a.dtype) for a in part)
    for to, a in zip(whole, part, strict=True):
        to[rows] = a
    return tuple(whole)


def aims_of(samples: int, spacing: float, lead: float, early: float = EARLY) -> tuple[Array, Array]:
    """Return the targets of :class:`Inverse` and their due times, for a preview."""
    aims, due = [preview_weights(samples, spacing, lead)], [0.0]
    for i in range(1, samples + 1):
        left = i * spacing - lead
        if left > 0.0:
            aims.append(np.eye(samples + 1)[i])
            due.append(early * left)
    return np.array(aims), np.array(due)


def make_inverse(
    plant: SingleMuscle,
    signals: Signals,
    action_signals: Signals,
    preview: bool = True,
    horizon: float = HORIZON,
    knobs: Knobs = AS_DESIGNED,
) -> Inverse:
    """Return the controller for a nominal plant.

    Parameters
    ----------
    plant : SingleMuscle
        Nominal plant.
    signals, action_signals : Signals
    preview : bool
        Whether the reference is previewed.
    horizon : float
        See :class:`Inverse`.
    knobs : mapping
        Of ``KNOBS``: factors on the horizon, on the lead, and on ``EARLY``.
    """
    nominal = Nominal(plant)
    references = preview_names("reference", signals) if preview else ["reference"]
    samples = len(references) - 1
    horizon = knob(knobs, "horizon") * horizon
    delay = plant.regulator.dead_time + horizon + nominal.mechanical_lag
    lead, early = knob(knobs, "lead") * delay, knob(knobs, "early") * EARLY
    spacing = signals["reference_1"].ahead if samples else 0.0
    aims, due = aims_of(samples, spacing, lead, early)
    return Inverse(
        nominal,
        reader(signals, ["contraction", "set_point", "load", *references]),
        action_signals["pressure_set_point"],
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
