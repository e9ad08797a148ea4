"""What the controllers of the elbow read and write."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from baselines.core.controller import Array, Reader, Rows, reader
from pam_envs.parameters import Signal, Signals

NAMES = (
    "angle",
    "rate",
    "pressure_a",
    "pressure_b",
    "torque",
    "reference",
    "stiffness_reference",
)


class ElbowView(NamedTuple):
    """One observation of every row, arrays of shape (n_env,).

    Attributes
    ----------
    angle, rate : ndarray
        As sensed [rad], [rad/s].
    pressure : ndarray, shape (2, n_env)
        As sensed [Pa]: bundles a and b.
    torque : ndarray
        As estimated [N m].
    wanted, stiffness : ndarray
        Torque [N m] and stiffness [N m/rad] that are asked for.
    taken : ndarray of bool
        Where the next action is one that the valves take.
    """

    angle: Array
    rate: Array
    pressure: Array
    torque: Array
    wanted: Array
    stiffness: Array
    taken: Rows


@dataclass(frozen=True)
class ElbowSignalMap:
    """Makes an :class:`ElbowView` of observations, and actions of two commands.

    Attributes
    ----------
    reader : Reader
    to_pulse : Reader or None
        Of the time until on/off valves take a pulse.
    actions : tuple of Signal
        Of bundles a and b.
    period : float
        Control period [s].
    """

    reader: Reader
    to_pulse: Reader | None
    actions: tuple[Signal, Signal]
    period: float

    def read(self, observation: ArrayLike) -> ElbowView:
        """Return what an observation of shape (n_obs,) or (n_env, n_obs) shows."""
        angle, rate, a, b, torque, wanted, stiffness = self.reader.rows(observation)
        taken = np.ones(len(angle), bool)
        if self.to_pulse is not None:
            taken = self.to_pulse.rows(observation)[0] < 0.5 * self.period
        return ElbowView(angle, rate, np.array([a, b]), torque, wanted, stiffness, taken)

    def write(self, commands: Array, observation: ArrayLike) -> NDArray[np.float32]:
        """Return the action for commands of both bundles, shape (2, n_env)."""
        action = np.zeros((commands.shape[1], 2))
        for signal, value in zip(self.actions, commands, strict=True):
            gain, offset = signal.scale
            action[:, signal.index] = gain * np.clip(value, signal.low, signal.high) + offset
        made = action.astype(np.float32)
        return made if np.ndim(observation) == 2 else made[0]


def make_elbow_signal_map(
    signals: Signals, action_signals: Signals, period: float
) -> ElbowSignalMap:
    """Return what reads and writes the signals of the elbow.

    Raises
    ------
    ValueError
        If the actions are neither pressures nor pulses.
    """
    names = set(action_signals.names())
    form = "pulse_{}" if "pulse_a" in names else "pressure_{}_set_point"
    if form.format("a") not in names:
        raise ValueError(
            f"the actions are {', '.join(sorted(names))}; these controllers give pressures or "
            "pulses: make the environment with action='pressures'"
        )
    there = "to_pulse" in signals.names()
    return ElbowSignalMap(
        reader(signals, list(NAMES)),
        reader(signals, ["to_pulse"]) if there else None,
        (action_signals[form.format("a")], action_signals[form.format("b")]),
        period,
    )
