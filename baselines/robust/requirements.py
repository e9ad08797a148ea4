"""Robust performance of the disturbance loop of a joint: uncertainty, weights and ``mu``.

The nominal plant is ``G = 23^2 / (s + 23)^2`` (fluidic_muscles, section 4, Fig. 12). The hysteresis
makes its gain uncertain, within the sector of Fig. 14; neglected dynamics at high frequencies are
bounded as in Fig. 15; and the sensitivity is weighted:

    plants         G (1 + g delta + W_m Delta),    delta real, Delta complex, both within 1
    performance    |W_p S| <= 1 for all of them

The paper prints neither the sector nor the functions. ``g`` is 0.35; ``W_p`` requires a bandwidth
of 4 rad/s; ``W_m`` increases from 10 % to 300 %, with 100 % at 42 rad/s, which covers half a period
of the hold and one period of computing, as on a real rig. All other fields of
:class:`RobustDesign` are assumed. The resulting sensitivity (0.013, 0.127 and 0.443 at 0.1, 1 and 4
rad/s) agrees with another synthesis for the paper to 1 %; as the fields were free, this validates
neither. The measure is the structured singular value ``mu`` of the three blocks, at most 1 if the
performance holds for all plants. With one input and output the matrix has rank one, so that ``mu``
is exact: the smallest ``k`` with

    min over |delta| <= k of |1 + L (1 + g delta)|  <=  k (|W_p| + |W_m L|)

The synthesised loops, H-infinity and mu (fluidic_muscles, section 4), are read from
``joint_robust.json``, written by :mod:`baselines.robust.synthesis`. Both act on the angle of the
model less that of the joint, and were designed for poles at 23 rad/s. For a joint with other poles
``p`` the loop is ``C(23 s / p)``, scaled in time: with a double pole at ``p`` the loop gain is the
same at ``p / 23`` of the frequency. ``mu`` is then not larger, as the bound on the neglected
dynamics is unchanged while the loop gain decreases at that frequency.

In an arm the double pole only approximates a joint that oscillates and is coupled to the others: at
the base the error exceeds the bound of the design by a fifth, so that ``mu`` does not apply there.
With the arm straight and without friction all six loops together are stable over the whole sector
of gains, with 0.1 kg at the tip too, and at the nominal gain the sensitivity peaks at 1.24 (1.48
with the 0.1 kg), where one stage has 1.02. The dead time of the regulators, 45 ms, is not in the
design; behind it all of them are stable too, with peaks of 1.60 (2.12).

Sources: packard1993; skogestad2005, chapter 8.
"""

import json
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from baselines.linear.systems import (
    Complex,
    StateSpace,
    double_lag,
    from_polynomials,
    response,
    state_space,
)
from pam_envs.arrays import Array

FREQUENCIES = np.geomspace(1e-2, 1e3, 401)
"""Frequencies [rad/s] at which loops are evaluated."""
DOUBLINGS = 60


@dataclass(frozen=True)
class RobustDesign:
    """Uncertainty and performance.

    Attributes
    ----------
    pole : float
        Both poles of the nominal plant [rad/s] (fluidic_muscles, section 4).
    gain_spread : float
        ``g``; required: mu of at most 1 at 35 %.
    bandwidth : float
        Of the sensitivity [rad/s]; required with ``g``.
    peak : float
        Bound [1] on the sensitivity at high frequencies; assumed.
    at_rest : float
        Bound [1] on the static sensitivity; above 0, for a stable weight; assumed.
    neglected_low, neglected_high : float
        ``|W_m|`` at low and at high frequencies; assumed.
    neglected_corner : float
        Frequency [rad/s] of its zero over ``neglected_low``; assumed.
    effort : float
        Weight on the command: small, for a regular problem; assumed.
    """

    pole: float = 23.0
    gain_spread: float = 0.35
    bandwidth: float = 4.0
    peak: float = 1.45
    at_rest: float = 1e-3
    neglected_low: float = 0.1
    neglected_high: float = 3.0
    neglected_corner: float = 40.0
    effort: float = 0.1

    @cached_property
    def plant(self) -> StateSpace:
        """The nominal plant."""
        return double_lag(self.pole)

    @cached_property
    def performance(self) -> StateSpace:
        """``W_p = (s / M + w_b) / (s + w_b e)``."""
        top = [1.0 / self.peak, self.bandwidth]
        return from_polynomials(top, [1.0, self.bandwidth * self.at_rest])

    @cached_property
    def neglected(self) -> StateSpace:
        """``W_m = (s + w_m l) / (s / h + w_m)``."""
        low = [1.0 / self.neglected_high, self.neglected_corner]
        return from_polynomials([1.0, self.neglected_corner * self.neglected_low], low)

    def structured_value(self, loop: Complex) -> Array:
        """Return ``mu`` at each of ``FREQUENCIES``, with the gain real; loop of shape (n,)."""
        margin = np.abs(response(self.performance, FREQUENCIES))
        margin = margin + np.abs(response(self.neglected, FREQUENCIES) * loop)
        low, high = np.zeros(len(loop)), np.full(len(loop), 1.0 / 1e-6)
        for _ in range(DOUBLINGS):
            size = np.sqrt(np.maximum(low, 1e-12) * high)
            broken = self._nearest(loop, size) <= size * margin
            low, high = np.where(broken, low, size), np.where(broken, size, high)
        return np.asarray(1.0 / high)

    def _nearest(self, loop: Complex, size: Array) -> Array:
        """Return the smallest ``|1 + L (1 + g delta)|`` for ``|delta| <= size``."""
        step = self.gain_spread * loop
        best = -np.real((1.0 + loop) * np.conj(step)) / np.abs(step) ** 2
        return np.abs(1.0 + loop + step * np.clip(best, -size, size))


def sensitivity(loop: Complex) -> NDArray[np.float64]:
    """Return ``|1 / (1 + L)|``."""
    return np.abs(1.0 / (1.0 + loop))


Kind = Literal["hinf", "mu"]
Stage = Literal["full", "reduced"]


@cache
def frozen() -> dict[str, Any]:
    """Return the numbers of the synthesis."""
    text = Path(__file__).with_name("joint_robust.json").read_text(encoding="utf-8")
    return dict(json.loads(text))


def robust_controller(
    kind: Kind, stage: Stage = "reduced", pole: float | None = None
) -> StateSpace:
    """Return a controller in continuous time, from error [rad] to command [rad].

    ``stage``: as synthesised, or reduced as the controllers use it; ``pole`` of the joint [rad/s],
    by default that of the design.
    """
    numbers = frozen()[kind][stage]
    a, b, c = (np.array(numbers[name]) for name in "abc")
    pace = 1.0 if pole is None else pole / RobustDesign().pole
    return state_space(pace * a, pace * b, c, numbers["d"])
