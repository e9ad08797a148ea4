"""Open-loop positioning with one pressure curve for each load and branch.

The method of positioning2021: the controller holds curves p(contraction), one for inflation and
one for deflation at each load, and sends the regulator what the curve of the present branch says
for the present reference (``baselines.positioning.branch`` decides which one). Nothing is measured
after the start.

The curves here interpolate the readings (monotone piecewise cubics through the means), which has
no fitting error; ``baselines.positioning.plc_polynomial`` uses the cubics that the paper programs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import (
    Answer,
    Array,
    Reader,
    answer,
    beginning,
    by_load,
    choose,
    reader,
)
from baselines.positioning.branch import DEAD_BAND, Branch, first_branch, next_branch
from baselines.positioning.contraction_tables import ContractionInverse, pchip_inverse
from pam_envs.parameters import Signal, Signals

LOWEST, HIGHEST = -0.01, 0.02
"""Contractions [m] between which a curve is looked up; beyond, its ends hold."""
SPACING = 2e-6
"""Spacing [m] at which a curve is looked up; what lies between is straight, to 0.02 Pa."""


@dataclass(frozen=True)
class TwoBranch:
    """Curve of the present branch at the present reference.

    A load's two curves are written into a look-up table when that load is first met.

    Attributes
    ----------
    curves : ContractionInverse
        Pressure for a contraction, a branch and a load.
    reader : Reader
        Of contraction, load and reference; the contraction is read at the start only.
    action_signal : Signal
    dead_band : float
        Of the branch logic [m].
    """

    curves: ContractionInverse
    reader: Reader
    action_signal: Signal
    dead_band: float = DEAD_BAND

    def predict(
        self,
        observation: ArrayLike,
        state: Branch | None = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Answer:
        """Return the curve's set-point; see :class:`~baselines.core.controller.Controller`."""
        contraction, load, reference = self.reader.rows(observation)
        begin = beginning(state, episode_start, len(load))
        if state is None or begin.any():
            state = choose(begin, first_branch(reference, contraction), state)
        branch = next_branch(state, reference, self.dead_band)
        pressure = np.empty(len(load))
        for key, rows in by_load(load):
            grid, inflation, deflation = self._curves_at(key)
            up = np.interp(reference[rows], grid, inflation)
            down = np.interp(reference[rows], grid, deflation)
            pressure[rows] = np.where(branch.inflating[rows], up, down)
        return answer(self.action_signal, pressure, observation), branch

    @cached_property
    def _met(self) -> dict[float, tuple[Array, Array, Array]]:
        return {}

    def _curves_at(self, load: float) -> tuple[Array, Array, Array]:
        """Return contractions [m] and the pressures [Pa] of inflation and deflation at a load."""
        if load not in self._met:
            grid = np.arange(LOWEST, HIGHEST + 0.5 * SPACING, SPACING)
            up, down = (self.curves.pressure(grid, inflating, load) for inflating in (True, False))
            self._met[load] = grid, up, down
        return self._met[load]


def make_two_branch(
    curves: ContractionInverse,
    signals: Signals,
    action_signals: Signals,
    dead_band: float = DEAD_BAND,
) -> TwoBranch:
    """Return the controller for any inverse curves."""
    return TwoBranch(
        curves,
        reader(signals, ["contraction", "load", "reference"]),
        action_signals["pressure_set_point"],
        dead_band,
    )


def make_table_inverse(signals: Signals, action_signals: Signals) -> TwoBranch:
    """Return the controller that interpolates the published readings."""
    return make_two_branch(pchip_inverse(), signals, action_signals)
