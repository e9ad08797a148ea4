"""Feedback of the joints' angles without a model of the hysteresis: PI, slow PI and PID.

PI and slow PI: :mod:`baselines.joint.loop`; fluidic_muscles, section 4, with the gain of the
nominal plant between the tips of the hysteresis loop.

PID: SIMC (:mod:`baselines.linear.simc`) for both lags ``1 / p`` and the gain of the nominal plant,
in its cascade form, the derivative on the measurement. For one stage, whose two poles are real,
``tau_c = theta`` as the rule recommends. In an arm the double pole approximates a joint that
oscillates and is coupled to the others, which the rule does not cover: there the closed loop is at
most twice as fast as the joint, ``tau_c = max(theta, 1 / (2 p))``. The smooth PID is as fast as the
plant, ``tau_c = 1 / p``.

For a straight arm of six joints without friction the PID has a phase margin of 18 degrees at the
base (3 with 0.1 kg at the tip), the smooth PID 39 (18), the PI 56 (31). With ``tau_c = theta`` it
would be unstable. The lower gain of the hysteresis after a reversal, and its friction, increase the
margins of the true arm.

With preview, a loop tracks the reference later by its own delay (:mod:`baselines.joint.preview`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Array, Prediction, RowController
from baselines.core.entry import Entry
from baselines.core.environments import JOINT
from baselines.core.knobs import AS_DESIGNED, Knobs
from baselines.joint.gravity import Gravity
from baselines.joint.loop import (
    SLOW_CROSSOVER,
    PiGains,
    make_loop,
    pi_system,
    pole_cancelling,
    slow_gains,
)
from baselines.joint.model import POLE, JointModel, joint_model
from baselines.joint.poles import joint_poles
from baselines.joint.preview import KNOBS, Lookahead, double_pole_delays, lookahead_for
from baselines.joint.view import JointSignalMap, make_joint_signal_map
from baselines.linear.bumpless import Bumpless, BumplessState
from baselines.linear.simc import DELAY_PERIODS, PID_KNOBS, Simc, simc_rule
from baselines.linear.systems import DiscreteSystem, discrete, from_polynomials
from pam_envs.parameters import Signals
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator

if TYPE_CHECKING:
    from control import StateSpace

FILTER = 8.0
"""Derivative time over the time constant of its filter."""
Kind = Literal["pi", "pi_slow", "pid", "pid_smooth"]


def closed_loop_time(pole: float, dead_time: float, in_arm: bool, smooth: bool = False) -> float:
    """Return ``tau_c`` [s] for a joint with a pole [rad/s]; see the module."""
    if smooth:
        return 1.0 / pole
    return max(dead_time, 0.5 / pole) if in_arm else dead_time


def simc_joint(
    gain: float,
    pole: float,
    period: float,
    in_arm: bool = False,
    smooth: bool = False,
    knobs: Knobs = AS_DESIGNED,
) -> Simc:
    """Return the parameters of the rule for a joint; see the module.

    Parameters
    ----------
    gain : float
        Of the nominal plant.
    pole : float
        [rad/s].
    period : float
        Control period [s].
    in_arm : bool
        Whether the joint belongs to an arm.
    smooth : bool
        Whether the closed loop is as fast as the plant.
    knobs : mapping
        Of :data:`baselines.linear.simc.PID_KNOBS`.
    """
    lag, wait = 1.0 / pole, DELAY_PERIODS * period
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

    The sum of the ramp error ``tau_I / (K_c K)`` and the lag of the reference filter.
    """
    ramp = law.integral_time / (law.gain * gain)
    return ramp + law.derivative_time * (1.0 - 1.0 / FILTER)


class FeedbackState(NamedTuple):
    """States of the loops and of the reference filters."""

    loop: BumplessState
    reference: Array


@dataclass(frozen=True)
class JointFeedback(RowController):
    """A loop for every joint.

    Attributes
    ----------
    model : JointModel
    loop : Bumpless
    signals : JointSignalMap
    gravity : Gravity
    lookahead : Lookahead
    prefilter : DiscreteSystem or None
        On the reference.
    """

    model: JointModel
    loop: Bumpless
    signals: JointSignalMap
    gravity: Gravity
    lookahead: Lookahead
    prefilter: DiscreteSystem | None = None

    def initial_state(self, observation: ArrayLike) -> FeedbackState:
        """See :class:`~baselines.core.controller.RowController`."""
        view = self.signals.read(observation)
        held = view.set_point - self.gravity.shift(view.angle, view.payload)
        return FeedbackState(self.loop.holding_state(held), self._rest(view.angle))

    def respond(self, observation: ArrayLike, state: FeedbackState) -> Prediction:
        """See :class:`~baselines.core.controller.RowController`."""
        view = self.signals.read(observation)
        shift = self.gravity.shift(view.reference, view.payload)
        aim = self.lookahead.reference(view.samples)
        reference, filtered = self._filtered(aim, state.reference)
        low, high = self.model.low - shift, self.model.high - shift
        command = self.loop.output(reference, view.angle, state.loop, low, high)
        loop = self.loop.advance(reference, view.angle, command, state.loop)
        return self.signals.write(command + shift, observation), FeedbackState(loop, filtered)

    def _rest(self, angle: Array) -> Array:
        return self.prefilter.rest_state(angle) if self.prefilter else np.zeros((*angle.shape, 0))

    def _filtered(self, reference: Array, state: Array) -> tuple[Array, Array]:
        if self.prefilter is None:
            return reference, state
        return self.prefilter.output(reference, state), self.prefilter.advance(reference, state)


