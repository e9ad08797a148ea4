"""PI control of the elbow's torque, without control of the stiffness.

Both pressures start from one value and move in opposite directions: bundle b up, bundle a down.
The feedback is the torque estimated from angle and pressures, since there is no torque sensor. The
common pressure, a fifth of the largest, gives a stiffness in the middle of the tasks' references;
friction grows with it, so that a higher one degrades the torque.

Tuning: SIMC (skogestad2003) for a lag, with the steepest torque per pressure over the range and the
regulator's lag. On/off valves have a rate (3 bar in 3 s) instead of a lag: the rule is applied to
one cycle as lag, an assumption. The dead time is half of the hold of a command, and a control
period of computing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, RowController
from baselines.core.entry import Entry
from baselines.core.environments import ELBOW
from baselines.core.knobs import AS_DESIGNED, Bounds, Knobs, knob
from baselines.elbow.friction import ElbowFriction, make_elbow_friction
from baselines.elbow.valves import PressureLoop, make_pressure_loop
from baselines.elbow.view import ElbowSignalMap, make_elbow_signal_map
from baselines.linear.simc import PI_KNOBS, simc_rule
from baselines.positioning.nominal import HysteresisState
from baselines.positioning.pid import Gains, PidState, pid_start, pid_step
from pam_envs.parameters import Signals
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis

SHARE = 0.2
"""Common pressure of both bundles, over the largest."""
KNOBS: Bounds = {**PI_KNOBS, "start": (0.5, 2.0)}
"""Those of the rule, and a factor on the common pressure."""


def simc_torque(plant: ElbowOrthosis, knobs: Knobs = AS_DESIGNED) -> Gains:
    """Return the gains [Pa/(N m)] of the SIMC rule; see the module."""
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
    """States of the PI and of the nominal hysteresis, first axis n_env."""

    pid: PidState
    hysteresis: HysteresisState


@dataclass(frozen=True)
class ElbowPid(RowController):
    """PI of the estimated torque; see the module.

    Attributes
    ----------
    gains : Gains
    signals : ElbowSignalMap
    loop : PressureLoop or None
        Of on/off valves; regulators contain their own.
    middle, full : float
        Common pressure [Pa], and the largest.
    period : float
        Control period [s].
    friction : ElbowFriction
        Added to the estimate.
    """

    gains: Gains
    signals: ElbowSignalMap
    loop: PressureLoop | None
    middle: float
    full: float
    period: float
    friction: ElbowFriction

    def initial_state(self, observation: ArrayLike) -> ElbowPidState:
        """See :class:`~baselines.core.controller.RowController`."""
        view = self.signals.read(observation)
        pid = pid_start(0.5 * np.diff(view.pressure, axis=0)[0], view.torque)
        return ElbowPidState(pid, self.friction.initial(len(view.angle)))

    def respond(self, observation: ArrayLike, state: ElbowPidState) -> Prediction:
        """See :class:`~baselines.core.controller.RowController`."""
        view = self.signals.read(observation)
        losses, hysteresis = self.friction.losses(view, state.hysteresis)
        torque, full = view.torque + self.friction.torque(view, losses), self.full
        error = view.torque_reference - torque
        shift, after = pid_step(self.gains, state.pid, error, torque, -full, full, self.period)
        target = np.clip(self.middle + np.array([-shift, shift]), 0.0, full)
        commands = target if self.loop is None else self.loop.commands(view, target)
        return self.signals.write(commands, observation), ElbowPidState(after, hysteresis)


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
        Whether the nominal friction is added to the estimated torque.
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
