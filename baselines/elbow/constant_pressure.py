"""Constant pressures in both bundles of the elbow orthosis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, RowController
from baselines.core.entry import Entry
from baselines.core.environments import ELBOW
from baselines.elbow.valves import PressureLoop, make_pressure_loop
from baselines.elbow.view import ElbowSignalMap, make_elbow_signal_map
from pam_envs.parameters import Signals
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis


@dataclass(frozen=True)
class ConstantPressure(RowController):
    """Constant pressures in both bundles.

    Attributes
    ----------
    signals : ElbowSignalMap
    loop : PressureLoop
    pressure : float
        Of both bundles [Pa].
    """

    signals: ElbowSignalMap
    loop: PressureLoop
    pressure: float

    def initial_state(self, observation: ArrayLike) -> None:
        """Return no state."""

    def respond(self, observation: ArrayLike, state: Any) -> Prediction:
        """See :class:`~baselines.core.controller.RowController`."""
        view = self.signals.read(observation)
        commands = self.loop.commands(view, np.full_like(view.pressure, self.pressure))
        return self.signals.write(commands, observation), None


def make_constant_pressure(
    plant: ElbowOrthosis, signals: Signals, action_signals: Signals, share: float = 0.5
) -> ConstantPressure:
    """Return the controller with ``share`` of the largest pressure in both bundles."""
    return ConstantPressure(
        make_elbow_signal_map(signals, action_signals, plant.control_period),
        make_pressure_loop(plant),
        share * plant.full_pressure,
    )


ENTRIES = {
    "elbow_hold": Entry(
        "constant pressure of 3 bar in both bundles",
        "nominal model",
        make_constant_pressure,
        feedback=True,
        envs=ELBOW,
        plants=(ElbowOrthosis,),
    ),
}