def make_joint_feedback(
    plant: Any,
    signals: Signals,
    action_signals: Signals,
    kind: Kind = "pi",
    gravity: bool = False,
    ahead: bool = False,
    knobs: Knobs = AS_DESIGNED,
) -> JointFeedback:
    """Return the controller.

    Parameters
    ----------
    plant : AntagonisticJoint or RedundantManipulator
        Nominal plant.
    signals, action_signals : Signals
    kind : {"pi", "pi_slow", "pid", "pid_smooth"}
    gravity : bool
        Whether the set-points compensate the weight of the links and of the declared payload.
    ahead : bool
        Whether the reference is previewed by the loop's own delay.
    knobs : mapping
        Of :data:`baselines.linear.simc.PID_KNOBS` (PID only), and of
        :data:`baselines.joint.preview.KNOBS`.
    """
    model = joint_model(plant, poles=joint_poles(plant)).narrowed(0.0)
    made = make_joint_signal_map(signals, action_signals)
    loops = _loops(model, kind, plant.stages > 1, knobs)
    carried = Gravity(plant if gravity else None)
    lookahead = lookahead_for(made, loops.delays if ahead else None, model.period, knobs)
    return JointFeedback(model, loops.loop, made, carried, lookahead, loops.prefilter)


class Loops(NamedTuple):
    """The loops of a nominal model.

    Attributes
    ----------
    loop : Bumpless
    delays : sequence of float
        Of the closed loops [s], for slow references.
    prefilter : DiscreteSystem or None
        On the references.
    """

    loop: Bumpless
    delays: Sequence[float]
    prefilter: DiscreteSystem | None = None


def _loops(model: JointModel, kind: Kind, in_arm: bool, knobs: Knobs) -> Loops:
    if kind == "pi":
        return Loops(_pi(model, pole_cancelling), double_pole_delays(model.poles))
    if kind == "pi_slow":
        return Loops(
            _pi(model, slow_gains), [POLE / (SLOW_CROSSOVER * pole) for pole in model.poles]
        )

    def rule(pole: float) -> Simc:
        return simc_joint(model.gain, pole, model.period, in_arm, kind == "pid_smooth", knobs)

    laws = [rule(pole) for pole in model.poles]
    filters = [discrete(reference_filter(law), model.period) for law in laws]
    loop = make_loop(model, lambda pole: pid_system(rule(pole)))
    return Loops(
        loop, [pid_delay(law, model.gain) for law in laws], DiscreteSystem.stacked(filters)
    )


def _pi(model: JointModel, gains: Callable[[float, float], PiGains]) -> Bumpless:
    return make_loop(model, lambda pole: pi_system(gains(model.gain, pole)))


FEEDBACK = partial(
    Entry,
    knowledge="nominal model",
    feedback=True,
    envs=JOINT,
    plants=(AntagonisticJoint, RedundantManipulator),
)
PI = partial(FEEDBACK, citation="fluidic_muscles")
PID = partial(FEEDBACK, citation="skogestad2003")
PREVIEW = partial(make_joint_feedback, gravity=True, ahead=True)
ENTRIES = {
    "joint_pi": PI(
        "PI by pole cancellation, damping 0.71, as in the paper",
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
        knobs=KNOBS,
    ),
    "joint_pid": PID(
        "PID, SIMC tuning with tau_c = theta; in an arm at most twice as fast as the joint",
        make=partial(make_joint_feedback, kind="pid"),
        knobs=PID_KNOBS,
    ),
    "joint_pid_smooth": PID(
        "PID, SIMC tuning, closed loop as fast as the plant",
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
        knobs={**PID_KNOBS, **KNOBS},
    ),
    "joint_pid_smooth_ahead": PID(
        "joint_pid_smooth with gravity feedforward and a reference previewed by its own delay",
        make=partial(PREVIEW, kind="pid_smooth"),
        preview=True,
        knobs={**PID_KNOBS, **KNOBS},
    ),
}
