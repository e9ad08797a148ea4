"""The hysteresis of the orthosis' muscle: from pressure to stiffness."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from pam_envs.hysteresis.everett import table_from_weights, weights_from_table
from pam_envs.hysteresis.modified_maxwell_slip import ModifiedMaxwellSlip, even_model
from pam_envs.hysteresis.preisach import Preisach
from pam_envs.parameters import parameter
from pam_envs.plants.single_muscle.hysteresis import Kind

FULL_PRESSURE = 4.5e5
FULL_STIFFNESS = 7110.0
FRICTION = 0.5e5
"""The preset's major loop: tips at 0 and at 4.5 bar, 71.1 N/cm; a loop width that gives the
published 11.11 % of the uncompensated muscle."""
MAP_POINTS = 46


@dataclass(frozen=True)
class KneeHysteresis:
    """Thread-on-thread friction of the muscle.

    ``operator`` turns pressure [Pa] into stiffness ``T / dL`` [N/m]: a
    :class:`ModifiedMaxwellSlip` model, a :class:`Preisach` operator that starts low, or None for
    the line of :class:`~pam_envs.muscle.gas_spring.GasSpring`.
    """

    operator: ModifiedMaxwellSlip | Preisach | None = None
    width: float = parameter(
        1.0, "1", 0.0, 1.2, "assumed", "loop width over that of the operator", spread=(0.6, 1.2)
    )

    @property
    def kind(self) -> Kind:
        """Which operator this is."""
        if self.operator is None:
            return "none"
        return "preisach" if isinstance(self.operator, Preisach) else "maxwell_slip"

    @cached_property
    def scaled(self) -> ModifiedMaxwellSlip | Preisach | None:
        """The operator with its loop ``width`` times as wide, for controllers that invert it."""
        if isinstance(self.operator, Preisach):
            slope = self.operator.table[-1][0] / (self.operator.high - self.operator.low)
            return self.operator.scaled(self.width, slope=slope)
        return None if self.operator is None else self.operator.scaled(self.width)


def knee_hysteresis(kind: Kind, width: float = 1.0) -> KneeHysteresis:
    """Return the preset hysteresis of a kind; both operators have the same loops.

    Raises
    ------
    ValueError
        If there is no such kind.
    """
    if kind == "none":
        return KneeHysteresis(None, width)
    model = even_model(FULL_PRESSURE, FULL_STIFFNESS, FRICTION)
    if kind == "maxwell_slip":
        return KneeHysteresis(model, width)
    if kind == "preisach":
        return KneeHysteresis(preisach_of(model, FULL_PRESSURE), width)
    raise ValueError(f"hysteresis = {kind!r}; choose 'maxwell_slip', 'preisach' or 'none'")


@lru_cache(maxsize=8)
def preisach_of(
    model: ModifiedMaxwellSlip, full_pressure: float, points: int = MAP_POINTS
) -> Preisach:
    """Return the Preisach operator whose first-order reversal curves are those of a model.

    The two then agree on every loop where the model's minor loops are congruent, as they are with
    a straight spring; a spring with bends may ask for relays of negative weight, which are left
    out.
    """
    grid = np.linspace(0.0, full_pressure, points)
    table = np.zeros((points, points))
    for i in range(1, points):
        down = grid[:i][::-1]
        rise = model.simulate(np.concatenate([[full_pressure, 0.0], grid[1 : i + 1]]))[0]
        fall = model.simulate(np.concatenate([[full_pressure, 0.0], grid[1 : i + 1], down]))[0]
        table[i, :i] = rise[-1] - fall[-i:][::-1]
    passive = table_from_weights(np.maximum(weights_from_table(table), 0.0))
    rows = tuple(tuple(float(v) for v in row) for row in passive)
    return Preisach(0.0, full_pressure, rows, start="low")
