"""Torque and stiffness control of the elbow: exact allocation with friction compensation.

The controller of chakarov2018, Fig. 7: pressures for the reference torque and stiffness at the
present angle, and a feedback loop for each bundle's pressure. The loss of each bundle's force by
friction (:mod:`baselines.elbow.nominal`) enters the allocation: the exact inverse of the
hysteresis.

While a pressure lags, both torque and stiffness are wrong. With ``early`` the allocation is
restricted to the pressures reachable in the valves' next step, torque first, so that the torque is
correct during the transition.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, RowController, row_count
from baselines.core.entry import Spec
from baselines.elbow.nominal import (
    ELBOW_ENTRY,
    ElbowFriction,
    ElbowSignalMap,
    make_elbow_friction,
    make_elbow_signal_map,
    pressures_for,
)
from baselines.elbow.valves import EARLY_KNOBS, KNOBS, PressureLoop, make_pressure_loop
from pam_envs.hysteresis.protocol import RowsState
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis


@dataclass(frozen=True)
class ElbowAllocation(RowController):
    """Allocation, pressure loops and compensated friction; see the module.

    ``early``: whether pressures are restricted to those reachable in the next step.
    """

    signals: ElbowSignalMap
    loop: PressureLoop
    friction: ElbowFriction
    early: bool

    def initial_state(self, observation: ArrayLike) -> RowsState:
        """Return the hysteresis state of bundles without motion history."""
        return self.friction.initial(row_count(observation))

    def respond(self, observation: ArrayLike, state: RowsState) -> Prediction:
        """Return the action and the next state."""
        view = self.signals.read(observation)
        losses, after = self.friction.losses(view, state)
        limits = self.loop.reach(view) if self.early else None
        references = view.torque_reference, view.stiffness_reference
        pressures = pressures_for(self.friction.plant, view.angle, *references, losses, limits)
        commands = self.loop.commands(view, np.array(pressures))
        return self.signals.write(commands, observation), after


def make_elbow_allocation(
    spec: Spec[ElbowOrthosis], hysteresis: bool = False, early: bool = False
) -> ElbowAllocation:
    """Return the controller; ``hysteresis``: whether the nominal friction is compensated."""
    return ElbowAllocation(
        make_elbow_signal_map(spec),
        make_pressure_loop(spec),
        make_elbow_friction(spec.plant, known=hysteresis),
        early,
    )


ALLOCATION = partial(ELBOW_ENTRY, citation="chakarov2018")
ENTRIES = {
    "elbow_allocation": ALLOCATION(
        "exact allocation of torque and stiffness, loops around both pressures",
        make=make_elbow_allocation,
        knobs=KNOBS,
    ),
    "elbow_allocation_hysteresis": ALLOCATION(
        "elbow_allocation with compensation of the bundles' friction",
        make=partial(make_elbow_allocation, hysteresis=True),
        knobs=KNOBS,
    ),
    "elbow_allocation_early": ALLOCATION(
        "elbow_allocation_hysteresis within the pressures reachable in the valves' next step:"
        " torque first",
        make=partial(make_elbow_allocation, hysteresis=True, early=True),
        knobs=EARLY_KNOBS,
    ),
}
