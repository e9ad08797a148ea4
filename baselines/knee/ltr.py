"""Feedback of tension in stance and of angle in swing, with a feedforward: yeh2010, section 4.

    stance   set-point = forward(T_d) + K_T (T_d - T)
    swing    set-point = forward(T_0) + K_theta (theta_d - theta)

``T_d`` is the reference tension, ``T_0`` the tension of zero wire torque on the knee. Both
controllers always run; the sensed load of the heel selects which is applied. The controller
off-line receives the references of the environment (in swing a tension that may have an offset, in
stance the angle itself). With compensators each controller receives the applied command; without
them it integrates an error that it cannot change, and the controller in charge is clamped, so that
both forms differ in the transfer alone. With the brace alone it is always stance.
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
from baselines.knee.design import KNOBS, make_loop, printed_loop
from baselines.knee.feedforward import Forward, Kind
from baselines.knee.nominal import KneeNominal
from baselines.knee.preview import KNOBS as PREVIEW_KNOBS
from baselines.knee.preview import StiffnessPreview, free_tension, make_stiffness_preview, tension
from baselines.knee.view import KneeObserver, KneeView, make_knee_observer
from baselines.linear.bumpless import Bumpless, BumplessState
from baselines.positioning.nominal import HysteresisState
from pam_envs.parameters import Signal, Signals
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis


class LtrState(NamedTuple):
    """States of both controllers and of the feedforward's hysteresis, first axis n_env.

    Attributes
    ----------
    tension : BumplessState
    angle : BumplessState or tuple
        Empty without a gait.
    hysteresis : tuple of ndarray
    """

    tension: BumplessState
    angle: BumplessState | tuple[()]
    hysteresis: HysteresisState


@dataclass(frozen=True)
class KneeLtr(RowController):
    """Feedback and feedforward; see the module.

    Attributes
    ----------
    tension : Bumpless
    angle : Bumpless, optional
        None without a gait.
    forward : Forward
    observer : KneeObserver
    action_signal : Signal
    preview : StiffnessPreview, optional
        Of the feedforward, by one lag.
    """

    tension: Bumpless
    angle: Bumpless | None
    forward: Forward
    observer: KneeObserver
    action_signal: Signal
    preview: StiffnessPreview | None = None

    def initial_state(self, observation: ArrayLike) -> LtrState:
        """Return the state at rest, or holding the present set-point."""
        view = self.observer.read(observation)
        held = np.zeros_like(view.set_point)
        if self.forward.kind == "nominal":
            held = view.set_point - self.forward.pressure(view.reference, view.stretch, ())
        angle = () if self.angle is None else self.angle.holding_state(held)
        return LtrState(self.tension.holding_state(held), angle, self.forward.start(view.set_point))

    def respond(self, observation: ArrayLike, state: LtrState) -> Prediction:
        """See :class:`~baselines.core.controller.RowController`."""
        view = self.observer.read(observation)
        forward, free = self._forward(view, observation, state.hysteresis)
        stance = forward + self._share(
            self.tension, view.reference, view.tension, forward, state[0]
        )
        command, used, angle = stance, forward, state.angle
        if self.angle is not None and state.angle:
            path, sensed = view.angle_reference, view.angle
            swing = free + self._share(self.angle, path, sensed, free, state.angle)
            command = np.where(view.stance, stance, swing)
            used = np.where(view.stance, forward, free)
            off = ~view.stance
            angle = self.angle.advance(path, sensed, command - free, state.angle, off)
        stance_state = self.tension.advance(
            view.reference, view.tension, command - forward, state.tension, view.stance
        )
        after = LtrState(stance_state, angle, self.forward.advance(used, state.hysteresis))
        return encode_action(self.action_signal, command, observation), after

    def _forward(
        self, view: KneeView, observation: ArrayLike, hysteresis: HysteresisState
    ) -> tuple[Array, Array]:
        """Return the feedforward pressures [Pa] of stance and of swing."""
        reference = tension(self.preview, view, observation)
        stance = self.forward.pressure(reference, view.stretch, hysteresis)
        if self.angle is None:
            return stance, stance
        free = free_tension(self.observer, self.preview, view, observation)
        return stance, self.forward.pressure(free, view.stretch, hysteresis)

    def _share(
        self,
        loop: Bumpless,
        reference: Array,
        measured: Array,
        forward: Array,
        state: BumplessState,
    ) -> Array:
        """Return a loop's share of the set-point [Pa], within the range left by the feedforward."""
        low, high = self.action_signal.low - forward, self.action_signal.high - forward
        return loop.output(reference, measured, state, low, high)


