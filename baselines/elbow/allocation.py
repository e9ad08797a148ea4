"""Torque and stiffness control of the elbow: exact allocation with friction compensation.

The controller of chakarov2018, Fig. 7: pressures for the reference torque and stiffness at the
present angle, and a loop around each bundle's pressure. Friction inside the bundles is driven by
the angle, which is sensed: a nominal hysteresis driven by it gives the loss of each bundle's force,
and the allocation accounts for it, the exact inverse of the hysteresis.

While a pressure lags, the two pressures together give neither the torque nor the stiffness. With
``early`` the allocation is restricted to the pressures reachable in the valves' next step, torque
first, so that the torque holds during the transition.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, RowController, row_count
from baselines.core.entry import Entry
from baselines.core.environments import ELBOW
from baselines.core.knobs import AS_DESIGNED, Knobs
from baselines.elbow.friction import ElbowFriction, make_elbow_friction
from baselines.elbow.torque_stiffness import Allocation
from baselines.elbow.valves import EARLY_KNOBS, KNOBS, PressureLoop, make_pressure_loop
from baselines.elbow.view import ElbowSignalMap, make_elbow_signal_map
from baselines.positioning.nominal import HysteresisState
from pam_envs.parameters import Signals
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis


class AllocationState(NamedTuple):
    """State of the nominal hysteresis, first axis n_env."""

    hysteresis: HysteresisState


@dataclass(frozen=True)
class ElbowAllocation(RowController):
    """Allocation and pressure loops; see the module.

    Attributes
    ----------
    allocation : Allocation
    signals : ElbowSignalMap
    loop : PressureLoop
    friction : ElbowFriction
        Compensated friction.
    early : bool
        Whether pressures are restricted to those reachable in the next step.
    """

    allocation: Allocation
    signals: ElbowSignalMap
    loop: PressureLoop
    friction: ElbowFriction
    early: bool = False

    def initial_state(self, observation: ArrayLike) -> AllocationState:
        """See :class:`~baselines.core.controller.RowController`."""
        return AllocationState(self.friction.initial(row_count(observation)))

    def respond(self, observation: ArrayLike, state: AllocationState) -> Prediction:
        """See :class:`~baselines.core.controller.RowController`."""
        view = self.signals.read(observation)
        friction, hysteresis = self.friction.losses(view, state.hysteresis)
        limits = self.loop.reach(view) if self.early else None
        pressures = self.allocation.pressures(
            view.angle, view.torque_reference, view.stiffness_reference, friction, limits
        )
        commands = self.loop.commands(view, np.array(pressures))
        return self.signals.write(commands, observation), AllocationState(hysteresis)


def make_elbow_allocation(
    plant: ElbowOrthosis,
    signals: Signals,
    action_signals: Signals,
    hysteresis: bool = False,
    early: bool = False,
    knobs: Knobs = AS_DESIGNED,
) -> ElbowAllocation:
    """Return the controller for a nominal plant.

    Parameters
    ----------
    plant : ElbowOrthosis
    signals, action_signals : Signals
    hysteresis : bool
        Whether the nominal friction is compensated.
    early : bool
        See :class:`ElbowAllocation`.
    knobs : mapping
        Of :data:`baselines.elbow.valves.EARLY_KNOBS`.
    """
    return ElbowAllocation(
        Allocation(plant),
        make_elbow_signal_map(signals, action_signals, plant.control_period),
        make_pressure_loop(plant, knobs),
        make_elbow_friction(plant, known=hysteresis),
        early,
    )


ALLOCATION = partial(
    Entry,
    knowledge="nominal model",
    feedback=True,
    citation="chakarov2018",
    envs=ELBOW,
    plants=(ElbowOrthosis,),
)
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
