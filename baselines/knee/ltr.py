"""Feedback of tension in stance and of angle in swing, with a feed-forward: yeh2010, section 4.

    stance   set-point = forward(T_d) + K_T (T_d - T)
    swing    set-point = forward(T_0) + K_theta (theta_d - theta)

``T_d`` is the reference, ``T_0`` the tension that takes the wire's torque off the knee. Both
controllers run always; which of them is applied is told by the heel's load as sensed. The one
off-line is shown what the environment's references are then (in swing a tension that may be off,
in stance the angle itself). With the compensators each knows what was applied in its place;
without them it goes on integrating an error that it cannot change (the one in charge is
clamped, so that the difference is the hand-over). With the brace alone it is
always stance.
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
from baselines.knee.design import KNOBS, make_loop, printed_loop
from baselines.knee.feedforward import Forward, Kind
from baselines.knee.nominal import KneeNominal
from baselines.knee.preview import KNOBS as PREVIEW_KNOBS
from baselines.knee.preview import Ahead, free_tension, make_ahead, tension
from baselines.knee.view import Eyes, View, make_eyes
from baselines.linear.bumpless import Bumpless, BumplessState
from baselines.positioning.nominal import HysteresisState
from pam_envs.parameters import Signal, Signals
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis


class LtrState(NamedTuple):
    """Hysteresis models of both controllers and of the feed-forward, first axis n_env.

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
class KneeLtr:
    """Feedback and feed-forward; see this module's page.

    Attributes
    ----------
    tension : Bumpless
    angle : Bumpless, optional
        None without a gait.
    forward : Forward
    eyes : Eyes
    action_signal : Signal
    ahead : Ahead, optional
        Has the feed-forward look one lag ahead.
    """

    tension: Bumpless
    angle: Bumpless | None
    forward: Forward
    eyes: Eyes
    action_signal: Signal
    ahead: Ahead | None = None

    def predict(
        self,
        observation: ArrayLike,
        state: LtrState | None = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Prediction:
        """Return the set-point; see :class:`~baselines.core.controller.Controller`."""
        view = self.eyes.look(observation)
        state = reset_rows(state, episode_start, len(view.tension), lambda: self._start(view))
        forward, free = self._forward(view, observation, state.hysteresis)
        stance = forward + self._share(self.tension, view.wanted, view.tension, forward, state[0])
        command, used, angle = stance, forward, state.angle
        if self.angle is not None and state.angle:
            path, sensed = view.angle_wanted, view.angle
            swing = free + self._share(self.angle, path, sensed, free, state.angle)
            command = np.where(view.stance, stance, swing)
            used = np.where(view.stance, forward, free)
            off = ~view.stance
            angle = self.angle.advance(path, sensed, command - free, state.angle, off)
        stance_state = self.tension.advance(
            view.wanted, view.tension, command - forward, state.tension, view.stance
        )
        after = LtrState(stance_state, angle, self.forward.move(used, state.hysteresis))
        return encode_action(self.action_signal, command, observation), after

    def _forward(
        self, view: View, observation: ArrayLike, hysteresis: HysteresisState
    ) -> tuple[Array, Array]:
        """Return the feed-forwards [Pa] of stance and of swing."""
        wanted = tension(self.ahead, view, observation)
        stance = self.forward.pressure(wanted, view.stretch, hysteresis)
        if self.angle is None:
            return stance, stance
        free = free_tension(self.eyes, self.ahead, view, observation)
        return stance, self.forward.pressure(free, view.stretch, hysteresis)

    def _start(self, view: View) -> LtrState:
        """Return the state at the beginning: at rest, or holding what the set-point was."""
        held = np.zeros_like(view.set_point)
        if self.forward.kind == "nominal":
            held = view.set_point - self.forward.pressure(view.wanted, view.stretch, ())
        angle = () if self.angle is None else self.angle.holding_state(held)
        return LtrState(self.tension.holding_state(held), angle, self.forward.start(view.set_point))

    def _share(
        self, loop: Bumpless, wanted: Array, measured: Array, forward: Array, state: BumplessState
    ) -> Array:
        """Return a loop's share of the set-point [Pa], within what the feed-forward leaves."""
        low, high = self.action_signal.low - forward, self.action_signal.high - forward
        return loop.output(wanted, measured, state, low, high)


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
        Whether the compensators are on.
    printed : bool
        Whether the tension's controller is the printed one and not a design.
    preview : bool
        Whether the feed-forward looks one lag ahead.
    knobs : mapping
        Of :data:`baselines.knee.design.KNOBS`, for the tension's loop alone, and of
        :data:`baselines.knee.preview.KNOBS`.
    """
    nominal = KneeNominal(plant)
    eyes = make_eyes(nominal, signals)
    loop = printed_loop(plant) if printed else make_loop(plant, "tension", bumpless, knobs)
    return KneeLtr(
        loop,
        make_loop(plant, "angle", bumpless) if eyes.gait else None,
        Forward(nominal, forward),
        eyes,
        action_signals["pressure_set_point"],
        make_ahead(nominal, signals, eyes, knobs) if preview else None,
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
        ' dynamics="measured" (1.1 % on its sine), limit cycles on plants with the regulator\'s lag',
        make=partial(make_knee_ltr, printed=True),
        citation="yeh2010",
    ),
}
