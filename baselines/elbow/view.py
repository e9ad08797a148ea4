"""Observation and action of the elbow's controllers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from baselines.core.controller import Array, Reader, Rows, encode_actions, reader
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
        Sensed [rad], [rad/s].
    pressure : ndarray, shape (2, n_env)
        Sensed [Pa]: bundles a and b.
    torque : ndarray
        Estimated [N m].
    torque_reference, stiffness_reference : ndarray
        [N m], [N m/rad].
    accepts : ndarray of bool
        Rows whose valves accept the next action.
    """

    angle: Array
    rate: Array
    pressure: Array
    torque: Array
    torque_reference: Array
    stiffness_reference: Array
    accepts: Rows


@dataclass(frozen=True)
class ElbowSignalMap:
    """Reader of observations as an :class:`ElbowView`, and writer of actions.

    Attributes
    ----------
    reader : Reader
    to_pulse : Reader or None
        Of the time until on/off valves accept a pulse.
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
        """Return the view of an observation of shape (n_obs,) or (n_env, n_obs)."""
        angle, rate, a, b, torque, torque_reference, stiffness_reference = self.reader.rows(
            observation
        )
        accepts = np.ones(len(angle), bool)
        if self.to_pulse is not None:
            accepts = self.to_pulse.rows(observation)[0] < 0.5 * self.period
        pressure = np.array([a, b])
        return ElbowView(
            angle, rate, pressure, torque, torque_reference, stiffness_reference, accepts
        )

    def write(self, commands: Array, observation: ArrayLike) -> NDArray[np.float32]:
        """Return the action for commands of both bundles, shape (2, n_env)."""
        return encode_actions(self.actions, commands, observation)


def make_elbow_signal_map(
    signals: Signals, action_signals: Signals, period: float
) -> ElbowSignalMap:
    """Return the reader and writer of the elbow's signals.

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
