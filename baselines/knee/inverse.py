"""Feedforward control of the knee: the inverse of the hysteresis, or a straight line.

In stance, and with the brace alone, the reference tension is tracked; in swing the tension cancels
the wire's torque on the knee. The inverse is static, as in yeh2010, without the regulator's lag.
With a preview it tracks the reference of one lag later.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Array, Prediction, RowController, encode_action
from baselines.core.entry import Entry
from baselines.core.environments import GAIT, KNEE
from baselines.core.knobs import AS_DESIGNED, Knobs
from baselines.knee.feedforward import Forward, Kind
from baselines.knee.nominal import KneeNominal
from baselines.knee.preview import (
    KNOBS,
    StiffnessPreview,
    free_tension,
    make_stiffness_preview,
    tension,
)
from baselines.knee.view import KneeObserver, KneeView, make_knee_observer
from baselines.positioning.nominal import HysteresisState
from pam_envs.parameters import Signal, Signals
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis


class ForwardState(NamedTuple):
    """State of the nominal hysteresis, first axis n_env."""

    hysteresis: HysteresisState


@dataclass(frozen=True)
class KneeForward(RowController):
    """Feedforward control; see the module.

    Attributes
    ----------
    forward : Forward
    observer : KneeObserver
    action_signal : Signal
    assist : bool
        Whether the reference is tracked in stance; otherwise the wire's torque is cancelled
        throughout, so that the orthosis neither assists nor resists.
    preview : StiffnessPreview, optional
        Of one lag.
    """

    forward: Forward
    observer: KneeObserver
    action_signal: Signal
    assist: bool = True
    preview: StiffnessPreview | None = None

    def initial_state(self, observation: ArrayLike) -> ForwardState:
        """See :class:`~baselines.core.controller.RowController`."""
        view = self.observer.read(observation)
        return ForwardState(self.forward.start(view.set_point))

    def respond(self, observation: ArrayLike, state: ForwardState) -> Prediction:
        """See :class:`~baselines.core.controller.RowController`."""
        view = self.observer.read(observation)
        pressure = self.forward.pressure(
            self._reference(view, observation), view.stretch, state.hysteresis
        )
        after = ForwardState(self.forward.advance(pressure, state.hysteresis))
        return encode_action(self.action_signal, pressure, observation), after

    def _reference(self, view: KneeView, observation: ArrayLike) -> Array:
        free = free_tension(self.observer, self.preview, view, observation)
        if not self.assist:
            return free
        return np.where(view.stance, tension(self.preview, view, observation), free)


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
        Whether the reference is previewed by one lag.
    knobs : mapping
        Of :data:`baselines.knee.preview.KNOBS`.
    """
    nominal = KneeNominal(plant)
    observer = make_knee_observer(nominal, signals)
    ahead = make_stiffness_preview(nominal, signals, observer, knobs) if preview else None
    signal = action_signals["pressure_set_point"]
    return KneeForward(Forward(nominal, kind), observer, signal, assist, ahead)


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
