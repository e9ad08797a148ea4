"""Feed-forward alone: the inverse of the hysteresis, or the straight line, without feedback.

In stance, and with the brace alone, the wanted tension is the reference; in swing it is the one
that takes the wire's torque off the knee. The inverse is static, as in yeh2010: it knows nothing
of the regulator's lag. With a preview it aims at the reference one lag ahead.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Array, Prediction, encode_action, reset_rows
from baselines.core.entry import Entry
from baselines.core.environments import GAIT, KNEE
from baselines.core.knobs import AS_DESIGNED, Knobs
from baselines.knee.feedforward import Forward, Kind
from baselines.knee.nominal import KneeNominal
from baselines.knee.preview import KNOBS, Ahead, free_tension, make_ahead, tension
from baselines.knee.view import Eyes, View, make_eyes
from baselines.positioning.nominal import HysteresisState
from pam_envs.parameters import Signal, Signals
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis


class ForwardState(NamedTuple):
    """The nominal hysteresis, first axis n_env."""

    hysteresis: HysteresisState


@dataclass(frozen=True)
class KneeForward:
    """Feed-forward alone; see this module's page.

    Attributes
    ----------
    forward : Forward
    eyes : Eyes
    action_signal : Signal
    assist : bool
        Whether the reference is followed in stance; otherwise the wire's torque is taken off
        always, so that the orthosis neither helps nor hinders.
    ahead : Ahead, optional
        Looks one lag ahead.
    """

    forward: Forward
    eyes: Eyes
    action_signal: Signal
    assist: bool = True
    ahead: Ahead | None = None

    def predict(
        self,
        observation: ArrayLike,
        state: ForwardState | None = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Prediction:
        """Return the set-point; see :class:`~baselines.core.controller.Controller`."""
        view = self.eyes.look(observation)
        state = reset_rows(
            state,
            episode_start,
            len(view.tension),
            lambda: ForwardState(self.forward.start(view.set_point)),
        )
        pressure = self.forward.pressure(
            self._wanted(view, observation), view.stretch, state.hysteresis
        )
        after = ForwardState(self.forward.move(pressure, state.hysteresis))
        return encode_action(self.action_signal, pressure, observation), after

    def _wanted(self, view: View, observation: ArrayLike) -> Array:
        free = free_tension(self.eyes, self.ahead, view, observation)
        if not self.assist:
            return free
        return np.where(view.stance, tension(self.ahead, view, observation), free)


def make_knee_forward(
    plant: KneeOrthosis,
    signals: Signals,
    action_signals: Signals,
    kind: Kind = "inverse",
    assist: bool = True,
    preview: bool = False,
    knobs: Knobs = AS_DESIGNED,
) -> KneeForward:
    """Return the controller for a nominal plant.

    Parameters
    ----------
    plant : KneeOrthosis
    signals, action_signals : Signals
    kind : {"inverse", "line", "nominal"}
    assist : bool
        See :class:`KneeForward`.
    preview : bool
        Whether it looks one lag ahead.
    knobs : mapping
        Of :data:`baselines.knee.preview.KNOBS`.
    """
    nominal = KneeNominal(plant)
    eyes = make_eyes(nominal, signals)
    ahead = make_ahead(nominal, signals, eyes, knobs) if preview else None
    signal = action_signals["pressure_set_point"]
    return KneeForward(Forward(nominal, kind), eyes, signal, assist, ahead)


FORWARD = partial(Entry, knowledge="nominal model", envs=KNEE, plants=(KneeOrthosis,))
ENTRIES = {
    "knee_free": Entry(
        "inverse for zero torque on the knee: neither assistance nor resistance",
        "nominal model",
        partial(make_knee_forward, assist=False),
        citation="yeh2010",
        envs=GAIT,
        plants=(KneeOrthosis,),
    ),
    "knee_line": FORWARD(
        "straight line between the tips of the loop: hysteresis ignored",
        make=partial(make_knee_forward, kind="line"),
    ),
    "knee_inverse": FORWARD(
        "inverse of the hysteresis at the present reference, as in the paper",
        make=make_knee_forward,
        citation="yeh2010",
    ),
    "knee_inverse_ahead": FORWARD(
        "knee_inverse at the reference previewed by one lag of the regulator",
        make=partial(make_knee_forward, preview=True),
        preview=True,
        citation="yeh2010",
        knobs=KNOBS,
    ),
}
