"""Inverse of the joint with a disturbance observer (ohnishi1996, chen2016).

    d = Q (phi - phi_mod),   phi_mod = G H u,   u = H^-1(r - d) + gravity feedforward

The model of the joint, hysteresis and motion behind the dead time, receives the applied setpoint.
What the angle differs from it is a disturbance at the output: a payload, friction, a wrong loop.
Filtered by a first-order lag ``Q``, it is subtracted from the reference before the inverse. With an
exact model there is no feedback; with a static error of the model the angle still settles on the
reference. For a plant of gain ``g`` over the model's and delay ``theta`` the loop is
``(g - 1) e^(-s theta) / (1 + T s)``: stable for every time constant ``T`` while ``g`` is between 0
and 2. A wrong delay excites it at frequencies above ``1 / T``, so that the observer is slower than
the joint's delay by ``SLOWER``.
"""

import math
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction
from baselines.core.entry import JOINT, Bounds, Spec
from baselines.joint.base import JOINT_ENTRY, PREVIEW_KNOBS, JointController, make_parts
from baselines.joint.model import joint_delays, joint_model, joint_poles
from pam_envs.arrays import Array
from pam_envs.hysteresis.protocol import RowsState

SLOWER = 2.0
"""Time constant of the observer over the delay of the joint."""
KNOBS: Bounds = {**PREVIEW_KNOBS, "observer": (0.4, 4.0)}


class ObserverState(NamedTuple):
    """States of the motion's model and of the hysteresis, and disturbance [rad]."""

    motion: Array
    hysteresis: RowsState
    disturbance: Array


@dataclass(frozen=True)
class JointObserver(JointController):
    """Inverse and disturbance observer; ``share`` of a difference that enters in a period."""

    share: Array

    def initial_state(self, observation: ArrayLike) -> ObserverState:
        """Return the state of joints at rest at the present angle and setpoint."""
        (view, without), model = self.start(observation), self.parts.model
        _, hysteresis = model.start(without)
        motion = model.motion.rest_state(view.angle)
        return ObserverState(motion, hysteresis, np.zeros_like(view.angle))

    def respond(self, observation: ArrayLike, state: ObserverState) -> Prediction:
        """Return the action and the next state."""
        (view, reference, shift), model = self.read(observation), self.parts.model
        off = view.angle - self.model_output(state)
        disturbance = state.disturbance + self.share * (off - state.disturbance)
        found = model.inverse(reference - disturbance, state.hysteresis) + shift
        set_point = np.clip(found, model.low, model.high)
        held, hysteresis = model.forward(set_point - shift, state.hysteresis)
        motion = model.motion.advance(held, state.motion)
        after = ObserverState(motion, hysteresis, disturbance)
        return self.parts.signals.write(set_point, observation), after

    def model_output(self, state: ObserverState) -> Array:
        """Return the model's angles [rad], shape (n_env, n_joints)."""
        return self.parts.model.motion.output(np.zeros(state.motion.shape[:-1]), state.motion)


def make_joint_observer(spec: Spec[Any]) -> JointObserver:
    """Return the controller."""
    model, delays = joint_model(spec.plant, joint_poles(spec.plant)), joint_delays(spec.plant)
    times = [spec.knob("observer") * SLOWER * delay for delay in delays]
    share = np.array([-math.expm1(-model.period / time) for time in times])
    return JointObserver(make_parts(spec, model, True, delays), share)


ENTRIES = {
    "joint_inverse_dob": partial(JOINT_ENTRY, preview=True, feedback=True, envs=JOINT[:1])(
        "joint_inverse_ahead with a disturbance observer",
        make=make_joint_observer,
        citation="fluidic_muscles; ohnishi1996; chen2016",
        knobs=KNOBS,
    ),
}
