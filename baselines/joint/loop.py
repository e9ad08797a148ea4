"""Linear feedback of the joints' angles, with anti-windup by a model of the motion.

A model of the motion runs beside every controller, driven by the difference between the applied
command and the controller's own (:mod:`baselines.linear.bumpless` with gains of 0). The controller
thus sees the angle that its own command would have given: it does not wind up at a limit, and an
episode starts from the present command.

The PI of fluidic_muscles (section 4) puts its zero on one of the two poles ``p`` of the nominal
plant ``K p^2 / (s + p)^2``, so that the loop is ``K_p K p^2 / (s (s + p))``, and takes the gain
for a damping ``D``: ``K_p K = 1 / (4 D^2)``, ``K_i = p K_p``. At ``D = 1/sqrt(2)`` and 23 rad/s
they are 0.5 and 11.5 1/s. The slow PI cancels the pole too, with the crossover required of the
disturbance loop, ``K_i K = 4 rad/s`` (in proportion to ``p`` for other poles).

The model loop of model-following control is computed and not measured: it runs in continuous time,
with the reference held over a period, and its mean command over the period is applied. Joint and
model of the joint both receive that mean, so that they differ only by the model error.

A PI in feedback has only the samples: by the bilinear rule at 10 ms it overshoots by 6.1 % instead
of 4.3 % on the nominal plant. A comparison of the two includes the effect of sampling; to exclude
it, run the single PI at 1 ms, which is practically continuous.

Limits act on the command after the model loop: the loop itself is unlimited, and the subsequent
model, which receives the limited command, lags. Nothing winds up.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from baselines.joint.model import POLE, JointModel
from baselines.linear.bumpless import Bumpless, BumplessGains
from baselines.linear.systems import DiscreteSystem, StateSpace, discrete, double_lag, state_space

DAMPING = 1.0 / math.sqrt(2.0)
SLOW_CROSSOVER = 4.0
"""Crossover of the slow PI [rad/s] at poles of 23 rad/s."""


class PiGains(NamedTuple):
    """Gains of a PI: proportional [1] and integral [1/s]."""

    proportional: float
    integral: float


def pole_cancelling(gain: float = 1.0, pole: float = POLE, damping: float = DAMPING) -> PiGains:
    """Return the gains that cancel a pole [rad/s] and give a damping; see this module's page."""
    proportional = 1.0 / (4.0 * damping**2 * gain)
    return PiGains(proportional, proportional * pole)


def slow_gains(gain: float = 1.0, pole: float = POLE) -> PiGains:
    """Return the gains of the slow PI; see this module's page."""
    proportional = SLOW_CROSSOVER / (POLE * gain)
    return PiGains(proportional, proportional * pole)


def pi_system(gains: PiGains) -> StateSpace:
    """Return ``K_p + K_i / s``."""
    return state_space([[0.0]], [1.0], [gains.integral], gains.proportional)


def make_loop(model: JointModel, controller: Callable[[float], StateSpace]) -> Bumpless:
    """Return loops on the nominal model of each joint, from its pole [rad/s] to its controller."""
    loops = [discrete(controller(pole), model.period) for pole in model.poles]
    gains = BumplessGains(np.zeros_like(model.motion.b))
    return Bumpless(DiscreteSystem.stacked(loops), model.motion, gains, model.low, model.high)


def make_model_loop(model: JointModel, damping: float = DAMPING) -> DiscreteSystem:
    """Return the closed loops of PI and model for each joint, from reference to mean command."""
    loops = []
    for pole in model.poles:
        pi = pi_system(pole_cancelling(pole=pole, damping=damping))
        loops.append(_averaged_hold(pi.feedback(double_lag(pole)), model.period))
    return DiscreteSystem.stacked(loops)


def _averaged_hold(system: StateSpace, period: float) -> DiscreteSystem:
    """Return the system at a period [s], exact for a held input, with the mean output over it."""
    n = system.nstates
    whole = np.zeros((n + 2, n + 2))  # states, held input, integral of the output
    whole[:n, : n + 1] = np.hstack([system.A, system.B])
    whole[n + 1, : n + 1] = np.hstack([system.C, system.D])
    moved = expm(whole * period)
    mean = moved[n + 1] / period
    return DiscreteSystem(moved[:n, :n], moved[:n, n], mean[:n], np.asarray(mean[n]), period)
