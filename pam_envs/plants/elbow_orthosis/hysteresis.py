"""Hysteresis of the elbow's bundles: friction driven by their contraction.

The threads of the braid slide as the length changes, and press on each other in proportion to the
force. An operator of slope 1 follows the travel of the pulley (the contraction of bundle b; that
of bundle a is its mirror image, so that one operator serves both). Its lag gives the force of
each bundle

    P = X [(L_n - C) (C_max - C) - s],    s = loop L_n C_max lag / (2 largest lag)

with the lag of that bundle's own contraction. Driven by length, the friction ``X s`` has the
stiffness of ``REFERENCE_PRESSURE`` and slips at distances in proportion to ``X``, so that it slips
at the same force and is passive; each bundle then has an operator of its own. ``loop`` is the
largest difference of the forces during stretch and release of the bundle, over its force at nominal
length, at any one pressure. This is our reading of the paper's 7.5 %, which the paper reports for
loops that overload the muscles beyond their nominal length; it says that shorter loops have less.

The two presets are different hysteresis models, not two forms of one. Plays act equally at every
angle of the elbow; their thresholds are spread evenly on a logarithmic scale. The Preisach preset
has thresholds spread evenly up to its largest, so that small motions have less slip, and less
friction mid-stroke than towards either end, where one of the bundles is longest. Plays cannot
represent this. Both models are assumed; the paper gives only the largest difference, which is the
same for both.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from pam_envs.hysteresis.friction_effects import DriveEffects
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.hysteresis.preisach import Preisach
from pam_envs.hysteresis.protocol import ELEMENTS, HysteresisModel, RowsState, preset
from pam_envs.hysteresis.slip import PreisachSlip, SlipModel
from pam_envs.muscle.effects import LengthYieldTailEffects
from pam_envs.parameters import declarations, published
from pam_envs.plants.antagonistic_joint.hysteresis import PLAYS
from pam_envs.plants.core.plant import OperatorComponent

SMALLEST, LARGEST = 6e-4, 9e-3
"""Thresholds of the preset's plays [m]: 0.15 % and 2.3 % of the nominal length."""
WIDEST, LEVELS = 0.06, 121
"""Range [m] of a Preisach hysteresis on either side of the middle, and levels of its map."""
SLIDING = 0.8
"""Part of the slope that has hysteresis, of either preset."""
HALF_GAP = 7.75e-3
"""Largest half-gap [m] of the Preisach preset's relays: of 15.5 cells of its map."""
REFERENCE_PRESSURE = 5e5
"""Pressure [Pa] at which friction of either drive is the same: that of the published loops."""
MIDDLE, REST = 0.3, 9e-3
"""Density of its relays in the middle over that from ``REST`` [m] on either side. Relays so far out
are all within the paper's stroke of 66 mm, which is why the loop there is the largest one."""


@dataclass(frozen=True)
class ElbowHysteresis(DriveEffects, LengthYieldTailEffects, OperatorComponent):
    """Thread-on-thread friction of both bundles.

    ``operator`` turns travel [m] into the travel that the friction follows, with slope 1 and a
    virgin start. Yielding friction acts beside it and is that of one muscle of a bundle, whose
    strain is over the nominal length of the bundle. With an operator that is driven by the
    pressure, this changes the stiffness of the yielding friction; with one driven by length the
    strain at which it slips, so that it is passive.
    """

    effects: ClassVar[tuple[tuple[str, ...], ...]] = (
        *DriveEffects.effects,
        tuple(declarations(LengthYieldTailEffects)),
    )

    loop: float = published(
        0.075,
        "1",
        0.0,
        0.4,
        "7.5 % between loading and unloading: chakarov2018, section 2",
        neutral=0.0,
        spread=(0.045, 0.12),
    )

    @property
    def largest_lag(self) -> float:
        """Largest lag [m] of the operator, after a long way in one direction."""
        return self.model.largest_lag

    def at_limits(self, limits: NDArray[np.float64]) -> list[HysteresisModel]:
        """Return the operators of both bundles at constant limits, shape (2, ...)."""
        model = self.model
        if isinstance(model, SlipModel):
            return [model.limited(float(np.ravel(limit)[0])) for limit in limits]
        return [model, model]

    def initial(self, rows: int) -> RowsState:
        """Return the virgin states of a number of rows, for :meth:`ElbowOrthosis.slide`."""
        state = self.model.rows().initial(rows)
        return state * 2 if self.drive == "length" else state  # type: ignore[no-any-return]


def travel_plays() -> PlayOperator:
    """Return the preset: plays of equal weight, evenly spread on a logarithmic scale."""
    thresholds = np.geomspace(SMALLEST, LARGEST, PLAYS)
    return PlayOperator(tuple(thresholds), (0.1,) * PLAYS, 0.2)


def _relays(middle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the density of relays by the mean [m] of their two thresholds, over the largest."""
    return np.asarray(MIDDLE + (1.0 - MIDDLE) * np.minimum(1.0, (middle / REST) ** 2))


def _density(up: NDArray[np.float64], down: NDArray[np.float64]) -> NDArray[np.float64]:
    size = 0.5 * SLIDING / HALF_GAP
    return size * _relays(0.5 * (up + down)) * (up - down < 2.0 * HALF_GAP)


def travel_relays() -> Preisach:
    """Return the other preset: relays of even half-gaps, fewer mid-stroke; see this module's page.

    A part without hysteresis compensates the missing relays, so that the slope is 1 on the mean of
    both branches.
    """
    sliding = Preisach.from_density(_density, -WIDEST, WIDEST, LEVELS).everett
    levels = np.linspace(-WIDEST, WIDEST, LEVELS)
    reach = np.linspace(0.0, HALF_GAP, 65)
    share = 0.5 * (_relays(levels[:, None] - reach) + _relays(levels[:, None] + reach))
    slope = 1.0 - SLIDING * np.mean(share, axis=1)
    steps = 0.5 * (slope[1:] + slope[:-1]) * np.diff(levels)
    at_once = np.concatenate([[0.0], np.cumsum(steps)])
    table = sliding + (at_once[:, None] - at_once[None, :])
    table = 0.5 * (table - table[::-1, ::-1])  # virgin relays need the symmetry to rounding
    return Preisach(-WIDEST, WIDEST, tuple(map(tuple, table)), start="virgin")


def travel_slips() -> PreisachSlip:
    """Return relays of the same density, of twelve half-gaps."""
    gaps = (np.arange(ELEMENTS) + 0.5) * HALF_GAP / ELEMENTS
    cells = (np.arange(LEVELS - 1) + 0.5) * 2.0 * WIDEST / (LEVELS - 1) - WIDEST
    share = tuple(float(d) for d in SLIDING / ELEMENTS * _relays(cells))
    return PreisachSlip(-WIDEST, WIDEST, tuple(gaps), (share,) * ELEMENTS)


@lru_cache(maxsize=4)
def elbow_hysteresis(kind: str) -> ElbowHysteresis:
    """Return the preset hysteresis of a kind; all have loops of the same largest width.

    Raises
    ------
    ValueError
        If there is no such kind.
    """
    if kind == Preisach.kind:
        return ElbowHysteresis(travel_relays())
    if kind == PreisachSlip.kind:
        return ElbowHysteresis(travel_slips())
    return ElbowHysteresis(preset(kind, travel_plays(), -WIDEST, WIDEST, LEVELS, "virgin"))
