"""Effective-area law: pressure pulls on an area, braid and tube push back.

    F(w, e) = a (1 - c e) w - [ f0 (1 - exp(-e / e0)) + k1 e + k3 e^3 ]

with effective pressure ``w`` [Pa] and strain ``e`` (contraction over rest length, negative when
stretched). The area term is the virtual-work force of a McKibben muscle about its rest length
(its area shrinks as it shortens: ``c``), and the volume is that whose change is this area; the
bracket is the force of tube and braid at no
pressure, whose saturating part gives the threshold pressure of a short muscle. The same two terms,
with a Gaussian taper, fit published isometric maps of 10 mm muscles.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebval2d
from numpy.typing import ArrayLike, NDArray

from pam_envs.kernels.arithmetic import decay
from pam_envs.kernels.build import kernel
from pam_envs.muscle.effects import (
    MAP,
    MAP_TERMS,
    LengthCreepEffects,
    LengthYieldTailEffects,
    LoadEffects,
    StaticMapEffects,
    StrandEffects,
    TemperatureEffects,
    ViscosityEffects,
)
from pam_envs.parameters import assumed, declarations, effect, identified, published

MAP_SIZES = MAP._fields[: len(MAP_TERMS)]
"""Names of the sizes of a finer map."""
NEWTON_STEPS, CLOSE, LEAST_GAIN = 40, 1e-6, 0.2
"""Most steps of Newton's method for the pressure of a force, the last change [Pa], and the least
slope over that without a map, which damps a step where the map is nearly flat."""
_FIT = "least squares on positioning2021, Tables 3-5"


@dataclass(frozen=True)
class EffectiveAreaMuscle(
    StaticMapEffects,
    ViscosityEffects,
    LengthYieldTailEffects,
    StrandEffects,
    LengthCreepEffects,
    LoadEffects,
    TemperatureEffects,
):
    """Geometry and static force law of one muscle."""

    effects: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("area_curve",),
        ("softening",),
        ("stiffening",),
        ("temperature", "temperature_gain"),
        ("load_curve",),
        ("load_stiffening",),
        ("load_stiffening_2",),
        ("load_stiffening_root",),
        ("strand_1", "strand_2", "strand_3", "strand_4", "strand_break", "strand_per_pressure"),
        tuple(declarations(LengthYieldTailEffects)),
        *ViscosityEffects.effects,
        MAP._fields,
    )

    rest_length: float = published(0.1, "m", 0.01, 5.0, "positioning2021, Table 1: MAS-10-N-100")
    diameter: float = published(0.01, "m", 0.001, 0.1, "positioning2021, Table 1: MAS-10-N-100")
    braid_angle: float = assumed(
        0.499, "rad", 0.2, 0.9, "for drawings: DMSP-10-250 (public model code)"
    )
    area: float = identified(8.7e-4, "m2", 1e-7, 0.2, _FIT)
    area_taper: float = identified(0.0, "1", 0.0, 12.0, _FIT, neutral=0.0)
    braid_force: float = identified(106.0, "N", 0.0, 5e4, _FIT)
    braid_strain: float = identified(0.0167, "1", 0.005, 0.2, _FIT)
    stiffness: float = identified(2250.0, "N", 0.0, 1e6, _FIT)
    hardening: float = identified(8600.0, "N", -1e7, 1e7, _FIT)
    # a static map that has to be finer; neutral in the plain law
    area_curve: float = effect("1", -60.0, 60.0, "the area shrinks with strain squared too")
    softening: float = effect("N", -1e7, 1e7, "passive force over strain squared")
    stiffening: float = effect("N", -1e8, 1e8, "passive force over strain to the fourth")

    def tension(self, drive: ArrayLike, strain: ArrayLike) -> NDArray[np.float64]:
        """Return the force [N] at effective pressure ``drive`` [Pa] and ``strain`` [1]."""
        w, e = np.asarray(drive, float), np.asarray(strain, float)
        force = self.area_at(e) * w - self.passive(e)
        return force + self.mapped(w, e)[0] if self.finer else force

    @property
    def finer(self) -> bool:
        """Whether the static law has a finer map."""
        return any(getattr(self, name) != 0.0 for name in MAP_SIZES)

    def mapped(
        self, drive: ArrayLike, strain: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the force [N] of the finer map, and its derivative by pressure [m2]."""
        sizes = np.zeros((6, 6))
        for (p, e), name in zip(MAP_TERMS, MAP_SIZES, strict=True):
            sizes[p, e] = getattr(self, name)
        scaled = 2.0 * np.asarray(drive, float) / self.map_pressure - 1.0
        u = np.clip(scaled, -1.0, 1.0)
        s = np.clip(2.0 * np.asarray(strain, float) / self.map_strain - 1.0, -1.0, 1.0)
        u, s, scaled = np.broadcast_arrays(u, s, scaled)
        rising = chebval2d(u, s, chebder(sizes)) * (u == scaled) * 2.0 / self.map_pressure
        return np.asarray(chebval2d(u, s, sizes)), np.asarray(rising)

    def area_at(self, strain: ArrayLike) -> NDArray[np.float64]:
        """Return the effective area [m2] at a strain."""
        e = np.asarray(strain, float)
        return np.asarray(self.area * (1.0 - self.area_taper * e - self.area_curve * e**2))

    def volume_at(self, strain: ArrayLike) -> NDArray[np.float64]:
        """Return the inner volume [m3] at a strain."""
        laws: Any = (self.rest_length, self.diameter, self.area, self.area_taper, self.area_curve)
        return np.asarray(volume(np.asarray(strain, float), *laws))  # type: ignore[arg-type]

    def passive(self, strain: ArrayLike) -> NDArray[np.float64]:
        """Return the force [N] with which tube and braid resist contraction."""
        e = np.asarray(strain, float)
        return np.asarray(
            self.braid_force * -np.expm1(-e / self.braid_strain)
            + self.stiffness * e
            + self.softening * e**2
            + self.hardening * e**3
            + self.stiffening * e**4
        )

    def drive(self, force: ArrayLike, strain: ArrayLike) -> NDArray[np.float64]:
        """Return the effective pressure [Pa] that gives ``force`` [N] at ``strain`` [1]."""
        e = np.asarray(strain, float)
        area, pull = self.area_at(e), np.asarray(force, float) + self.passive(e)
        found = pull / area
        for _ in range(NEWTON_STEPS if self.finer else 0):
            more, gain = self.mapped(found, e)
            step = (area * found + more - pull) / np.maximum(area + gain, LEAST_GAIN * area)
            found = found - step
            if np.all(abs(step) < CLOSE):
                break
        return found


