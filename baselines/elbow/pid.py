"""PI control of the torque alone, and no word of stiffness.

Both pressures start from the same one and move against each other: bundle b up, bundle a down. The
torque that is fed back is the estimate from angle and pressures, since there is no sensor of it.
The pressure that both start from, a fifth of the largest, gives a stiffness amid those that the
tasks ask for; friction grows with it, so that a higher one makes the torque worse.
Tuning: SIMC for a lag (S. Skogestad, J. Process Control 13 (2003) 291-309) with the steepest torque
per pressure over the range, and the regulator's lag. On/off valves are no lag but a rate, of 3 bar
in 3 s: the rule is shown a plant with one cycle for its lag, which is a choice and no tuning by
rule. The dead time is half of what a command is held for, and a control period for a computer to
work it out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, reset_rows
from baselines.core.entry import Entry
from baselines.core.environments import ELBOW
from baselines.core.knobs import AS_DESIGNED, Bounds, Knobs, knob
from baselines.elbow.friction import ElbowFriction, make_elbow_friction
from baselines.elbow.valves import PressureLoop, make_pressure_loop
from baselines.elbow.view import ElbowSignalMap, ElbowView, make_elbow_signal_map
from baselines.linear.simc import PI_KNOBS, simc_rule
from baselines.positioning.nominal import HysteresisState
from baselines.positioning.pid import Gains, PidState, pid_start, pid_step
from pam_envs.parameters import Signals
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis

SHARE = 0.2
"""Pressure that both bundles start from, over the largest."""
KNOBS: Bounds = {**PI_KNOBS, "start": (0.5, 2.0)}
"""Those of the rule, and on the pressure that both start from."""


def simc_torque(plant: ElbowOrthosis, knobs: Knobs = AS_DESIGNED) -> Gains:
    """Return the gains [Pa/(N m)] of the SIMC rule; see this module's page."""
    angles, full = np.linspace(*plant.angle_range, 25), plant.full_pressure
    swing = plant.torque(angles, 0.0, full) - plant.torque(angles, full, 0.0)
    steepest = float(np.max(swing)) / full
    pulsed = plant.valves == "on_off"
    step = plant.cycle if pulsed else plant.control_period
    tau = step if pulsed else plant.regulator.time_constant
    theta = 0.5 * step + plant.control_period
    gain, reset, _ = simc_rule(steepest, tau, 0.0, theta, knobs=knobs)
    return Gains(
        proportional=gain,
        integral=gain / reset,
        derivative=0.0,
        filter_time=plant.control_period,
        tracking_time=reset,
    )


class ElbowPidState(NamedTuple):
    """The PI's state and the nominal hysteresis, first axis n_env."""

    pid: PidState
    hysteresis: HysteresisState


@dataclass(frozen=True)
class ElbowPid:
    """PI on the torque as estimated; see this module's page.

    Attributes
    ----------
    gains : Gains
    signals : ElbowSignalMap
    loop : PressureLoop or None
        Around the pressures of on/off valves; regulators have one inside.
    middle, full : float
        Pressure [Pa] that both start from, and the largest.
    period : float
        Control period [s].
    friction : ElbowFriction
        That is added to the estimate; none is if its hysteresis never lags.
    """

    gains: Gains
    signals: ElbowSignalMap
    loop: PressureLoop | None
    middle: float
    full: float
    period: float
    friction: ElbowFriction

    def predict(
        self,
        observation: ArrayLike,
        state: ElbowPidState | None = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Prediction:
        """Return the commands; see :class:`~baselines.core.controller.Controller`."""
        view = self.signals.read(observation)
        state = reset_rows(state, episode_start, len(view.angle), lambda: self._start(view))
        taken, hysteresis = self.friction.taken(view, state.hysteresis)
        torque, most = view.torque + self.friction.torque(view, taken), self.full
        error = view.wanted - torque
        shift, after = pid_step(self.gains, state.pid, error, torque, -most, most, self.period)
        wanted = np.clip(self.middle + np.array([-shift, shift]), 0.0, most)
        commands = wanted if self.loop is None else self.loop.commands(view, wanted)
        return self.signals.write(commands, observation), ElbowPidState(after, hysteresis)

    def _start(self, view: ElbowView) -> ElbowPidState:
        pid = pid_start(0.5 * np.diff(view.pressure, axis=0)[0], view.torque)
        return ElbowPidState(pid, self.friction.initial(len(view.angle)))


def make_elbow_pid(
    plant: ElbowOrthosis,
    signals: Signals,
    action_signals: Signals,
    gains: Gains | None = None,
    hysteresis: bool = False,
    knobs: Knobs = AS_DESIGNED,
) -> ElbowPid:
    """Return the controller for a nominal plant.

    Parameters
    ----------
    plant : ElbowOrthosis
    signals, action_signals : Signals
    gains : Gains, optional
        Default: those of :func:`simc_torque`.
    hysteresis : bool
        Whether the nominal hysteresis's friction is added to the estimate of the torque.
    knobs : mapping
        Of ``KNOBS``.
    """
    full = plant.full_pressure
    return ElbowPid(
        simc_torque(plant, knobs) if gains is None else gains,
        make_elbow_signal_map(signals, action_signals, plant.control_period),
        make_pressure_loop(plant) if plant.valves == "on_off" else None,
        knob(knobs, "start") * SHARE * full,
        full,
        plant.control_period,
        make_elbow_friction(plant, known=hysteresis),
    )


PID = partial(
    Entry,
    knowledge="nominal model",
    feedback=True,
    citation="skogestad2003",
    envs=ELBOW,
    plants=(ElbowOrthosis,),
    knobs=KNOBS,
)
ENTRIES = {
    "elbow_pid": PID(
        "PI of the estimated torque about 1.2 bar in both bundles, SIMC tuning (with an assumed lag"
        " for on/off valves); stiffness not controlled",
        make=make_elbow_pid,
    ),
    "elbow_pid_hysteresis": PID(
        "elbow_pid with the bundles' friction in its estimate of the torque",
        make=partial(make_elbow_pid, hysteresis=True),
    ),
}
