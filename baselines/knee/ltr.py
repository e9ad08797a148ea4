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
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Answer, Array, answer, beginning, choose
from baselines.core.knobs import AS_DESIGNED, Knobs
from baselines.knee.design import Loop, make_loop, printed_loop
from baselines.knee.feedforward import Forward, Kind
from baselines.knee.nominal import KneeNominal
from baselines.knee.preview import Ahead, free_tension, make_ahead, tension
from baselines.knee.view import Eyes, View, make_eyes
from baselines.linear.bumpless import BumplessState
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
    tension : Loop
    angle : Loop, optional
        None without a gait.
    forward : Forward
    eyes : Eyes
    action_signal : Signal
    ahead : Ahead, optional
        Has the feed-forward look one lag ahead.
    """

    tension: Loop
    angle: Loop | None
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
    ) -> Answer:
        """Return the set-point; see :class:`~baselines.core.controller.Controller`."""
        view = self.eyes.look(observation)
        begin = beginning(state, episode_start, len(view.tension))
        if state is None or begin.any():
            state = choose(begin, self._start(view), state)
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
        return answer(self.action_signal, command, observation), after

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
        angle = () if self.angle is None else self.angle.start(held)
        return LtrState(self.tension.start(held), angle, self.forward.start(view.set_point))

    def _share(
        self, loop: Loop, wanted: Array, measured: Array, forward: Array, state: BumplessState
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
