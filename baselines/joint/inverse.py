"""Feedforward control of joints: the reference itself, or the inverse of the hysteresis.

    u = H^-1(r)                                              fluidic_muscles, section 3.2, Fig. 10

``H^-1`` is the exact recursive inverse of the hysteresis identified on the nominal plant, for the
history of commands: ``E(u_next, u_turn) = f_next - f_turn``. The printed sum (3.5) is exact only up
to the first reversal (:mod:`pam_envs.identification.joint_forc`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, RowController
from baselines.core.entry import Entry
from baselines.core.environments import JOINT
from baselines.core.knobs import AS_DESIGNED, Knobs
from baselines.joint.gravity import Gravity
from baselines.joint.hysteresis_rows import JointHysteresis
from baselines.joint.model import JointModel, joint_model
from baselines.joint.poles import joint_delays
from baselines.joint.preview import KNOBS, Lookahead, lookahead_for
from baselines.joint.view import JointSignalMap, make_joint_signal_map
from baselines.positioning.nominal import HysteresisState
from pam_envs.parameters import Signals
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator


@dataclass(frozen=True)
class JointInverse(RowController):
    """Inverse of the hysteresis as feedforward.

    Attributes
    ----------
    model : JointModel
    signals : JointSignalMap
    gravity : Gravity
    lookahead : Lookahead
    """

    model: JointModel
    signals: JointSignalMap
    gravity: Gravity
    lookahead: Lookahead

    def initial_state(self, observation: ArrayLike) -> HysteresisState:
        """See :class:`~baselines.core.controller.RowController`."""
        view = self.signals.read(observation)
        held = view.set_point - self.gravity.shift(view.angle, view.payload)
        return JointHysteresis(self.model).start(held)[1]

    def respond(self, observation: ArrayLike, state: HysteresisState) -> Prediction:
        """See :class:`~baselines.core.controller.RowController`."""
        view, hysteresis = self.signals.read(observation), JointHysteresis(self.model)
        shift = self.gravity.shift(view.reference, view.payload)
        found = hysteresis.inverse(self.lookahead.reference(view.samples), state) + shift
        set_point = np.minimum(np.maximum(found, self.model.low), self.model.high)
        after = hysteresis.forward(set_point - shift, state)[1]
        return self.signals.write(set_point, observation), after


def make_joint_inverse(
    plant: Any,
    signals: Signals,
    action_signals: Signals,
    inverse: float = 1.0,
    gravity: bool = False,
    ahead: bool = False,
    knobs: Knobs = AS_DESIGNED,
) -> JointInverse:
    """Return the controller.

    Parameters
    ----------
    plant : AntagonisticJoint or RedundantManipulator
        Nominal plant.
    signals, action_signals : Signals
    inverse : float
        Width of the inverted hysteresis over the identified one; 0: the line between the tips of
        the loop.
    gravity : bool
        Whether the set-points compensate the weight of the links and of the declared payload.
    ahead : bool
        Whether the reference is previewed by the delay of each joint.
    knobs : mapping
        Of :data:`baselines.joint.preview.KNOBS`.
    """
    model = joint_model(plant).narrowed(inverse)
    made = make_joint_signal_map(signals, action_signals)
    lookahead = lookahead_for(made, joint_delays(plant) if ahead else None, model.period, knobs)
    return JointInverse(model, made, Gravity(plant if gravity else None), lookahead)


INVERSE = partial(
    Entry,
    knowledge="nominal model",
    citation="fluidic_muscles",
    envs=JOINT,
    plants=(AntagonisticJoint, RedundantManipulator),
)
ENTRIES = {
    "joint_line": INVERSE(
        "line between the tips of the loop: hysteresis ignored",
        make=partial(make_joint_inverse, inverse=0.0),
    ),
    "joint_inverse": INVERSE(
        "exact inverse of the identified hysteresis, without feedback", make=make_joint_inverse
    ),
    "joint_inverse_gravity": INVERSE(
        "joint_inverse with gravity feedforward", make=partial(make_joint_inverse, gravity=True)
    ),
    "joint_inverse_ahead": INVERSE(
        "joint_inverse with gravity feedforward and a reference previewed by its own delay",
        make=partial(make_joint_inverse, gravity=True, ahead=True),
        preview=True,
        knobs=KNOBS,
    ),
}
