"""PI control of the elbow's torque, without control of the stiffness.

Both pressures start from one value and move in opposite directions: bundle b up, bundle a down.
The feedback is the torque estimated from angle and pressures, since there is no torque sensor. The
common pressure, a fifth of the largest, gives a stiffness in the middle of the tasks' references;
friction grows with it, so that a higher one degrades the torque.

Tuning: SIMC (skogestad2003) for a lag, with the steepest torque per pressure over the range and the
regulator's lag. On/off valves have a rate (3 bar in 3 s) instead of a lag: the rule is applied to
one cycle as lag, an assumption. The dead time is that of the regulator, half of the hold of a
command, and a control period of computing.
"""

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, RowController
from baselines.core.entry import AS_DESIGNED, Bounds, Knobs, Spec
from baselines.elbow.nominal import (
    ELBOW_ENTRY,
    ElbowFriction,
    ElbowSignalMap,
    make_elbow_friction,
    make_elbow_signal_map,
)
from baselines.elbow.valves import PressureLoop, make_pressure_loop
from baselines.linear.pid import PI_KNOBS, Gains, PidState, pid_start, pid_step, simc_rule
from pam_envs.hysteresis.protocol import RowsState
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
    theta = 0.5 * step + plant.control_period + plant.dead_time
    return simc_rule(steepest, tau, 0.0, theta, knobs=knobs).parallel(plant.control_period)


class ElbowPidState(NamedTuple):
    """States of the PI and of the nominal hysteresis, first axis n_env."""

    pid: PidState
    hysteresis: RowsState


@dataclass(frozen=True)
class ElbowPid(RowController):
    """PI of the estimated torque, friction included; see the module.

    The loop is that of on/off valves; regulators contain their own. ``middle`` is the common
    pressure [Pa].
    """

    gains: Gains
    signals: ElbowSignalMap
    loop: PressureLoop | None
    middle: float
    friction: ElbowFriction

    def initial_state(self, observation: ArrayLike) -> ElbowPidState:
        """Return the state that holds the present difference of pressures."""
        view = self.signals.read(observation)
        pid = pid_start(0.5 * np.diff(view.pressure, axis=0)[0], view.torque)
        return ElbowPidState(pid, self.friction.initial(len(view.angle)))

    def respond(self, observation: ArrayLike, state: ElbowPidState) -> Prediction:
        """Return the action and the next state."""
        view, full = self.signals.read(observation), self.friction.plant.full_pressure
        losses, hysteresis = self.friction.losses(view, state.hysteresis)
        torque = view.torque + self.friction.torque(view, losses)
        error, period = view.torque_reference - torque, self.signals.period
        shift, after = pid_step(self.gains, state.pid, error, torque, -full, full, period)
        target = np.clip(self.middle + np.array([-shift, shift]), 0.0, full)
        commands = target if self.loop is None else self.loop.commands(view, target)
        return self.signals.write(commands, observation), ElbowPidState(after, hysteresis)


def make_elbow_pid(spec: Spec[ElbowOrthosis], hysteresis: bool = False) -> ElbowPid:
    """Return the controller; ``hysteresis``: whether its estimate includes nominal friction."""
    plant = spec.plant
    return ElbowPid(
        simc_torque(plant, spec.knobs),
        make_elbow_signal_map(spec),
        make_pressure_loop(spec) if plant.valves == "on_off" else None,
        spec.knob("start") * SHARE * plant.full_pressure,
        make_elbow_friction(plant, known=hysteresis),
    )


PID = partial(ELBOW_ENTRY, citation="skogestad2003", knobs=KNOBS)
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
