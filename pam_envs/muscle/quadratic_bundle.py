"""Bundle of pneumatic muscles as a spring that is quadratic in contraction: chakarov2018.

    P = X (L_n - C) (C_max - C),    X = k0 + k1 p
    k = dP/dC = X (2 C - L_n - C_max)

(Eqs. 5 to 7), with ``k0`` and ``k1`` linear in the number of muscles. The law is linear in the
pressure, so that its inverse is exact. It is negative beyond ``C_max``, where filling lowers the
force, as the paper's Fig. 2 shows; a plant's bundle is slack there.

The volume is the one whose virtual work is the pressure's share of the force,

    dV/dC = k1 (L_n - C) (C_max - C)

counted from that of ideal braided muscles at their nominal length.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.kernels.build import kernel
from pam_envs.muscle.effects import TemperatureEffects, ViscosityEffects
from pam_envs.muscle.law_correction import FIELDS, LawCorrection
from pam_envs.parameters import assumed, published

_FIT = "chakarov2018, Eq. (6)"
_READ = (
    "chakarov2018, Eq. (6) prints -21 per kPa: up to four muscles would push at 400 kPa; read as "
    "-0.21, with which the force is in proportion to the muscles, as Fig. 4 shows"
)
_ENDS = (
    "of the nominal length: at 28 % contraction filling leaves the force as it is (chakarov2018, "
    "Fig. 2), and with it k1 is that of an ideal braid (4.39 against 4.41 N/(m2 kPa))"
)


@dataclass(frozen=True)
class QuadraticBundle(TemperatureEffects):
    """Muscles side by side, fed together and joined at both ends."""

    muscles: float = published(3.0, "1", 1.0, 40.0, "chakarov2018, section 3: 3 and 7")
    nominal_length: float = published(0.39, "m", 0.05, 2.0, "L_n: chakarov2018, section 2")
    largest_contraction: float = assumed(0.28, "1", 0.05, 0.36, _ENDS, spread=(0.27, 0.3))
    passive_base: float = published(-39.0, "N/m2", -320.0, 5e3, _FIT)
    passive_each: float = published(321.0, "N/m2", 0.0, 5e3, _FIT)
    pressure_base: float = assumed(-2.1e-4, "N/(m2 Pa)", -4e-3, 0.1, _READ)
    pressure_each: float = published(4.41e-3, "N/(m2 Pa)", 1e-4, 0.1, _FIT)
    diameter: float = published(0.016, "m", 2e-3, 0.1, "of the braid: chakarov2018, section 2")
    line_volume: float = assumed(1e-5, "m3", 0.0, 1e-2, "of tube and fittings: 0.5 m of 5 mm bore")
    gain: float = assumed(
        1.0, "1", 0.5, 1.5, "force over that of the law", neutral=1.0, spread=(0.9, 1.1)
    )

    @property
    def reach(self) -> float:
        """Contraction ``C_max`` [m] at which the law's force ends."""
        return self.largest_contraction * self.nominal_length

    @property
    def passive_factor(self) -> float:
        """``k0`` [N/m2]."""
        return self.gain * (self.passive_base + self.passive_each * self.muscles)

    @property
    def pressure_factor(self) -> float:
        """``k1`` [N/(m2 Pa)]."""
        return self.gain * (self.pressure_base + self.pressure_each * self.muscles)

    @property
    def nominal_volume(self) -> float:
        """Inner volume [m3] at the nominal length, tube and fittings with it."""
        sine = 1.0 - 1.0 / (3.0 * (1.0 - self.largest_contraction) ** 2)
        bore = 0.25 * np.pi * self.diameter**2 * sine
        return float(self.muscles * bore * self.nominal_length + self.line_volume)

    def factor(self, pressure: ArrayLike) -> Array:
        """Return ``X = k0 + k1 p`` [N/m2] at a pressure [Pa]."""
        return np.asarray(self.passive_factor + self.pressure_factor * np.asarray(pressure, float))

    def pressure(self, factor: ArrayLike) -> Array:
        """Return the pressure [Pa] of a factor ``X`` [N/m2]: exact."""
        return (np.asarray(factor, float) - self.passive_factor) / self.pressure_factor

    def shape(self, contraction: ArrayLike) -> Array:
        """Return ``(L_n - C) (C_max - C)`` [m2] at a contraction [m]."""
        c = np.asarray(contraction, float)
        return (self.nominal_length - c) * (self.reach - c)

    def slope(self, contraction: ArrayLike) -> Array:
        """Return the derivative [m] of :meth:`shape`, ``2 C - L_n - C_max``."""
        return 2.0 * np.asarray(contraction, float) - self.nominal_length - self.reach

    def law(self, pressure: ArrayLike, contraction: ArrayLike) -> Array:
        """Return the law's force [N], Eq. (5); it may be negative."""
        return self.factor(pressure) * self.shape(contraction)

    def force(self, pressure: ArrayLike, contraction: ArrayLike) -> Array:
        """Return the force [N], 0 where the bundle is slack."""
        return np.maximum(0.0, self.law(pressure, contraction))

    def stiffness(self, pressure: ArrayLike, contraction: ArrayLike) -> Array:
        """Return ``dP/dC`` [N/m] of the law, Eq. (7); negative up to ``C_max``."""
        return self.factor(pressure) * self.slope(contraction)

    def volume(self, contraction: ArrayLike) -> Array:
        """Return the inner volume [m3] at a contraction [m]."""
        c = np.asarray(contraction, float)
        grown = grown_volume(c, self.nominal_length, self.reach)  # type: ignore[arg-type]
        return np.asarray(self.nominal_volume + self.pressure_factor * grown)


@dataclass(frozen=True)
class BundleMuscle(LawCorrection, ViscosityEffects):
    """Effects of each muscle of a bundle, at its strain over the nominal length.

    A bundle has them times the number of its muscles; the correction is also times its ``gain``.
    Inverses of the law and the volume do not use the correction.
    """

    effects: ClassVar[tuple[tuple[str, ...], ...]] = (*ViscosityEffects.effects, FIELDS)


@kernel
def bundle_shape(contraction: float, length: float, reach: float) -> tuple[float, float]:
    """Return ``(L_n - C) (C_max - C)`` [m2] and its derivative [m] at a contraction [m]."""
    return (length - contraction) * (reach - contraction), 2.0 * contraction - length - reach


@kernel
def grown_volume(contraction: float, length: float, reach: float) -> float:
    """Return the integral of the shape [m3] from no contraction to one [m]."""
    c = contraction
    return c * (length * reach - c * (0.5 * (length + reach) - c * (1.0 / 3.0)))


@kernel
def bundle_volume(muscles: float, length: float, share: float, diameter: float) -> float:
    """Return the volume [m3] of ideal braided muscles at their nominal length.

    ``share`` is the largest contraction over the length; it fixes the thread angle, since filled
    muscles end at a braid angle of 54.7 degrees.
    """
    left = 1.0 - share
    sine = 1.0 - 1.0 / (3.0 * left * left)
    return muscles * 0.7853981633974483 * diameter * diameter * sine * length
