"""Model-following control of joints with an inverse of the hysteresis.

fluidic_muscles, section 4, Fig. 11:

    model loop         u_mod = C_t (r - phi_mod),      phi_mod = G u_mod
    disturbance loop   u_dis = C_d (phi_mod - phi)
    command            u = H^-1(u_mod + u_dis)         (+ gravity feedforward)

The model loop has no disturbance: its PI (pole cancellation, ``D = 1/sqrt(2)``) is designed for
tracking alone. The disturbance loop compares the joint with the model instead of the reference, and
is designed for rejection alone (:mod:`baselines.robust.loops`). With an exact inverse and motion
the joint equals its model, and the disturbance loop is at rest.

``H^-1`` is the exact recursive inverse of the identified hysteresis (:mod:`baselines.joint.model`),
for the history of commands; without it ``u = (u_mod + u_dis) / K``. ``u_mod`` is limited to the
angles that can be held, so that the model saturates as the joint does, and ``u_dis`` to the rest;
the disturbance loop receives the applied command (:mod:`baselines.joint.loop`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Array, Prediction, RowController
from baselines.core.entry import Entry
from baselines.core.environments import JOINT
from baselines.core.knobs import AS_DESIGNED, Bounds, Knobs, knob
from baselines.joint.gravity import Gravity
from baselines.joint.hysteresis_rows import JointHysteresis
from baselines.joint.loop import DAMPING, make_loop
from baselines.joint.model import JointModel, joint_model
from baselines.joint.poles import joint_poles
from baselines.joint.preview import KNOBS as PREVIEW_KNOBS
from baselines.joint.preview import Lookahead, double_pole_delays, lookahead_for
from baselines.joint.tracking import make_model_loop
from baselines.joint.view import JointSignalMap, JointView, make_joint_signal_map
from baselines.linear.bumpless import Bumpless, BumplessState
from baselines.linear.systems import DiscreteSystem
from baselines.positioning.nominal import HysteresisState
from baselines.robust.loops import Kind, robust_controller
from pam_envs.parameters import Signals
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator

KNOBS: Bounds = {"damping": (0.5, 1.5), "disturbance": (0.5, 2.0)}
"""Factors on the damping of the model loop and the bandwidth of the disturbance loop."""


class FollowingState(NamedTuple):
    """States of model, loops and inverse, shapes (n_env, n_joints, ...).

    Attributes
    ----------
    model : ndarray
        States of the model of the motion.
    tracking : ndarray
        States of the model loop.
    disturbance : BumplessState
    hysteresis : tuple of ndarray
        Of the inverse.
    """

    model: Array
    tracking: Array
    disturbance: BumplessState
    hysteresis: HysteresisState


@dataclass(frozen=True)
class ModelFollowing(RowController):
    """Model loop, inverse and disturbance loop; see the module.

    Attributes
    ----------
    model : JointModel
        Of hysteresis and motion.
    tracking : DiscreteSystem
        Model loop, from reference to mean command.
    disturbance : Bumpless
    signals : JointSignalMap
    gravity : Gravity
    lookahead : Lookahead
        On the reference of the model loop.
    """

    model: JointModel
    tracking: DiscreteSystem
    disturbance: Bumpless
    signals: JointSignalMap
    gravity: Gravity
    lookahead: Lookahead

    def initial_state(self, observation: ArrayLike) -> FollowingState:
        """Return the state of joints at rest at the present angle and set-point."""
        view = self.signals.read(observation)
        shift = self.gravity.shift(view.angle, view.payload)
        held, hysteresis = JointHysteresis(self.model).start(view.set_point - shift)
        angle = view.angle
        return FollowingState(
            self.model.motion.rest_state(angle),
            self.tracking.rest_state(angle),
            self.disturbance.holding_state(held - angle),
            hysteresis,
        )

    def respond(self, observation: ArrayLike, state: FollowingState) -> Prediction:
        """See :class:`~baselines.core.controller.RowController`."""
        view = self.signals.read(observation)
        shift = self.gravity.shift(view.reference, view.payload)
        tracking, correction = self._commands(view, state)
        set_point = (
            JointHysteresis(self.model).inverse(tracking + correction, state.hysteresis) + shift
        )
        set_point = np.minimum(np.maximum(set_point, self.model.low), self.model.high)
        return self.signals.write(set_point, observation), self._after(
            view, state, tracking, set_point - shift
        )

    def model_output(self, state: FollowingState) -> Array:
        """Return the model's angles [rad], shape (n_env, n_joints), when the action has acted."""
        return self.model.motion.output(np.zeros(state.model.shape[:-1]), state.model)

    def _commands(self, view: JointView, state: FollowingState) -> tuple[Array, Array]:
        """Return the commands of model and disturbance loop: angles at rest [rad]."""
        low, high = self.model.reach
        angle = self.model_output(state)
        aim = self.lookahead.reference(view.samples)
        tracking = np.clip(self.tracking.output(aim, state.tracking), low, high)
        more = self.disturbance.output(
            angle, view.angle, state.disturbance, low - tracking, high - tracking
        )
        return tracking, more

    def _after(
        self, view: JointView, state: FollowingState, tracking: Array, applied: Array
    ) -> FollowingState:
        angle = self.model_output(state)
        held, hysteresis = JointHysteresis(self.model).forward(applied, state.hysteresis)
        disturbance = self.disturbance.advance(
            angle, view.angle, held - tracking, state.disturbance
        )
        return FollowingState(
            self.model.motion.advance(tracking, state.model),
            self.tracking.advance(self.lookahead.reference(view.samples), state.tracking),
            disturbance,
            hysteresis,
        )


