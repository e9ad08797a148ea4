"""Predictive inverse of the single muscle, with or without a disturbance observer.

    preview -> contractions over the horizon -> inverse static law -> inverse hysteresis
    -> best rate-limited path -> inverse lag -> setpoint, one dead time ahead

This is model predictive control of the nominal muscle, solved by its structure: static law and
hysteresis are inverted exactly at every node of the horizon, and what remains, the pressure of a
regulator with dead time, lag and rate limit, is a bounded least-squares problem with an exact
solution (:mod:`baselines.predictive.rate_limited`). A step of the reference is crossed in its
middle because that is optimal, not by a rule (compare :mod:`baselines.positioning.inverse`).

With an observer, the difference of the sensed contraction from that of the nominal muscle under the
same commands is a disturbance at the output (ohnishi1996, chen2016). Filtered, with time constant
``OBSERVER``, it is subtracted from the reference: the static error vanishes for every static error
of the model, an undeclared load, or a wrong history. The loop has the nominal muscle as internal
model, so that dead time and lag do not excite it. The regulator is then one of a bank
(:mod:`baselines.predictive.regulator`), chosen by the sensed pressure.
"""

import math
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
    reader,
)
from baselines.core.entry import Bounds, Spec
from baselines.positioning.inverse import INVERSE
from baselines.positioning.nominal import LoadedMuscle, Nominal
from baselines.predictive.preview import Preview, PreviewMemory
from baselines.predictive.rate_limited import best_path
from baselines.predictive.regulator import BankState, RegulatorBank
from pam_envs.arrays import Array
from pam_envs.hysteresis.protocol import RowsState
from pam_envs.parameters import Signal
from pam_envs.plants.single_muscle.plant import SingleMuscle

BLOCKS = (1,) * 10 + (2,) * 6 + (4,) * 8
"""Control periods between the nodes of the horizon: 0.54 s."""
ENDS = np.cumsum(BLOCKS).astype(float)
UNKNOWN = 1.0
"""Weight of the last previewed sample, held beyond the preview."""
OBSERVER = 0.2
"""Time constant [s] of the disturbance observer: twice the delay of the nominal muscle."""
KNOBS: Bounds = {"observer": (0.25, 4.0)}


class PredictiveState(NamedTuple):
    """Regulator, hysteresis, preview, nominal contraction behind the mass, and disturbance [m]."""

    bank: BankState
    hysteresis: RowsState
    seen: Preview
    expected: Array
    disturbance: Array