@kernel
def tension(
    drive: float,
    strain: float,
    slack: float,
    area: float,
    taper: float,
    braid_force: float,
    stiffness: float,
    hardening: float,
) -> float:
    """Return the force [N]; ``slack`` is ``exp(-strain / braid_strain)``."""
    return (
        area * (1.0 - taper * strain) * drive
        - braid_force * (1.0 - slack)
        - (stiffness + hardening * strain * strain) * strain
    )


@kernel
def tension_slope(
    drive: float,
    strain: float,
    slack: float,
    area: float,
    taper: float,
    braid_slope: float,
    stiffness: float,
    hardening: float,
) -> float:
    """Return minus the derivative of the force with respect to strain [N], positive.

    ``braid_slope`` is ``braid_force / braid_strain``.
    """
    return (
        area * taper * drive + braid_slope * slack + stiffness + 3.0 * hardening * strain * strain
    )


@kernel
def volume(
    strain: float, rest_length: float, diameter: float, area: float, taper: float, curve: float
) -> float:
    """Return the inner volume [m3], by virtual work: its change with length is the area.

    ``diameter`` [m] is that of the bore at rest.
    """
    bore = 0.25 * math.pi * diameter * diameter
    grown = area * strain * (1.0 - (0.5 * taper + curve * strain / 3.0) * strain)
    return rest_length * (bore + grown)


@kernel
def fine_tension(
    drive: float, strain: float, area: float, curve: float, k2: float, k4: float
) -> float:
    """Return the force [N] of the finer terms of the static map."""
    e2 = strain * strain
    return -(area * curve * drive + k2 + k4 * e2) * e2


@kernel
def fine_slope(
    drive: float, strain: float, area: float, curve: float, k2: float, k4: float
) -> float:
    """Return minus the derivative of :func:`fine_tension` with respect to strain [N]."""
    return 2.0 * (area * curve * drive + k2 + 2.0 * k4 * strain * strain) * strain


@kernel
def law_and_slope(
    drive: float, middle: float, strain: float, stiffer: float, area: float, taper: float,
    force: float, braid_strain: float, k1: float, k3: float, curve: float, k2: float, k4: float,
) -> tuple[float, float]:  # fmt: skip
    """Return the force [N] of the static law with its finer terms, at an effective pressure [Pa].

    Then minus its derivative by strain [N] at another one, ``middle``. ``stiffer`` is a factor on
    the passive force, and ``k1`` to ``k4`` are its coefficients by the power of strain.
    """
    force, k1, k3 = force * stiffer, k1 * stiffer, k3 * stiffer
    k2, k4 = k2 * stiffer, k4 * stiffer
    slack = decay(strain / braid_strain)
    pull = tension(drive, strain, slack, area, taper, force, k1, k3)
    slope = tension_slope(middle, strain, slack, area, taper, force / braid_strain, k1, k3)
    pull = pull + fine_tension(drive, strain, area, curve, k2, k4)
    return pull, slope + fine_slope(middle, strain, area, curve, k2, k4)
