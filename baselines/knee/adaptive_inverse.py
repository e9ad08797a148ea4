"""Adaptive inverse of the knee with a disturbance observer (ohnishi1996, magill1965).

The anticipating inverse (:mod:`baselines.knee.anticipation`) with the estimated regulator, and with
the hysteresis loop estimated as well. An operator ``H`` with its loop ``w`` times as wide and the
gain ``a`` is linear in ``a`` and ``b = a w``:

    s = a L(p) + b (H(p) - L(p)) + d,    T = s (L_muscle - L_min)

``L`` is the line of the operator's total slope and ``d`` the disturbance [N/m]: what two numbers
do not describe, such as a loop of another form. Recursive least squares with forgetting estimate
``a`` and ``b`` from sensed tension and angle as if ``d`` were 0, all samples with equal weight; a
first-order lag filters the remaining difference to ``d``. The pressure is that of the regulator's
model, so that neither estimate contains a dead time.

The inverse solves ``H(p) = v`` with ``v = (s - d) / a + (1 - b / a) (v - L(p))`` by relaxed fixed
points. The brace alone follows its tension with a lag, here the delay ``c / k`` of its damping and
stiffness; the stretch of a planned tension is that of the angle delayed, moved by the difference of
the sensed angle.

In a gait the regulator is at rest until the first stance, so that nothing shows its rate limit. A
small probe in a first swing, where the tension is not tracked, lets the bank of regulators choose.
"""

import math
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, RowController
from baselines.core.entry import Bounds, Spec
from baselines.knee.anticipation import (
    ANTICIPATION,
    AnticipationState,
    KneeAnticipation,
    make_knee_anticipation,
)
from pam_envs.arrays import Array
from pam_envs.hysteresis.protocol import RowsState
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis

OBSERVER = 0.1
"""Time constant [s] of the disturbance observer."""
MEMORY = 4.0
"""Time constant [s] of the forgetting of old samples."""
BEFORE = np.array([0.01, 0.1, 0.01])
"""Variances and covariance of ``a`` and ``b`` before the first sample: gain 10 %, width 30 %; old
samples are forgotten no further than to these."""
ROUGHNESS = 0.01
"""Standard deviation of a sample's stiffness over that of the full pressure."""
ITERATIONS = 4
"""Fixed points of the inverse. They leave 1 % of the correction for another width where the slope
of the loop is that of the line, and up to 6 % at half that slope and half the width."""
PRESSURE = 0.5e5
"""Height [Pa] of the probe: most regulators reach their rate limit."""
PROBE, PROBED = (5, 20), 6
"""Begin and end [periods] of the probe, and the nodes of the horizon that it moves."""
GAINS, WIDTHS = (0.5, 2.0), (0.5, 1.25)
"""Limits of ``a`` and of the width ``b / a``; a wider loop would have no increasing inverse."""
KNOBS: Bounds = {
    "observer": (0.2, 5.0),
    "memory": (0.2, 20.0),
}


class AdaptiveState(NamedTuple):
    """State of the anticipating inverse, and estimates.

    ``estimate``, shape (n_env, 2), holds ``a`` and ``b`` [1]; ``covariance``, (n_env, 3), their
    variances and covariance; ``disturbance`` is in N/m, shape (n_env,).
    """

    forward: AnticipationState
    estimate: Array
    covariance: Array
    disturbance: Array


@dataclass(frozen=True)
class BendingAnticipation(KneeAnticipation):
    """Anticipating inverse with a bending brace.

    The offset of a brace whose tension is controlled is that of its angle from the plan [rad].

    Attributes
    ----------
    bending : float
        Delay with which the brace bends [control periods].
    share : float
        Share of a difference that enters the offset in a period.
    """

    bending: float
    share: float

    def observed(self, observation: ArrayLike, state: AnticipationState) -> AnticipationState:
        """Return the state with what an observation shows of plan, brace and plant."""
        now = super().observed(observation, state)
        if self.observer.gait or self.observer.stiffness:
            return now
        planned = self._angles(now, np.zeros((len(now.offset), 1)))[:, 0]
        off = self.observer.read(observation).angle - planned
        return now._replace(offset=now.offset + self.share * (off - now.offset))

    def _brace_stiffness(self, now: AnticipationState, ends: Array, reference: Array) -> Array:
        if self.observer.stiffness:
            return np.maximum(reference, 0.0)
        angle = self._angles(now, ends) + now.offset[:, None]
        return np.maximum(reference / self.observer.nominal.stretch(angle), 0.0)

    def _angles(self, now: AnticipationState, ends: Array) -> Array:
        """Return the planned angles [rad] of the bending brace, shape (n_env, n_times)."""
        times = np.maximum(ends - self.bending, -self.phase.present(now.plan)[:, None])
        return self.observer.nominal.angle_of(self.phase.read(now.plan, times)[0][:, 0])


