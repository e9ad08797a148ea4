"""Torque and stiffness at once: exact allocation, pressure loops, and the hysteresis undone.

The controller of chakarov2018, Fig. 7: pressures that give the wanted torque and stiffness at the
present angle, and a loop around each bundle's pressure. Friction inside the bundles is driven by
the angle, which is sensed: a nominal hysteresis that follows it says by how much the bundles pull
more on one way and less on the other, and the pressures are those of the bundles as they are. That
is the exact inverse of the hysteresis.

While a pressure lags, both pressures together give neither the torque nor the stiffness. With
``early`` the wish is answered within what the valves come to in their next step: torque first holds
on the way as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, reset_rows
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
    """The nominal hysteresis, first axis n_env."""

    hysteresis: HysteresisState


@dataclass(frozen=True)
class ElbowAllocation:
    """Allocation and pressure loops; see this module's page.

    Attributes
    ----------
    allocation : Allocation
    signals : ElbowSignalMap
    loop : PressureLoop
    friction : ElbowFriction
        That is undone; none is if its hysteresis never lags.
    early : bool
        Whether the pressures are chosen among those of the next step.
    """

    allocation: Allocation
    signals: ElbowSignalMap
    loop: PressureLoop
    friction: ElbowFriction
    early: bool = False

    def predict(
        self,
        observation: ArrayLike,
        state: AllocationState | None = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Prediction:
        """Return the commands; see :class:`~baselines.core.controller.Controller`."""
        view = self.signals.read(observation)
        rows = len(view.angle)
        state = reset_rows(
            state, episode_start, rows, lambda: AllocationState(self.friction.initial(rows))
        )
        friction, hysteresis = self.friction.taken(view, state.hysteresis)
        limits = self.loop.reach(view) if self.early else None
        wanted = self.allocation.pressures(
            view.angle, view.wanted, view.stiffness, friction, limits
        )
        commands = self.loop.commands(view, np.array(wanted))
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
        Whether the nominal hysteresis is undone.
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
