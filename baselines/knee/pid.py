"""PI control of the knee's tension, SIMC tuning from the nominal plant (skogestad2003).

Tuning: :mod:`baselines.linear.simc` for a lag with dead time and ``tau_c = theta``, with K the
steepest static tension per pressure of the nominal orthosis. For a regulator with lag, tau_1 is its
time constant and theta one and a half control periods. For the published dynamics, whose 0.3 s are
distributed over seven poles, the half rule gives half of their sum to each.

The reference tension is tracked in stance and in swing: there is no second controller.
"""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, RowController, encode_action
from baselines.core.entry import Entry
from baselines.core.environments import KNEE
from baselines.core.knobs import AS_DESIGNED, Knobs
from baselines.knee.nominal import KneeNominal
from baselines.knee.published import printed_plant
from baselines.knee.view import KneeObserver, make_knee_observer
from baselines.linear.simc import DELAY_PERIODS, PI_KNOBS, simc_rule
from baselines.positioning.pid import Gains, PidState, pid_start, pid_step
from pam_envs.parameters import Signal, Signals
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis


def simc_tension(plant: KneeOrthosis, knobs: Knobs = AS_DESIGNED) -> Gains:
    """Return the gains [Pa/N] of the SIMC rule for a nominal orthosis; see the module.

    Its ``knobs`` are those of :data:`baselines.linear.simc.PI_KNOBS`.
    """
    period = plant.control_period
    theta, tau = DELAY_PERIODS * period, plant.regulator.time_constant
    if plant.dynamics == "measured":
        tau = 0.5 * _sum_of_lags()
        theta = theta + tau
    gain, reset, _ = simc_rule(KneeNominal(plant).steepest_gain, tau, 0.0, theta, knobs=knobs)
    return Gains(
        proportional=gain,
        integral=gain / reset,
        derivative=0.0,
        filter_time=period,
        tracking_time=reset,
    )


def _sum_of_lags() -> float:
    """Return the lag [s] of the published dynamics at low frequencies."""
    plant = printed_plant()
    return float((sum(1.0 / -p for p in plant.poles()) - sum(1.0 / -z for z in plant.zeros())).real)


@dataclass(frozen=True)
class KneePid(RowController):
    """PI of the sensed tension.

    Attributes
    ----------
    gains : Gains
    observer : KneeObserver
    action_signal : Signal
    period : float
        Control period [s].
    """

    gains: Gains
    observer: KneeObserver
    action_signal: Signal
    period: float

    def initial_state(self, observation: ArrayLike) -> PidState:
        """See :class:`~baselines.core.controller.RowController`."""
        view = self.observer.read(observation)
        return pid_start(view.set_point, view.tension)

    def respond(self, observation: ArrayLike, state: PidState) -> Prediction:
        """See :class:`~baselines.core.controller.RowController`."""
        view = self.observer.read(observation)
        low, high = self.action_signal.low, self.action_signal.high
        error = view.reference - view.tension
        output, after = pid_step(self.gains, state, error, view.tension, low, high, self.period)
        return encode_action(self.action_signal, output, observation), after


def make_knee_pid(
    plant: KneeOrthosis,
    signals: Signals,
    action_signals: Signals,
    gains: Gains | None = None,
    knobs: Knobs = AS_DESIGNED,
) -> KneePid:
    """Return the controller, with the gains of :func:`simc_tension` unless others are given."""
    return KneePid(
        simc_tension(plant, knobs) if gains is None else gains,
        make_knee_observer(KneeNominal(plant), signals),
        action_signals["pressure_set_point"],
        plant.control_period,
    )


ENTRIES = {
    "knee_pid": Entry(
        "PI of the tension, SIMC tuning",
        "nominal model",
        make_knee_pid,
        feedback=True,
        citation="skogestad2003",
        envs=KNEE,
        plants=(KneeOrthosis,),
        knobs=PI_KNOBS,
    ),
}
