"""PI control of the torque alone, and no word of stiffness.

Both pressures start from the same one and move against each other: bundle b up, bundle a down. The
torque that is fed back is the estimate from angle and pressures, since there is no sensor of it.
The pressure that both start from, a fifth of the largest, gives a stiffness amid those that the
tasks ask for; friction grows with it, so that a higher one makes the torque worse.
Tuning: SIMC for a lag (S. Skogestad, J. Process Control 13 (2003) 291-309) with the steepest torque
per pressure over the range, and the regulator's lag, or for on/off valves one cycle of theirs. The
dead time is half of what a command is held for, and a control period for a computer to work it out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from baselines.controller import Answer, beginning, choose
from baselines.elbow_valves import PressureLoop, make_pressure_loop
from baselines.elbow_view import ElbowSignalMap, make_elbow_signal_map
from baselines.pid import Gains, PidState, pid_start, pid_step
from pam_envs.parameters import Signals
from pam_envs.plants.elbow_orthosis import ElbowOrthosis

SHARE = 0.2
"""Pressure that both bundles start from, over the largest."""


def simc_torque(plant: ElbowOrthosis) -> Gains:
    """Return the gains [Pa/(N m)] of the SIMC rule; see this module's page."""
    angles, full = np.linspace(*plant.angle_range, 25), plant.full_pressure
    swing = plant.torque(angles, 0.0, full) - plant.torque(angles, full, 0.0)
    steepest = float(np.max(swing)) / full
    pulsed = plant.valves == "on_off"
    step = plant.cycle if pulsed else plant.control_period
    tau = step if pulsed else plant.regulator.time_constant
    theta = 0.5 * step + plant.control_period
    gain = tau / (steepest * 2.0 * theta)
    reset = min(tau, 8.0 * theta)
    return Gains(
        proportional=gain,
        integral=gain / reset,
        derivative=0.0,
        filter_time=plant.control_period,
        tracking_time=reset,
    )


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
    """

    gains: Gains
    signals: ElbowSignalMap
    loop: PressureLoop | None
    middle: float
    full: float
    period: float

    def predict(
        self,
        observation: ArrayLike,
        state: PidState | None = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Answer:
        """Return the commands; see :class:`~baselines.controller.Controller`."""
        view = self.signals.read(observation)
        begin = beginning(state, episode_start, len(view.angle))
        if state is None or begin.any():
            state = choose(
                begin, pid_start(0.5 * np.diff(view.pressure, axis=0)[0], view.torque), state
            )
        error, most = view.wanted - view.torque, self.full
        shift, after = pid_step(self.gains, state, error, view.torque, -most, most, self.period)
        wanted = np.clip(self.middle + np.array([-shift, shift]), 0.0, most)
        commands = wanted if self.loop is None else self.loop.commands(view, wanted)
        return self.signals.write(commands, observation), after


def make_elbow_pid(
    plant: ElbowOrthosis, signals: Signals, action_signals: Signals, gains: Gains | None = None
) -> ElbowPid:
    """Return the controller, with the gains of :func:`simc_torque` unless others are given."""
    full = plant.full_pressure
    return ElbowPid(
        simc_torque(plant) if gains is None else gains,
        make_elbow_signal_map(signals, action_signals, plant.control_period),
        make_pressure_loop(plant) if plant.valves == "on_off" else None,
        SHARE * full,
        full,
        plant.control_period,
    )
