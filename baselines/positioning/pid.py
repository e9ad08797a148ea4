"""PID control of the contraction, SIMC tuning from the nominal plant (skogestad2003).

SIMC for a second-order plant with dead time (:mod:`baselines.linear.pid`), with K the steepest
static gain of the nominal muscle over its stroke (so that the loop is stable at the steepest
point), tau_1 the regulator's lag, tau_2 the lag of the mass, and theta the regulator's dead time,
half a control period of the hold, and one of computing. tau_c = theta, increased only where the
bandwidth would otherwise come within a factor of ``SWING`` of the natural frequency of the load on
the muscle, which the rule's real lags do not describe.

The regulator's slew limit causes windup like its range. The distance of the setpoint from the
*measured* pressure is therefore limited to ``REACH`` times the smallest lead that keeps the nominal
regulator at its slew limit.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Reader, reader
from baselines.core.entry import AS_DESIGNED, Bounds, Entry, Knobs, Spec
from baselines.linear.pid import DELAY_PERIODS, FILTER, PID_KNOBS, Gains, Pid, PidView, simc_rule
from baselines.positioning.nominal import Nominal
from pam_envs.parameters import Signal
from pam_envs.plants.single_muscle.plant import SingleMuscle

SWING = 4.0
"""Least natural frequency of the load over the loop's bandwidth ``1 / (tau_c + theta)``."""

REACH = 1.5
"""Margin for a regulator slower than the nominal one; the overshoot of a step increases with it
(0.5 % of the step at 1, 10 % at 1.5, 25 % at 2)."""
KNOBS: Bounds = {**PID_KNOBS, "reach": (0.67, 2.0)}


def simc(
    plant: SingleMuscle, closed_loop_time: float | None = None, knobs: Knobs = AS_DESIGNED
) -> Gains:
    """Return the gains [Pa/m] of the rule; ``closed_loop_time`` replaces ``tau_c`` [s]."""
    nominal, period = Nominal(plant), plant.control_period
    theta = plant.regulator.dead_time + DELAY_PERIODS * period
    tau_1, tau_2 = plant.regulator.time_constant, nominal.mechanical_lag
    tau_c = max(theta, SWING / nominal.slowest_swing - theta)
    if closed_loop_time is not None:
        tau_c = closed_loop_time
    law = simc_rule(nominal.steepest_gain, tau_1, tau_2, theta, tau_c, knobs)
    return law.parallel(max(tau_2 / FILTER, 0.5 * period))


@dataclass(frozen=True)
class MuscleView:
    """View of contraction, pressure, setpoint and reference.

    ``reach`` is the largest distance [Pa] of the setpoint from the measured pressure.
    """

    reader: Reader
    action_signal: Signal
    reach: float

    def __call__(self, observation: ArrayLike) -> PidView:
        """Return the PID's view of an observation."""
        contraction, pressure, set_point, reference = self.reader.rows(observation)
        low = np.maximum(pressure - self.reach, self.action_signal.low)
        high = np.minimum(pressure + self.reach, self.action_signal.high)
        return PidView(set_point, contraction, reference, low, high)


def make_pid(spec: Spec[SingleMuscle]) -> Pid:
    """Return the controller; its knob "reach" is a factor on the margin ``REACH``."""
    law, signal = spec.plant.regulator, spec.actions["pressure_set_point"]
    view = MuscleView(
        reader(spec.signals, ["contraction", "pressure", "set_point", "reference"]),
        signal,
        spec.knob("reach") * REACH * law.slew_rate * (law.dead_time + law.time_constant),
    )
    return Pid(simc(spec.plant, knobs=spec.knobs), view, signal, spec.plant.control_period)


ENTRIES = {
    "pid": Entry(
        "PID on the present error, SIMC tuning",
        "nominal model",
        make_pid,
        feedback=True,
        citation="skogestad2003",
        plants=(SingleMuscle,),
        knobs=KNOBS,
    ),
}
