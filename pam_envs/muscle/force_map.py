"""Static force of a Festo DMSP-10: a law fitted on a measured map.

    F(p, e) = p A (1 - taper e) - [threshold + braid (1 - exp(-e / strain)) + stiffness e]

with ``e`` the contraction over the stretch of its axis. It is linear in the pressure, so that its
inverse ``p(F, e)`` is exact, and smooth. It meets the measured map of a DMSP-10-250 (0.5 to 6.5
bar, 0 to 20.8 % contraction, up to 542 N) within 1.4 N RMS, 8 N at the point of the lowest
pressure. The sine law of fluidic_muscles has eight parameters instead of six and meets it within
1.3 N, but oscillates between the measured contractions.

A negative value means a slack muscle: its force is 0. The force is assumed not to depend on the
rest length at equal contraction, which the map of one length cannot show.

References
----------
A. Martens, I. Boblan, "Modeling of the static force of a Festo pneumatic muscle actuator",
Actuators 6 (2017) 33: the map.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.kernels.arithmetic import decay
from pam_envs.kernels.build import kernel
from pam_envs.muscle.effects import LengthYieldTailEffects, TemperatureEffects
from pam_envs.muscle.law_correction import FIELDS, LawCorrection
from pam_envs.parameters import assumed, declarations, derived, effect, identified, published

_FIT = "least squares on the measured map of a DMSP-10-250 (data/dmsp10_force_map.csv)"
FULL_PRESSURE = 6.5e5
"""Highest pressure of the map [Pa]."""
PAPER_CONTRACTION = 0.25
"""Contraction at which the muscle of fluidic_muscles has no force left at full pressure."""


@dataclass(frozen=True)
class ForceMap(LawCorrection, LengthYieldTailEffects, TemperatureEffects):
    """Muscle DMSP-10-150N.

    ``stretch`` lengthens the axis of contraction. Inverses of the law do not use ``gain`` and
    ``imbalance``, which describe the specimens: muscle A pulls ``gain (1 + imbalance)`` times the
    law, muscle B ``gain (1 - imbalance)`` times. Nor do they use the correction of the law. The
    friction of muscle A is ``1 + friction_imbalance`` times that of the hysteresis, that of B
    ``1 - friction_imbalance`` times.
    """

    effects: ClassVar[tuple[tuple[str, ...], ...]] = (
        *TemperatureEffects.effects,
        tuple(declarations(LengthYieldTailEffects)),
        FIELDS,
        ("friction_imbalance",),
    )

    area: float = identified(8.9128e-4, "m2", 1e-5, 1e-2, _FIT)
    taper: float = identified(3.0078, "1", 0.0, 10.0, _FIT)
    threshold: float = identified(36.325, "N", 0.0, 500.0, _FIT)
    braid_force: float = identified(148.50, "N", 0.0, 5e3, _FIT)
    braid_strain: float = identified(0.02139, "1", 0.005, 0.3, _FIT)
    stiffness: float = identified(148.33, "N", 0.0, 1e4, _FIT)
    stretch: float = identified(
        1.0, "1", 0.5, 2.0, "1: no force beyond 20.9 % at 6.5 bar, as measured", neutral=1.0
    )
    gain: float = assumed(
        1.0,
        "1",
        0.5,
        1.5,
        "specimen over map; batches differ by 25 %",
        neutral=1.0,
        spread=(0.85, 1.15),
    )
    imbalance: float = assumed(
        0.0,
        "1",
        -0.3,
        0.3,
        "share by which A is stronger and B weaker",
        neutral=0.0,
        spread=(-0.05, 0.05),
    )
    friction_imbalance: float = effect(
        "1", -0.9, 0.9, "share by which A has more friction and B less"
    )
    viscosity: float = derived(
        1.2e-4,
        "m2 s",
        0.0,
        1e-2,
        "gives the second pole at 23 rad/s at the nominal point",
        spread=(0.8e-4, 1.8e-4),
    )
    rest_length: float = published(0.15, "m", 0.02, 2.0, "fluidic_muscles, section 1.2")
    diameter: float = published(0.01, "m", 2e-3, 0.1, "fluidic_muscles, section 1.2")

    def area_at(self, contraction: ArrayLike) -> NDArray[np.float64]:
        """Return the force over pressure [m2] at a contraction [1]."""
        return np.asarray(self.area * (1.0 - self.taper * self._measured(contraction)))

    def volume_at(self, contraction: ArrayLike) -> NDArray[np.float64]:
        """Return the inner volume [m3] at a contraction [1]."""
        bore, e = 0.25 * np.pi * self.diameter**2, np.asarray(contraction, float)
        shape = (self.area, self.taper, 1.0 / self.stretch, bore, self.rest_length)
        return np.asarray(inner_volume(e, *shape))  # type: ignore[arg-type]

    def passive(self, contraction: ArrayLike) -> NDArray[np.float64]:
        """Return the force [N] that opposes the pressure at a contraction [1]."""
        e = self._measured(contraction)
        braid = self.braid_force * -np.expm1(-e / self.braid_strain)
        return np.asarray(self.threshold + braid + self.stiffness * e)

    def law(self, pressure: ArrayLike, contraction: ArrayLike) -> NDArray[np.float64]:
        """Return the law's force [N] at a pressure [Pa] and contraction [1], below 0 if slack."""
        p = np.asarray(pressure, float)
        return np.asarray(self.area_at(contraction) * p - self.passive(contraction))

    def corrected(self, pressure: ArrayLike, contraction: ArrayLike) -> NDArray[np.float64]:
        """Return the force [N] of the corrected law, below 0 if slack."""
        law = self.law(pressure, contraction)
        return law + self.correction(pressure, contraction) if self.corrects else law

    def force(self, pressure: ArrayLike, contraction: ArrayLike) -> NDArray[np.float64]:
        """Return the force [N], 0 where the muscle is slack."""
        return np.maximum(0.0, self.corrected(pressure, contraction))

    def pressure(self, force: ArrayLike, contraction: ArrayLike) -> NDArray[np.float64]:
        """Return the pressure [Pa] of a force [N] at a contraction [1]: exact."""
        return (np.asarray(force, float) + self.passive(contraction)) / self.area_at(contraction)

    def longest_contraction(self, pressure: float = FULL_PRESSURE) -> float:
        """Return the contraction [1] at which no force is left at a pressure [Pa]."""
        low, high = 0.0, self.stretch / self.taper
        for _ in range(60):
            middle = 0.5 * (low + high)
            if float(self.law(pressure, middle)) > 0.0:
                low = middle
            else:
                high = middle
        return 0.5 * (low + high)

    def _measured(self, contraction: ArrayLike) -> NDArray[np.float64]:
        return np.asarray(contraction, float) / self.stretch


def paper_stretch() -> float:
    """Return the stretch with which the force at full pressure ends at 25 % contraction."""
    return PAPER_CONTRACTION / ForceMap().longest_contraction()


@kernel
def force_terms(
    contraction: float, area: float, taper: float, threshold: float, braid_force: float,
    braid_strain: float, stiffness: float, per_stretch: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return the terms of the force at a contraction, ``pressure * first - second``, and slopes.

    The slopes are minus that of the first and plus that of the second by contraction.
    ``per_stretch`` is one over the stretch.
    """
    e = contraction * per_stretch
    slack = decay(e / braid_strain)
    passive = threshold + braid_force * (1.0 - slack) + stiffness * e
    slope = (braid_force / braid_strain * slack + stiffness) * per_stretch
    return area * (1.0 - taper * e), passive, area * taper * per_stretch, slope


@kernel
def inner_volume(
    contraction: float, area: float, taper: float, per_stretch: float, bore: float, length: float
) -> float:
    """Return the inner volume [m3]; ``bore`` [m2] is the cross-section at rest."""
    grown = area * contraction * (1.0 - 0.5 * taper * contraction * per_stretch)
    return length * (bore + grown)
