"""Repetitive control of the assisted gait: the anticipating inverse learns from stride to stride.

What a model does not contain, a wrong loop width, gain or wire, causes errors that repeat with the
stride. P-type learning (:mod:`baselines.learning_control.periodic`) adds to the reference tension,
phase by phase, a share of the error of the stride before. The phase is the wearer's, not that of
the clock (:mod:`baselines.knee.plan`): an early stride is corrected early. Nothing is learned in
swing. The anticipating inverse leads the correction by dead time, lag and rate limit, so that it is
itself the learning filter.
"""

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, RowController
from baselines.core.entry import GAIT, Bounds, Spec
from baselines.knee.anticipation import (
    ANTICIPATION,
    AnticipationState,
    KneeAnticipation,
    make_knee_anticipation,
)
from baselines.learning_control.periodic import PeriodicLearning
from pam_envs.arrays import Array
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis

GAIN = 0.5
"""Share of an error that is learned: it halves from stride to stride if the inverse is exact."""
LARGEST = 60.0
"""Largest correction [N], a third of the tension at heel contact."""
KNOBS: Bounds = {"learning": (1e-4, 3.0)}


class RepetitiveState(NamedTuple):
    """State of the anticipating inverse, and corrections [N] over the stride, (n_env, bins)."""

    forward: AnticipationState
    correction: Array


@dataclass(frozen=True)
class KneeRepetitive(RowController):
    """Anticipating inverse with learning over the strides; see the module."""

    forward: KneeAnticipation
    learning: PeriodicLearning

    def initial_state(self, observation: ArrayLike) -> RepetitiveState:
        """Return the state at rest under the present setpoint, without corrections."""
        forward = self.forward.initial_state(observation)
        return RepetitiveState(forward, self.learning.start(len(forward.offset)))

    def respond(self, observation: ArrayLike, state: RepetitiveState) -> Prediction:
        """Return the action and the next state."""
        view = self.forward.observer.read(observation)
        now = self.forward.observed(observation, state.forward)
        time, error = self.forward.phase.present(now.plan), view.reference - view.tension
        correction = self.learning.learn(state.correction, time, error, view.stance)
        more = partial(self.learning.read, correction)
        action, after = self.forward.answer(observation, now, more)
        return action, RepetitiveState(after, correction)


def make_knee_repetitive(spec: Spec[KneeOrthosis], adaptive: bool = True) -> KneeRepetitive:
    """Return the controller; ``adaptive``: see :mod:`baselines.knee.anticipation`."""
    forward = make_knee_anticipation(spec, adaptive)
    stride = spec.plant.stride.time / spec.plant.control_period
    return KneeRepetitive(forward, PeriodicLearning(stride, spec.knob("learning") * GAIN, LARGEST))


ENTRIES = {
    "knee_repetitive": ANTICIPATION(
        "knee_anticipating_adaptive, and learning of the error from stride to stride",
        make=make_knee_repetitive,
        feedback=True,
        citation="yeh2010; bertsekas2017; thrun2005; beck2009; wiener1949; magill1965; "
        "bristow2006; longman2000",
        envs=GAIT,
        knobs=KNOBS,
    ),
}