@dataclass(frozen=True)
class KneeAdaptiveInverse(RowController):
    """Adaptive inverse with a disturbance observer; see the module.

    ``observer`` is the share of a difference that enters the disturbance in a period,
    ``forgetting`` the share of the information that is kept.
    """

    forward: KneeAnticipation
    observer: float
    forgetting: float

    def initial_state(self, observation: ArrayLike) -> AdaptiveState:
        """Return the state at rest under the present setpoint, with nominal estimates."""
        forward = self.forward.initial_state(observation)
        n = len(forward.offset)
        return AdaptiveState(forward, np.ones((n, 2)), np.tile(BEFORE, (n, 1)), np.zeros(n))

    def respond(self, observation: ArrayLike, state: AdaptiveState) -> Prediction:
        """Return the action and the next state."""
        forward = self.forward.observed(observation, state.forward)
        now = self._estimated(observation, state._replace(forward=forward))
        inverse = partial(self._probed, now, self._probe(observation, forward))
        action, after = self.forward.answer(observation, forward, inverse=inverse)
        return action, now._replace(forward=after)

    def _probe(self, observation: ArrayLike, forward: AnticipationState) -> Array:
        """Return the pressure [Pa] that shows the regulator in a first swing, shape (n_env,)."""
        step = forward.plan.seen.step
        free = ~self.forward.observer.read(observation).stance
        return np.where(free & (step >= PROBE[0]) & (step < PROBE[1]), PRESSURE, 0.0)

    def _probed(
        self, now: AdaptiveState, probe: Array, stiffness: Array, later: RowsState
    ) -> Array:
        """Return the pressures [Pa] of :meth:`_inverse`, the next ones higher by the probe."""
        pressure = self._inverse(now, stiffness, later)
        pressure[:, :PROBED] += probe[:, None]
        return pressure

    @cached_property
    def _slope(self) -> float:
        """Stiffness over pressure of the line [N/(m Pa)]."""
        nominal = self.forward.observer.nominal
        operator = nominal.plant.hysteresis.scaled
        return nominal.per_output * (1.0 if operator is None else operator.numbers()[0])

    def _estimated(self, observation: ArrayLike, state: AdaptiveState) -> AdaptiveState:
        """Return the state with the estimates after an observation."""
        forward, view = state.forward, self.forward.observer.read(observation)
        nominal, pressure = self.forward.observer.nominal, self.forward.bank.now(forward.bank)
        full = self._slope * nominal.full_pressure
        line = self._slope * pressure / full
        loop = nominal.stiffness_after(pressure, forward.hysteresis) / full - line
        sensed = view.tension / view.stretch / full
        a, b = state.estimate.T
        p, q, r = state.covariance.T / self.forgetting
        error = sensed - a * line - b * loop
        x, y = p * line + r * loop, r * line + q * loop
        variance = ROUGHNESS**2 + line * x + loop * y
        a = np.clip(a + x / variance * error, *GAINS)
        b = np.clip(b + y / variance * error, WIDTHS[0] * a, WIDTHS[1] * a)
        spread = np.stack([p - x * x / variance, q - y * y / variance, r - x * y / variance], 1)
        spread *= np.minimum(1.0, np.min(BEFORE[:2] / spread[:, :2], axis=1))[:, None]
        off = full * (sensed - a * line - b * loop)
        disturbance = state.disturbance + self.observer * (off - state.disturbance)
        return AdaptiveState(forward, np.stack([a, b], 1), spread, disturbance)

    def _inverse(self, now: AdaptiveState, stiffness: Array, later: RowsState) -> Array:
        """Return the pressures [Pa] of stiffnesses [N/m] for the estimates."""
        a, b = now.estimate.T[..., None]
        share = 1.0 - b / a
        aim = np.maximum(stiffness - now.disturbance[:, None], 0.0) / a
        value = aim
        pressure = self.forward.pressures(value, later)
        for _ in range(ITERATIONS):
            off = value - aim - share * (value - self._slope * pressure)
            value = np.maximum(value - off / (1.0 + share), 0.0)
            pressure = self.forward.pressures(value, later)
        return pressure


def make_knee_adaptive_inverse(spec: Spec[KneeOrthosis]) -> KneeAdaptiveInverse:
    """Return the controller."""
    lever, period = spec.plant.lever, spec.plant.control_period
    made = make_knee_anticipation(spec, adaptive=True)
    bending = lever.damping / lever.stiffness / period if spec.plant.mounting == "no_load" else 0.0
    share = -math.expm1(-period / (spec.knob("observer") * OBSERVER))
    forward = BendingAnticipation(**vars(made), bending=bending, share=share)
    forgetting = math.exp(-period / (spec.knob("memory") * MEMORY))
    return KneeAdaptiveInverse(forward, share, forgetting)


ENTRIES = {
    "knee_adaptive_inverse": ANTICIPATION(
        "knee_anticipating_adaptive, gain and loop width by least squares, disturbance observer",
        make=make_knee_adaptive_inverse,
        feedback=True,
        citation="yeh2010; bertsekas2017; thrun2005; beck2009; wiener1949; magill1965; ohnishi1996",
        knobs=KNOBS,
    ),
}