def make_knee_ltr(
    plant: KneeOrthosis,
    signals: Signals,
    action_signals: Signals,
    forward: Kind = "inverse",
    bumpless: bool = True,
    printed: bool = False,
    preview: bool = False,
    knobs: Knobs = AS_DESIGNED,
) -> KneeLtr:
    """Return the controller for a nominal plant.

    Parameters
    ----------
    plant : KneeOrthosis
    signals, action_signals : Signals
    forward : {"inverse", "line", "nominal"}
    bumpless : bool
        Whether the compensators act.
    printed : bool
        Whether the tension controller is the printed one instead of a design.
    preview : bool
        Whether the feedforward is previewed by one lag.
    knobs : mapping
        Of :data:`baselines.knee.design.KNOBS`, for the tension loop alone, and of
        :data:`baselines.knee.preview.KNOBS`.
    """
    nominal = KneeNominal(plant)
    observer = make_knee_observer(nominal, signals)
    loop = printed_loop(plant) if printed else make_loop(plant, "tension", bumpless, knobs)
    return KneeLtr(
        loop,
        make_loop(plant, "angle", bumpless) if observer.gait else None,
        Forward(nominal, forward),
        observer,
        action_signals["pressure_set_point"],
        make_stiffness_preview(nominal, signals, observer, knobs) if preview else None,
    )


LTR = partial(Entry, knowledge="nominal model", feedback=True, envs=KNEE, plants=(KneeOrthosis,))
ENTRIES = {
    "knee_ltr": LTR(
        "loop transfer recovery on the identified plant, about 2 bar",
        make=partial(make_knee_ltr, forward="nominal"),
        citation="yeh2010; athans1986; zaccarian2002",
        knobs=KNOBS,
    ),
    "knee_line_ltr": LTR(
        "knee_ltr with knee_line as feedforward: the share of the gain due to feedforward",
        make=partial(make_knee_ltr, forward="line"),
        citation="athans1986; zaccarian2002",
        knobs=KNOBS,
    ),
    "knee_inverse_ltr": LTR(
        "knee_ltr and knee_inverse: the paper's control system, with compensator gains K = L = 0,"
        " which satisfy its matrix inequality for a stable plant",
        make=make_knee_ltr,
        citation="yeh2010; athans1986; zaccarian2002",
        knobs=KNOBS,
    ),
    "knee_inverse_ahead_ltr": LTR(
        "knee_inverse_ltr, its feedforward previewed by one lag of the regulator",
        make=partial(make_knee_ltr, preview=True),
        preview=True,
        citation="yeh2010; athans1986; zaccarian2002",
        knobs={**KNOBS, **PREVIEW_KNOBS},
    ),
    "knee_inverse_ltr_bumpy": Entry(
        "knee_inverse_ltr without compensators: each loop integrates off-line, clamped in charge",
        "nominal model",
        partial(make_knee_ltr, bumpless=False),
        feedback=True,
        citation="yeh2010; athans1986",
        envs=GAIT,
        plants=(KneeOrthosis,),
    ),
    "knee_printed": LTR(
        "knee_inverse_ltr with the printed tension controller (11) and compensator; for"
        ' dynamics="measured" (1.1 % on its sine), limit cycles on plants with a regulator lag',
        make=partial(make_knee_ltr, printed=True),
        citation="yeh2010",
    ),
}
