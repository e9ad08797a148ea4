"""Model-following control of joints with an inverse of the hysteresis.

fluidic_muscles, section 4, Fig. 11:

    model loop         u_mod = C_t (r - phi_mod),      phi_mod = G u_mod
    disturbance loop   u_dis = C_d (phi_mod - phi)
    command            u = H^-1(u_mod + u_dis)         (+ gravity feedforward)

The model loop has no disturbance: its PI (pole cancellation, ``D = 1/sqrt(2)``) is designed for
tracking only; the model's angle, behind the regulators' dead time, is that with which the
disturbance loop compares the joint. The disturbance loop
is designed for disturbance rejection only (:mod:`baselines.robust.requirements`). With an exact
inverse and an exact model of the motion the joint equals its model, and the disturbance loop is at
rest.

``H^-1`` is the exact recursive inverse of the identified hysteresis (:mod:`baselines.joint.model`),
for the history of commands; without it ``u = (u_mod + u_dis) / K``. ``u_mod`` is limited to the
angles that can be held, so that the model saturates as the joint does, and ``u_dis`` to the rest;
the disturbance loop receives the applied command (:mod:`baselines.joint.model`).
"""

from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction
from baselines.core.entry import Bounds, Spec
from baselines.joint.base import JOINT_ENTRY, PREVIEW_KNOBS, JointController, make_parts
from baselines.joint.model import (
    DAMPING,
    joint_model,
    joint_poles,
    make_loop,
    make_model_loop,
    pi_delay,
)
from baselines.linear.bumpless import Bumpless, BumplessState
from baselines.linear.systems import DiscreteSystem
from baselines.robust.requirements import Kind, robust_controller
from pam_envs.arrays import Array
from pam_envs.hysteresis.protocol import RowsState

KNOBS: Bounds = {"damping": (0.5, 3.0), "disturbance": (0.5, 2.0)}
"""Factors on the damping of the model loop and the bandwidth of the disturbance loop."""


class FollowingState(NamedTuple):
    """States of the motion's model, of both loops and of the inverse, (n_env, n_joints, ...)."""

    model: Array
    tracking: Array
    disturbance: BumplessState
    hysteresis: RowsState


@dataclass(frozen=True)
class ModelFollowing(JointController):
    """Model loop ``tracking``, from reference to mean command, inverse and disturbance loop."""

    tracking: DiscreteSystem
    disturbance: Bumpless

    def initial_state(self, observation: ArrayLike) -> FollowingState:
        """Return the state of joints at rest at the present angle and setpoint."""
        (view, without), model = self.start(observation), self.parts.model
        held, hysteresis = model.start(without)
        return FollowingState(
            model.motion.rest_state(view.angle),
            self.tracking.rest_state(view.angle),
            self.disturbance.holding_state(held - view.angle),
            hysteresis,
        )

    def respond(self, observation: ArrayLike, state: FollowingState) -> Prediction:
        """Return the action and the next state."""
        (view, aim, shift), model = self.read(observation), self.parts.model
        low, high = model.reach
        angles = self.model_output(state), view.angle
        mean, tracking = self.tracking.step(aim, state.tracking)
        mean = np.clip(mean, low, high)
        more = self.disturbance.output(*angles, state.disturbance, low - mean, high - mean)
        found = model.inverse(mean + more, state.hysteresis) + shift
        set_point = np.clip(found, model.low, model.high)
        held, hysteresis = model.forward(set_point - shift, state.hysteresis)
        after = FollowingState(
            model.motion.advance(mean, state.model),
            tracking,
            self.disturbance.advance(*angles, held - mean, state.disturbance),
            hysteresis,
        )
        return self.parts.signals.write(set_point, observation), after

    def model_output(self, state: FollowingState) -> Array:
        """Return the model's angles [rad] at the end of the period, shape (n_env, n_joints)."""
        return self.parts.model.motion.output(np.zeros(state.model.shape[:-1]), state.model)


def make_model_following(
    spec: Spec[Any],
    kind: Kind = "mu",
    inverse: float = 1.0,
    gravity: bool = False,
    ahead: bool = False,
) -> ModelFollowing:
    """Return the controller, with or without gravity feedforward and preview.

    ``kind`` selects the disturbance loop; ``inverse`` scales the width of the inverted hysteresis:
    1 is the exact inverse, 0 none. The delay of the model loop is proportional to the square of its
    damping.
    """
    model = joint_model(spec.plant, joint_poles(spec.plant)).narrowed(inverse)
    damping, pace = spec.knob("damping"), spec.knob("disturbance")
    delays = [model.dead_time + pi_delay(pole, damping * DAMPING) for pole in model.poles]
    return ModelFollowing(
        make_parts(spec, model, gravity, delays if ahead else None),
        make_model_loop(model, damping * DAMPING),
        make_loop(model, lambda pole: robust_controller(kind, pole=pace * pole)),
    )


NARROW = 0.7
"""Width of the mismatched inverse's hysteresis over the identified width."""
FOLLOWING = partial(
    JOINT_ENTRY,
    feedback=True,
    citation="fluidic_muscles; skoczowski2005; packard1993",
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