def make_model_following(
    plant: Any,
    signals: Signals,
    action_signals: Signals,
    kind: Kind = "mu",
    inverse: float = 1.0,
    gravity: bool = False,
    ahead: bool = False,
    knobs: Knobs = AS_DESIGNED,
) -> ModelFollowing:
    """Return the controller.

    Parameters
    ----------
    plant : AntagonisticJoint or RedundantManipulator
        Nominal plant.
    signals, action_signals : Signals
    kind : {"mu", "hinf"}
        Of the disturbance loop.
    inverse : float
        Width of the inverted hysteresis over the identified one: 1 is the exact inverse, 0 none.
    gravity : bool
        Whether the set-points compensate the weight of the links and of the declared payload.
    ahead : bool
        Whether the reference of the model loop is previewed.
    knobs : mapping
        Of ``KNOBS`` and of :data:`baselines.joint.preview.KNOBS`. The delay of the model loop is
        proportional to the square of its damping.
    """
    model = joint_model(plant, poles=joint_poles(plant)).narrowed(inverse)
    made = make_joint_signal_map(signals, action_signals)
    damping, pace = knob(knobs, "damping"), knob(knobs, "disturbance")
    delays = [damping**2 * delay for delay in double_pole_delays(model.poles)]
    return ModelFollowing(
        model,
        make_model_loop(model, damping * DAMPING),
        make_loop(model, lambda pole: robust_controller(kind, pole=pace * pole)),
        made,
        Gravity(plant if gravity else None),
        lookahead_for(made, delays if ahead else None, model.period, knobs),
    )


NARROW = 0.7
"""Width of the mismatched inverse's hysteresis over the identified width."""
FOLLOWING = partial(
    Entry,
    knowledge="nominal model",
    feedback=True,
    citation="fluidic_muscles; skoczowski2005; packard1993",
    envs=JOINT,
    plants=(AntagonisticJoint, RedundantManipulator),
    knobs=KNOBS,
)
ENTRIES = {
    "joint_mfc_hinf": FOLLOWING(
        "model-following control with inverse and H-infinity disturbance loop",
        make=partial(make_model_following, kind="hinf"),
    ),
    "joint_mfc_mu": FOLLOWING(
        "model-following control with inverse and mu-synthesised disturbance loop: the paper's",
        make=make_model_following,
    ),
    "joint_mfc_mu_plain": FOLLOWING(
        "joint_mfc_mu without the inverse", make=partial(make_model_following, inverse=0.0)
    ),
    "joint_mfc_mu_wrong": FOLLOWING(
        "joint_mfc_mu with an inverse 30 % too narrow",
        make=partial(make_model_following, inverse=NARROW),
    ),
    "joint_mfc_mu_gravity": FOLLOWING(
        "joint_mfc_mu with gravity feedforward", make=partial(make_model_following, gravity=True)
    ),
    "joint_mfc_mu_ahead": FOLLOWING(
        "joint_mfc_mu with gravity feedforward and a reference previewed by its own delay",
        make=partial(make_model_following, gravity=True, ahead=True),
        preview=True,
        knobs={**KNOBS, **PREVIEW_KNOBS},
    ),
}
