"""Feedback of the joints' angles without a model of the hysteresis: PI, slow PI and PID.

PI and slow PI: :mod:`baselines.joint.model`; fluidic_muscles, section 4, with the gain of the
nominal plant between the tips of the hysteresis loop. The slow PI, at 4 rad/s, ignores the dead
time.

PID: SIMC (:mod:`baselines.linear.pid`) for both lags ``1 / p`` and the gain of the nominal plant,
in its cascade form, the derivative on the measurement. For one stage, whose two poles are real,
``tau_c = theta`` as the rule recommends. In an arm the double pole approximates a joint that
oscillates and is coupled to the others, which the rule does not cover: there the joint's lag is
added, ``tau_c = theta + 1 / p``. The smooth PID is slower by one lag more.

For a straight arm of six joints without friction the PID has a phase margin of 56 degrees at the
base (20 with 0.1 kg at the tip), the smooth PID 76 (76), the PI 62 (55). With ``tau_c = theta`` it
would be unstable. The lower gain of the hysteresis after a reversal, and its friction, increase the
margins of the true arm.

With preview, a loop tracks the reference later by its own delay (:mod:`baselines.joint.base`).
"""

from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction
from baselines.core.entry import AS_DESIGNED, Knobs, Spec
from baselines.joint.base import JOINT_ENTRY, PREVIEW_KNOBS, JointController, make_parts
from baselines.joint.model import (
    DAMPING,
    SLOW_DAMPING,
    joint_model,
    joint_poles,
    make_loop,
    pi_delay,
    pi_system,
    pole_cancelling,
)
from baselines.linear.bumpless import Bumpless, BumplessState
from baselines.linear.pid import DELAY_PERIODS, FILTER, PID_KNOBS, Simc, simc_rule
from baselines.linear.systems import DiscreteSystem, StateSpace, discrete, from_polynomials
from pam_envs.arrays import Array

Kind = Literal["pi", "pi_slow", "pid", "pid_smooth"]


def closed_loop_time(pole: float, dead_time: float, in_arm: bool, smooth: bool = False) -> float:
    """Return ``tau_c`` [s] for a joint with a pole [rad/s] and ``theta`` [s]; see the module."""
    return dead_time + (int(in_arm) + int(smooth)) / pole


def simc_joint(
    gain: float,
    pole: float,
    period: float,
    in_arm: bool = False,
    smooth: bool = False,
    knobs: Knobs = AS_DESIGNED,
    dead_time: float = 0.0,
) -> Simc:
    """Return the parameters of the rule for a joint with a pole [rad/s]; see the module.

    ``smooth``: whether the closed loop is as fast as the plant.
    """
    lag, wait = 1.0 / pole, DELAY_PERIODS * period + dead_time
    pace = closed_loop_time(pole, wait, in_arm, smooth)
    return simc_rule(gain, lag, lag, wait, pace, knobs)


def pid_system(law: Simc) -> StateSpace:
    """Return ``K_c (1 + 1 / (tau_I s)) (1 + tau_D s) / (1 + tau_D s / FILTER)``."""
    top = np.polymul([law.integral_time, 1.0], [law.derivative_time, 1.0])
    low = np.polymul([law.integral_time, 0.0], [law.derivative_time / FILTER, 1.0])
    return from_polynomials(law.gain * top, low)


def reference_filter(law: Simc) -> StateSpace:
    """Return the reference filter that removes the derivative action on the reference."""
    return from_polynomials([law.derivative_time / FILTER, 1.0], [law.derivative_time, 1.0])


def pid_delay(law: Simc, gain: float) -> float:
    """Return the delay [s] of the PID's closed loop for slow references.

    It is the sum of the ramp error ``tau_I / (K_c K)`` and the lag of the reference filter.
    """
    ramp = law.integral_time / (law.gain * gain)
    return ramp + law.derivative_time * (1.0 - 1.0 / FILTER)


class FeedbackState(NamedTuple):
    """States of the loops and of the reference filters."""

    loop: BumplessState
    reference: Array


