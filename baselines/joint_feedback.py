"""Single loops on the angles of joints, without a model of the memory: PI, slow PI and PID.

PI and slow PI: see :mod:`baselines.joint_loop`; seed 002, section 4, with the gain of the nominal
plant between the tips of the hysteresis loop.

PID: SIMC for two lags and a dead time (S. Skogestad, "Simple analytic rules for model reduction and
PID controller tuning", J. Process Control 13 (2003) 291-309), cascade form

    K_c = tau_1 / (K (tau_c + theta)),  tau_I = min(tau_1, 4 (tau_c + theta)),  tau_D = tau_2

with both lags ``1 / p``, the gain ``K`` of the nominal plant, ``theta`` one and a half control
periods for hold and computing, and for the rule's one choice the closed loop as fast as the plant,
``tau_c = 1 / p``: the gain of the hysteresis is uncertain by a third, and what lies beyond the two
poles is not known. The derivative acts on the measurement.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.controller import Answer, Array, beginning, choose
from baselines.joint_bank import Bank
from baselines.joint_gravity import Gravity
from baselines.joint_loop import (
    JointLoop,
    LoopState,
    make_loop,
    pi_system,
    pole_cancelling,
    slow_gains,
)
from baselines.joint_model import JointModel, joint_model
from baselines.joint_poles import joint_poles
from baselines.joint_view import JointEyes, make_joint_eyes
from baselines.linear import LinearSystem
from pam_envs.parameters import Signals

FILTER = 8.0
"""Derivative time over the time constant of its filter."""
Kind = Literal["pi", "pi_slow", "pid"]


class Simc(NamedTuple):
    """Parameters of the cascade form: gain [1], integral and derivative time [s]."""

    gain: float
    integral_time: float
    derivative_time: float


def simc_joint(gain: float, pole: float, period: float) -> Simc:
    """Return the parameters of the rule for a joint; see this module's page.

    Parameters
    ----------
    gain : float
        Of the nominal plant.
    pole : float
        [rad/s].
    period : float
        Control period [s].
    """
    lag, wait = 1.0 / pole, 1.5 * period
    pace = lag + wait
    return Simc(lag / (gain * pace), min(lag, 4.0 * pace), lag)


def pid_system(law: Simc) -> LinearSystem:
    """Return ``K_c (1 + 1 / (tau_I s)) (1 + tau_D s) / (1 + tau_D s / FILTER)``."""
    top = np.polymul([law.integral_time, 1.0], [law.derivative_time, 1.0])
    low = np.polymul([law.integral_time, 0.0], [law.derivative_time / FILTER, 1.0])
    return LinearSystem.from_polynomials(law.gain * top, low)


def reference_filter(law: Simc) -> LinearSystem:
    """Return what takes the derivative off the reference."""
    return LinearSystem.from_polynomials(
        [law.derivative_time / FILTER, 1.0], [law.derivative_time, 1.0]
    )


class FeedbackState(NamedTuple):
    """Memories of the loops and of the reference's filters."""

    loop: LoopState
    reference: Array


@dataclass(frozen=True)
class JointFeedback:
    """A loop for every joint.

    Attributes
    ----------
    model : JointModel
    loop : JointLoop
    eyes : JointEyes
    gravity : Gravity
    prefilter : Bank or None
        On the reference.
    """

    model: JointModel
    loop: JointLoop
    eyes: JointEyes
    gravity: Gravity
    prefilter: Bank | None = None

    def predict(
        self,
        observation: ArrayLike,
        state: FeedbackState | None = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Answer:
        """Return the set-points; see :class:`~baselines.controller.Controller`."""
        view = self.eyes.look(observation)
        begin = beginning(state, episode_start, len(view.angle))
        if state is None or begin.any():
            held = view.set_point - self.gravity.shift(view.angle, view.payload)
            fresh = FeedbackState(self.loop.start(held), self._rest(view.angle))
            state = choose(begin, fresh, state)
        shift = self.gravity.shift(view.reference, view.payload)
        wanted, filtered = self._filtered(view.reference, state.reference)
        low, high = self.model.low - shift, self.model.high - shift
        command = self.loop.output(wanted, view.angle, state.loop, low, high)
        loop = self.loop.advance(wanted, view.angle, command, state.loop)
        return self.eyes.act(command + shift, observation), FeedbackState(loop, filtered)

    def _rest(self, angle: Array) -> Array:
        return self.prefilter.rest(angle) if self.prefilter else np.zeros((*angle.shape, 0))

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
) -> JointFeedback:
    """Return the controller.

    Parameters
    ----------
    plant : AntagonisticJoint or RedundantManipulator
        Nominal plant.
    signals, action_signals : Signals
    kind : {"pi", "pi_slow", "pid"}
    gravity : bool
        Whether the set-points carry the weight of the links and the payload that is told.
    """
    model = joint_model(plant, poles=joint_poles(plant)).narrowed(0.0)
    eyes = make_joint_eyes(signals, action_signals)
    return joint_feedback(model, eyes, Gravity(plant if gravity else None), kind)


def joint_feedback(
    model: JointModel, eyes: JointEyes, gravity: Gravity, kind: Kind
) -> JointFeedback:
    """Return the controller of a nominal model."""
    if kind != "pid":
        gains = pole_cancelling if kind == "pi" else slow_gains

        def law(pole: float) -> LinearSystem:
            return pi_system(gains(model.gain, pole))

        return JointFeedback(model, make_loop(model, law), eyes, gravity)

    def rule(pole: float) -> Simc:
        return simc_joint(model.gain, pole, model.period)

    filters = [reference_filter(rule(pole)).discrete(model.period) for pole in model.poles]
    loop = make_loop(model, lambda pole: pid_system(rule(pole)))
    return JointFeedback(model, loop, eyes, gravity, Bank.of(filters))
