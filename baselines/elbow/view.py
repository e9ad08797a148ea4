"""Observation and action of the elbow's controllers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from baselines.core.controller import Array, Reader, Rows, encode_actions, reader
from baselines.core.entry import ELBOW, Entry, Spec
from pam_envs.parameters import Signal
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis

ELBOW_ENTRY = partial(
    Entry, knowledge="nominal model", feedback=True, envs=ELBOW, plants=(ElbowOrthosis,)
)
NAMES = ["angle", "rate", "pressure_a", "pressure_b", "torque", "reference", "stiffness_reference"]


class ElbowView(NamedTuple):
    """One observation of every row in SI, arrays of shape (n_env,).

    The pressures of bundles a and b have the shape (2, n_env), the torque is estimated, and
    ``accepts`` marks the rows whose valves accept the next action.
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
    """Reader of observations as an :class:`ElbowView`, and writer of actions of both bundles.

    ``to_pulse`` reads the time until on/off valves accept a pulse; the control period is in s.
    """

    reader: Reader
    to_pulse: Reader | None
    actions: tuple[Signal, Signal]
    period: float

    def read(self, observation: ArrayLike) -> ElbowView:
        """Return the view of an observation of shape (n_obs,) or (n_env, n_obs)."""
        angle, rate, a, b, torque, reference, stiffness = self.reader.rows(observation)
        accepts = np.ones(len(angle), bool)
        if self.to_pulse is not None:
            accepts = self.to_pulse.rows(observation)[0] < 0.5 * self.period
        return ElbowView(angle, rate, np.array([a, b]), torque, reference, stiffness, accepts)

    def write(self, commands: Array, observation: ArrayLike) -> NDArray[np.float32]:
        """Return the action for commands of both bundles, shape (2, n_env)."""
        return encode_actions(self.actions, commands, observation)


def make_elbow_signal_map(spec: Spec[ElbowOrthosis]) -> ElbowSignalMap:
    """Return the reader and writer of the elbow's signals."""
    signals, names = spec.signals, set(spec.actions.names())
    form = "pulse_{}" if "pulse_a" in names else "pressure_{}_set_point"
    if form.format("a") not in names:
        raise ValueError(
            f"the actions are {', '.join(sorted(names))}; these controllers give pressures or "
            "pulses: make the environment with action='pressures'"
        )
    return ElbowSignalMap(
        reader(signals, NAMES),
        reader(signals, ["to_pulse"]) if "to_pulse" in signals.names() else None,
        (spec.actions[form.format("a")], spec.actions[form.format("b")]),
        spec.plant.control_period,
    )