@dataclass(frozen=True)
class PredictiveInverse(RowController):
    """Predictive inverse; see the module.

    ``observer`` is the time constant [s] of the disturbance observer; infinite for none.
    """

    nominal: Nominal
    reader: Reader
    references: Reader
    memory: PreviewMemory
    bank: RegulatorBank
    observer: float
    action_signal: Signal

    @cached_property
    def _lag(self) -> float:
        """Lag of the mass [periods]."""
        return self.nominal.mechanical_lag / self.bank.period

    def initial_state(self, observation: ArrayLike) -> PredictiveState:
        """Return the state that explains the first measurement."""
        contraction, _, set_point, load = self.reader.rows(observation)
        hysteresis = self.nominal.each(load, LoadedMuscle.explain, contraction, set_point)
        felt, _ = self.nominal.each(load, LoadedMuscle.advance, set_point, hysteresis)
        expected = self._contraction(felt, load)
        return PredictiveState(
            self.bank.start(set_point),
            hysteresis,
            self.memory.start(self.references.rows(observation).T[:, None]),
            expected,
            np.zeros_like(expected),
        )

    def respond(self, observation: ArrayLike, state: PredictiveState) -> Prediction:
        """Return the action and the next state."""
        now = self.observed(observation, state)
        command = self.command(observation, now)
        after = now._replace(bank=self.bank.advance(now.bank, command))
        return encode_action(self.action_signal, command, observation), after

    def command(self, observation: ArrayLike, now: PredictiveState) -> Array:
        """Return the setpoints [Pa], shape (n_env,), after :meth:`observed`."""
        load, signal = self.reader.rows(observation)[3], self.action_signal
        arrival = self.bank.arrival(now.bank)
        coming = arrival.pressures.T
        later = self.nominal.each(load, LoadedMuscle.along, coming, now.hysteresis)
        ends = now.seen.step[:, None] + arrival.delay[:, None] + self._lag + ENDS
        samples, known = self.memory.read(now.seen, ends)
        goals = samples[:, 0] - now.disturbance[:, None]
        path = self.nominal.each(load, pressures, goals, later)
        weight = np.where(known, 1.0, UNKNOWN) * np.array(BLOCKS, float)
        reach = (arrival.rate * self.bank.period)[:, None] * np.array(BLOCKS, float)
        following = best_path(arrival.pressures[-1], path, weight, reach)[:, 0]
        command = arrival.set_point(following, self.bank.period)
        return np.asarray(np.minimum(np.maximum(command, signal.low), signal.high))

    def observed(self, observation: ArrayLike, state: PredictiveState) -> PredictiveState:
        """Return the state with what an observation shows of reference and plant."""
        contraction, pressure, _, load = self.reader.rows(observation)
        bank, disturbance = state.bank, state.disturbance
        observes = math.isfinite(self.observer)
        if observes:
            bank = self.bank.observe(bank, pressure)
        held = self.bank.now(bank)
        felt, hysteresis = self.nominal.each(load, LoadedMuscle.advance, held, state.hysteresis)
        rest, expected = self._contraction(felt, load), state.expected
        expected = expected - math.expm1(-1.0 / self._lag) * (rest - expected)
        if observes:
            share = -math.expm1(-self.bank.period / self.observer)
            disturbance = disturbance + share * (contraction - expected - disturbance)
        seen = self.memory.add(state.seen, self.references.rows(observation).T[:, None])
        return PredictiveState(bank, hysteresis, seen, expected, disturbance)

    def _contraction(self, felt: Array, load: Array) -> Array:
        """Return the nominal contraction at rest [m] under effective pressures [Pa], (n_env,)."""
        return np.asarray(self.nominal.each(load, LoadedMuscle.contraction_at, felt))


def pressures(muscle: LoadedMuscle, goals: Array, hysteresis: RowsState) -> Array:
    """Return the pressures [Pa] of contractions [m], shape (n_env, n_nodes), after a history."""
    held = tuple(np.repeat(part, goals.shape[1], axis=0) for part in hysteresis)
    return muscle.pressure_for(muscle.drive_for(goals.ravel()), held).reshape(goals.shape)


def make_predictive(spec: Spec[SingleMuscle], observer: bool = False) -> PredictiveInverse:
    """Return the controller; ``observer``: with disturbance observer and bank of regulators."""
    nominal, names = Nominal(spec.plant), preview_names("reference", spec.signals)
    period = spec.plant.control_period
    ahead = np.array([round(spec.signals[name].ahead / period) for name in names])
    return PredictiveInverse(
        nominal,
        reader(spec.signals, ["contraction", "pressure", "set_point", "load"]),
        reader(spec.signals, names),
        PreviewMemory.make(ahead),
        RegulatorBank.make(spec.plant, adaptive=observer),
        spec.knob("observer") * OBSERVER if observer else math.inf,
        spec.actions["pressure_set_point"],
    )


PREDICTIVE = partial(INVERSE, preview=True, citation="krejci2001; bertsekas2017")
ENTRIES = {
    "predictive_inverse": PREDICTIVE(
        "predictive control of the nominal muscle: exact inverses, best rate-limited path",
        make=make_predictive,
    ),
    "predictive_inverse_dob": PREDICTIVE(
        "predictive_inverse with a disturbance observer and an estimated regulator",
        make=partial(make_predictive, observer=True),
        feedback=True,
        citation="krejci2001; bertsekas2017; ohnishi1996; chen2016; magill1965",
        knobs=KNOBS,
    ),
}
