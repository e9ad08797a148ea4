"""Hysteresis of the orthosis' muscle, from pressure to stiffness."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

from pam_envs.hysteresis.friction_effects import DriveEffects
from pam_envs.hysteresis.modified_maxwell_slip import even_model
from pam_envs.hysteresis.protocol import HysteresisModel, preset
from pam_envs.parameters import assumed
from pam_envs.plants.core.plant import OperatorComponent

FULL_PRESSURE = 4.5e5
FULL_STIFFNESS = 7110.0
FRICTION = 0.5e5
"""The preset's major loop: tips at 0 and at 4.5 bar, 71.1 N/cm; a loop width that gives the
published 11.11 % of the uncompensated muscle."""
MAP_POINTS = 46


@dataclass(frozen=True)
class KneeHysteresis(DriveEffects, OperatorComponent):
    """Thread-on-thread friction of the muscle.

    ``operator`` turns pressure [Pa] into stiffness ``T / dL`` [N/m] and starts vented; without it
    the stiffness is the line of :class:`~pam_envs.muscle.gas_spring.GasSpring`.
    """

    width: float = assumed(
        1.0, "1", 0.0, 1.2, "loop width over that of the operator", spread=(0.6, 1.2)
    )

    @cached_property
    def scaled(self) -> HysteresisModel | None:
        """The operator with its loop ``width`` times as wide, for controllers that invert it."""
        if self.operator is None:
            return None
        return self.operator.scaled(self.width, slope=self.operator.numbers()[0])


@lru_cache(maxsize=8)
def knee_hysteresis(kind: str, width: float = 1.0) -> KneeHysteresis:
    """Return the preset hysteresis of a kind; all operators have the same loops.

    Raises
    ------
    ValueError
        If there is no such kind.
    """
    model = even_model(FULL_PRESSURE, FULL_STIFFNESS, FRICTION)
    return KneeHysteresis(preset(kind, model, 0.0, FULL_PRESSURE, MAP_POINTS, "low"), width)
