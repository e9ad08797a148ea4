"""PI control of the knee's tension, SIMC tuning from the nominal plant (skogestad2003).

Tuning: :mod:`baselines.linear.pid` for a lag with dead time and ``tau_c = theta``, with K the
steepest static tension per pressure of the nominal orthosis. For a regulator with lag, tau_1 is its
time constant and theta its dead time and one and a half control periods. For the published
dynamics, whose 0.3 s are distributed over seven poles, the half rule assigns half of their sum to
each of the two. The knobs scale ``K_c`` itself, in place of ``tau_c``: with the dead time in the
rule's denominator no ``tau_c`` doubles ``K_c``, and searches ended on that bound.

The reference tension is tracked in stance and in swing; there is no second controller. The setpoint
changes no faster than the pressure can, so that the rate limit saturates the command and not the
plant.
"""

from dataclasses import dataclass

from numpy.typing import ArrayLike

from baselines.core.entry import AS_DESIGNED, KNEE, Bounds, Entry, Knobs, Spec
from baselines.knee.nominal import (
    KneeNominal,
    KneeObserver,
    Limits,
    make_knee_observer,
    set_point_limits,
)
from baselines.knee.published import printed_plant
from baselines.linear.pid import DELAY_PERIODS, Gains, Pid, PidView, simc_rule
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis

KNOBS: Bounds = {"gain": (0.25, 6.0), "integral_time": (0.25, 16.0)}
"""Factors on ``K_c`` and ``tau_I``."""


def simc_tension(plant: KneeOrthosis, knobs: Knobs = AS_DESIGNED) -> Gains:
    """Return the gains [Pa/N] of the rule for a nominal orthosis; see the module."""
    period, tau = plant.control_period, plant.regulator.time_constant
    theta = DELAY_PERIODS * period + plant.dead_time
    if plant.dynamics == "measured":
        tau = 0.5 * _sum_of_lags()
        theta = theta + tau
    law = simc_rule(KneeNominal(plant).steepest_gain, tau, 0.0, theta, knobs=knobs)
    return law._replace(gain=knobs.get("gain", 1.0) * law.gain).parallel(period)


def _sum_of_lags() -> float:
    """Return the lag [s] of the published dynamics at low frequencies."""
    plant = printed_plant()
    return float((sum(1.0 / -p for p in plant.poles()) - sum(1.0 / -z for z in plant.zeros())).real)


@dataclass(frozen=True)
class TensionView:
    """View of tension, setpoint and reference tension, with the limits of the setpoint."""

    observer: KneeObserver
    within: Limits

    def __call__(self, observation: ArrayLike) -> PidView:
        """Return the PID's view of an observation."""
        seen = self.observer.read(observation)
        return PidView(seen.set_point, seen.tension, seen.reference, *self.within(seen))


def make_knee_pid(spec: Spec[KneeOrthosis]) -> Pid:
    """Return the controller."""
    signal = spec.actions["pressure_set_point"]
    view = TensionView(make_knee_observer(spec), set_point_limits(spec))
    return Pid(simc_tension(spec.plant, spec.knobs), view, signal, spec.plant.control_period)


ENTRIES = {
    "knee_pid": Entry(
        "PI of the tension, SIMC tuning",
        "nominal model",
        make_knee_pid,
        feedback=True,
        citation="skogestad2003",
        envs=KNEE,
        plants=(KneeOrthosis,),
        knobs=KNOBS,
    ),
}
