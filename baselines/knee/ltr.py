"""Feedback of tension in stance and of angle in swing, with a feedforward (yeh2010, section 4).

    stance   setpoint = forward(T_d) + K_T (T_d - T)
    swing    setpoint = forward(T_0) + K_theta (theta_d - theta)

``T_d`` is the reference tension, ``T_0`` the tension of zero wire torque on the knee. Both
controllers always run; the sensed load of the heel selects the active one. The off-line controller
receives the references of the environment (in swing a tension that may have an offset, in stance
the angle itself). With compensators each controller receives the applied command. Without them the
off-line controller integrates an error that it cannot affect, and the active one is clamped, so
that both forms differ only in the transfer. The brace alone is always in stance.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Array, Prediction, RowController, encode_action
from baselines.core.entry import GAIT, Spec
from baselines.knee.design import KNOBS, make_loop, printed_loop
from baselines.knee.feedforward import FORWARD, Forward, Kind, make_forward
from baselines.knee.feedforward import KNOBS as PREVIEW_KNOBS
from baselines.linear.bumpless import Bumpless, BumplessState
from pam_envs.hysteresis.protocol import RowsState
from pam_envs.parameters import Signal
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis


class LtrState(NamedTuple):
    """States of the controllers (without a gait: tension only) and the feedforward's hysteresis."""

    tension: BumplessState
    angle: BumplessState | tuple[()]
    hysteresis: RowsState


@dataclass(frozen=True)
class KneeLtr(RowController):
    """Feedback of tension and, with a gait, of the angle, and feedforward; see the module."""

    tension: Bumpless
    angle: Bumpless | None
    forward: Forward
    action_signal: Signal

    def initial_state(self, observation: ArrayLike) -> LtrState:
        """Return the state at rest, or holding the present setpoint."""
        view = self.forward.observer.read(observation)
        held = np.zeros_like(view.set_point)
        if self.forward.kind == "nominal":
            held = view.set_point - self.forward.pressure(view.reference, view.stretch, ())
        angle = () if self.angle is None else self.angle.holding_state(held)
        return LtrState(self.tension.holding_state(held), angle, self.forward.start(view.set_point))

    def respond(self, observation: ArrayLike, state: LtrState) -> Prediction:
        """Return the action and the next state."""
        view, forward = self.forward.observer.read(observation), self.forward
        reference, free = forward.tensions(view, observation)
        stance = forward.pressure(reference, view.stretch, state.hysteresis)
        tension = view.reference, view.tension
        command = stance + self._share(self.tension, *tension, stance, state.tension)
        used, after = stance, state.angle
        if self.angle is not None and state.angle:
            path = view.angle_reference, view.angle
            swing = forward.pressure(free, view.stretch, state.hysteresis)
            swung = swing + self._share(self.angle, *path, swing, state.angle)
            command = np.where(view.stance, command, swung)
            used = np.where(view.stance, stance, swing)
            after = self.angle.advance(*path, command - swing, state.angle, ~view.stance)
        held = self.tension.advance(*tension, command - stance, state.tension, view.stance)
        following = LtrState(held, after, forward.advance(used, state.hysteresis))
        return encode_action(self.action_signal, command, observation), following

    def _share(
        self,
        loop: Bumpless,
        reference: Array,
        measured: Array,
        forward: Array,
        state: BumplessState,
    ) -> Array:
        """Return a loop's share of the setpoint [Pa], within the range left by the feedforward."""
        low, high = self.action_signal.low - forward, self.action_signal.high - forward
        return loop.output(reference, measured, state, low, high)


def make_knee_ltr(
    spec: Spec[KneeOrthosis],
    forward: Kind = "inverse",
    bumpless: bool = True,
    printed: bool = False,
    preview: bool = False,
) -> KneeLtr:
    """Return the controller.

    ``bumpless``: whether the compensators are active; ``printed``: whether the tension controller
    is the printed one; ``preview``: whether the feedforward is previewed by one lag. The knobs of
    :data:`baselines.knee.design.KNOBS` are for the tension loop only.
    """
    plant, ahead = spec.plant, make_forward(spec, forward, preview)
    return KneeLtr(
        printed_loop(plant) if printed else make_loop(plant, "tension", bumpless, spec.knobs),
        make_loop(plant, "angle", bumpless) if ahead.observer.gait else None,
        ahead,
        spec.actions["pressure_set_point"],
    )


LTR = partial(FORWARD, feedback=True)
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
    "knee_inverse_ltr_bumpy": LTR(
        "knee_inverse_ltr without compensators: each loop integrates off-line, clamped in charge",
        make=partial(make_knee_ltr, bumpless=False),
        citation="yeh2010; athans1986",
        envs=GAIT,
    ),
    "knee_printed": LTR(
        "knee_inverse_ltr with the printed tension controller (11) and compensator; for"
        ' dynamics="measured" (1.1 % on its sine), limit cycles on plants with a regulator lag',
        make=partial(make_knee_ltr, printed=True),
        citation="yeh2010",
    ),
}
