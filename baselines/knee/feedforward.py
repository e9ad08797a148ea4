"""Feedforward of the knee: from a reference tension to a pressure.

The reference tension over the measured stretch of the muscle is the reference stiffness (yeh2010,
section 4.1). Its pressure comes from the inverse of the identified hysteresis ("inverse"), from the
straight line between the tips of its loop ("line"), or is the nominal pressure ("nominal").
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from baselines.core.controller import Array
from baselines.knee.nominal import KneeNominal
from baselines.knee.published import NOMINAL_PRESSURE
from baselines.positioning.nominal import HysteresisState

Kind = Literal["nominal", "line", "inverse"]


@dataclass(frozen=True)
class Forward:
    """Feedforward; its state is that of the nominal hysteresis.

    Attributes
    ----------
    nominal : KneeNominal
    kind : {"nominal", "line", "inverse"}
    """

    nominal: KneeNominal
    kind: Kind

    def start(self, pressure: Array) -> HysteresisState:
        """Return the state after inflation to a pressure [Pa], shape (n_env,)."""
        return self.nominal.inflated(pressure) if self.kind == "inverse" else ()

    def pressure(self, tension: Array, stretch: Array, state: HysteresisState) -> Array:
        """Return the pressure [Pa], within the capacity, for a tension [N] at a stretch [m]."""
        if self.kind == "nominal":
            return np.full_like(tension, NOMINAL_PRESSURE)
        stiffness = np.maximum(0.0, tension) / stretch
        if self.kind == "inverse":
            return self.nominal.pressure_for(stiffness, state)
        return np.minimum(self.nominal.line(stiffness), self.nominal.full_pressure)

    def advance(self, pressure: Array, state: HysteresisState) -> HysteresisState:
        """Return the state after a pressure [Pa] of this feedforward."""
        return self.nominal.advance(pressure, state) if self.kind == "inverse" else state
