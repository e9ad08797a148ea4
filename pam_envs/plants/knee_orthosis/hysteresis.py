"""Hysteresis of the orthosis' muscle, from pressure to stiffness."""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.hysteresis.friction_effects import DriveEffects
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.hysteresis.modified_maxwell_slip import even_model
from pam_envs.hysteresis.protocol import HysteresisModel, model_of, preset
from pam_envs.parameters import assumed, derived
from pam_envs.plants.core.plant import OperatorComponent

FULL_PRESSURE = 4.5e5
FULL_STIFFNESS = 7110.0
FRICTION = 0.5e5
"""The preset's major loop: tips at 0 and at 4.5 bar, 71.1 N/cm; a loop width that gives the
published 11.11 % of the uncompensated muscle."""
MAP_POINTS = 46
REFERENCE_PRESSURE = 2e5
"""Pressure [Pa] at which the friction driven by length is declared."""
BRACE_FRICTION = 30.0
"""Slip force [N] with which the free brace has loops as wide as with the pressure's hysteresis."""
SMALLEST, LARGEST, ELEMENTS = 3e-4, 6e-3, 6
"""Distances [m] at which the elements slip, and their number."""
LENGTHS = (0.1, 0.4)
"""Lengths of the muscle [m] over which the elements are given."""
_BRACE = "angle loop of the free brace as wide as with the hysteresis of the pressure"


@dataclass(frozen=True)
class KneeHysteresis(DriveEffects, OperatorComponent):
    """Thread-on-thread friction of the muscle.

    ``operator`` turns pressure [Pa] into stiffness ``T / dL`` [N/m] and starts vented; without it
    the stiffness is the line of :class:`~pam_envs.muscle.gas_spring.GasSpring`.

    An operator driven by length adds the force of friction elements to that line,
    ``T = alpha P (L - L_min) + friction lag(L)``, and is passive. Its elements slip together at the
    force ``friction`` at ``REFERENCE_PRESSURE``, less at a lower pressure.
    """

    effects: ClassVar[tuple[tuple[str, ...], ...]] = (
        *DriveEffects.effects,
        ("friction", "empty"),
    )

    width: float = assumed(
        1.0, "1", 0.0, 1.2, "loop width over that of the operator", spread=(0.6, 1.2)
    )

    friction: float = derived(0.0, "N", 0.0, 1e4, _BRACE, neutral=0.0)
    empty: float = assumed(
        0.3, "1", 0.0, 1.0, "slip force without pressure over that at the reference pressure"
    )

    def limit(self, pressure: ArrayLike) -> NDArray[np.float64]:
        """Return the slip force at pressures [Pa] over that at ``REFERENCE_PRESSURE``."""
        grown = (1.0 - self.empty) * np.asarray(pressure, float) / REFERENCE_PRESSURE
        return np.asarray(np.maximum(0.0, self.empty + grown))

    @cached_property
    def scaled(self) -> HysteresisModel | None:
        """The operator with its loop ``width`` times as wide, for controllers that invert it."""
        if self.operator is None or self.drive == "length":
            return None
        return self.operator.scaled(self.width, slope=self.operator.numbers()[0])


def length_plays() -> PlayOperator:
    """Return elements of equal slip force, in the unit of their sum."""
    thresholds = np.geomspace(SMALLEST, LARGEST, ELEMENTS)
    return PlayOperator(tuple(thresholds), tuple(1.0 / (ELEMENTS * thresholds)), 0.0)


@lru_cache(maxsize=8)
def knee_hysteresis(kind: str, width: float = 1.0) -> KneeHysteresis:
    """Return the preset hysteresis of a kind; all operators have the same loops.

    Raises
    ------
    ValueError
        If there is no such kind.
    """
    if model_of(kind).drive == "length":
        made = preset(kind, length_plays(), *LENGTHS, MAP_POINTS, "virgin")
        return KneeHysteresis(made, width, friction=BRACE_FRICTION)
    model = even_model(FULL_PRESSURE, FULL_STIFFNESS, FRICTION)
    return KneeHysteresis(preset(kind, model, 0.0, FULL_PRESSURE, MAP_POINTS, "low"), width)