@dataclass(frozen=True)
class JointFeedback(JointController):
    """A feedback loop for every joint, after a reference filter."""

    loop: Bumpless
    prefilter: DiscreteSystem

    def initial_state(self, observation: ArrayLike) -> FeedbackState:
        """Return the state that holds the present setpoint."""
        view, held = self.start(observation)
        return FeedbackState(self.loop.holding_state(held), self.prefilter.rest_state(view.angle))

    def respond(self, observation: ArrayLike, state: FeedbackState) -> Prediction:
        """Return the action and the next state."""
        (view, aim, shift), model = self.read(observation), self.parts.model
        reference, filtered = self.prefilter.step(aim, state.reference)
        low, high = model.low - shift, model.high - shift
        command = self.loop.output(reference, view.angle, state.loop, low, high)
        after = FeedbackState(
            self.loop.advance(reference, view.angle, command, state.loop), filtered
        )
        return self.parts.signals.write(command + shift, observation), after


def make_joint_feedback(
    spec: Spec[Any], kind: Kind = "pi", gravity: bool = False, ahead: bool = False
) -> JointFeedback:
    """Return the controller, optionally with gravity feedforward and preview of its own delay."""
    plant, in_arm = spec.plant, spec.plant.stages > 1
    model = joint_model(plant, joint_poles(plant)).narrowed(0.0)
    prefilter = DiscreteSystem.identity(len(model.poles), model.period)
    if kind in ("pi", "pi_slow"):
        damping = SLOW_DAMPING if kind == "pi_slow" else DAMPING
        late = model.dead_time if kind == "pi" else 0.0
        loop = make_loop(model, lambda p: pi_system(pole_cancelling(model.gain, p, damping, late)))
        delays = [pi_delay(pole, damping, late) for pole in model.poles]
    else:

        def rule(pole: float) -> Simc:
            smooth = kind == "pid_smooth"
            return simc_joint(
                model.gain, pole, model.period, in_arm, smooth, spec.knobs, model.dead_time
            )

        laws = [rule(pole) for pole in model.poles]
        filters = [discrete(reference_filter(law), model.period) for law in laws]
        prefilter = DiscreteSystem.stacked(filters)
        loop = make_loop(model, lambda pole: pid_system(rule(pole)))
        delays = [pid_delay(law, model.gain) for law in laws]
    return JointFeedback(
        make_parts(spec, model, gravity, delays if ahead else None), loop, prefilter
    )


PI = partial(JOINT_ENTRY, feedback=True)
PID = partial(JOINT_ENTRY, feedback=True, citation="skogestad2003")
PREVIEW = partial(make_joint_feedback, gravity=True, ahead=True)
ENTRIES = {
    "joint_pi": PI(
        "PI by pole cancellation, damping 0.71, as in the paper; the dead time counts as a lag",
        make=partial(make_joint_feedback, kind="pi"),
    ),
    "joint_pi_slow": PI(
        "PI by pole cancellation, crossover 4 rad/s",
        make=partial(make_joint_feedback, kind="pi_slow"),
    ),
    "joint_pi_ahead": PI(
        "joint_pi with gravity feedforward and a reference previewed by its own delay",
        make=partial(PREVIEW, kind="pi"),
        preview=True,
        knobs=PREVIEW_KNOBS,
    ),
    "joint_pid": PID(
        "PID, SIMC tuning with tau_c = theta; in an arm slower by the joint's lag",
        make=partial(make_joint_feedback, kind="pid"),
        knobs=PID_KNOBS,
    ),
    "joint_pid_smooth": PID(
        "joint_pid with a closed loop slower by one lag",
        make=partial(make_joint_feedback, kind="pid_smooth"),
        knobs=PID_KNOBS,
    ),
    "joint_pid_gravity": PID(
        "joint_pid with gravity feedforward",
        make=partial(make_joint_feedback, kind="pid", gravity=True),
        knobs=PID_KNOBS,
    ),
    "joint_pid_ahead": PID(
        "joint_pid with gravity feedforward and a reference previewed by its own delay",
        make=partial(PREVIEW, kind="pid"),
        preview=True,
        knobs={**PID_KNOBS, **PREVIEW_KNOBS},
    ),
    "joint_pid_smooth_ahead": PID(
        "joint_pid_smooth with gravity feedforward and a reference previewed by its own delay",
        make=partial(PREVIEW, kind="pid_smooth"),
        preview=True,
        knobs={**PID_KNOBS, "derivative_time": (0.03, 16.0), **PREVIEW_KNOBS},
    ),
}
