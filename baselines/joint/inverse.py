"""Feedforward control of joints: the reference itself, or the inverse of the hysteresis.

    u = H^-1(r)                                              fluidic_muscles, section 3.2, Fig. 10

``H^-1`` is the exact recursive inverse of the hysteresis identified on the nominal plant, for the
history of commands: ``E(u_next, u_turn) = f_next - f_turn``. The printed sum (3.5) is exact only up
to the first reversal (:mod:`pam_envs.identification.joint_forc`).
"""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction
from baselines.core.entry import Spec
from baselines.joint.base import JOINT_ENTRY, PREVIEW_KNOBS, JointController, make_parts
from baselines.joint.model import joint_delays, joint_model
from pam_envs.hysteresis.protocol import RowsState


@dataclass(frozen=True)
class JointInverse(JointController):
    """Inverse of the hysteresis as feedforward."""

    def initial_state(self, observation: ArrayLike) -> RowsState:
        """Return the hysteresis state after the present setpoint."""
        return self.parts.model.start(self.start(observation)[1])[1]

    def respond(self, observation: ArrayLike, state: RowsState) -> Prediction:
        """Return the action and the next state."""
        (_, reference, shift), model = self.read(observation), self.parts.model
        set_point = np.clip(model.inverse(reference, state) + shift, model.low, model.high)
        after = model.forward(set_point - shift, state)[1]
        return self.parts.signals.write(set_point, observation), after


def make_joint_inverse(
    spec: Spec[Any], inverse: float = 1.0, gravity: bool = False, ahead: bool = False
) -> JointInverse:
    """Return the controller, with or without gravity feedforward and preview of the joints' delays.

    ``inverse`` scales the width of the inverted hysteresis; 0: the line between the tips of the
    loop.
    """
    delays = joint_delays(spec.plant) if ahead else None
    return JointInverse(
        make_parts(spec, joint_model(spec.plant).narrowed(inverse), gravity, delays)
    )


ENTRIES = {
    "joint_line": JOINT_ENTRY(
        "line between the tips of the loop: hysteresis ignored",
        make=partial(make_joint_inverse, inverse=0.0),
    ),
    "joint_inverse": JOINT_ENTRY(
        "exact inverse of the identified hysteresis, without feedback", make=make_joint_inverse
    ),
    "joint_inverse_gravity": JOINT_ENTRY(
        "joint_inverse with gravity feedforward", make=partial(make_joint_inverse, gravity=True)
    ),
    "joint_inverse_ahead": JOINT_ENTRY(
        "joint_inverse with gravity feedforward and a reference previewed by its own delay",
        make=partial(make_joint_inverse, gravity=True, ahead=True),
        preview=True,
        knobs=PREVIEW_KNOBS,
    ),
}
