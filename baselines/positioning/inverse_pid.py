"""Inverse feedforward with a PID on the deviation from the nominal model (astrom2006, chapter 5).

The PID compares the contraction with that of the *nominal* muscle under the same commands (dead
time, regulator, hysteresis and static law, with the lag of the mass as a delay). A comparison with
the reference would make it counteract the dead time, the slew limit and every early start. With an
exact model the PID is at rest; it corrects a wrong history, a wrong parameter or an undeclared
load. (Two degrees of freedom with an internal model.)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Array, Prediction, RowController, encode_action
from baselines.core.entry import Bounds, Spec
from baselines.linear.pid import PID_KNOBS, Gains, PidState, pid_start, pid_step
from baselines.positioning.inverse import INVERSE, Inverse, InverseState, make_inverse
from baselines.positioning.inverse import KNOBS as INVERSE_KNOBS
from baselines.positioning.nominal import LoadedMuscle
from baselines.positioning.pid import simc
from pam_envs.plants.single_muscle.plant import SingleMuscle

KNOBS: Bounds = {**INVERSE_KNOBS, "closed_loop_time": PID_KNOBS["closed_loop_time"]}


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
    def _delay(self) -> tuple[int, float]:
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
            np.repeat(expected[:, None], self._delay[0] + 2, axis=1),
        )

    def respond(self, observation: ArrayLike, now: InversePidState) -> Prediction:
        """Return the action and the next state."""
        measured = self.inverse.reader.rows(observation)
        contraction, load = measured[0], measured[2]
        forward = self.inverse.feed_forward(measured, now.inverse)
        whole, part = self._delay
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
ENTRIES = {
    "inverse_pid_no_preview": INVERSE_PID(
        "inverse_no_preview, and a PID on the deviation from the nominal muscle",
        make=partial(make_inverse_pid, preview=False),
    ),
    "inverse_pid": INVERSE_PID(
        "inverse, and a PID on the deviation from the nominal muscle",
        make=make_inverse_pid,
        preview=True,
        knobs=KNOBS,
    ),
}
