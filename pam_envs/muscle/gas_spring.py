"""A muscle as a gas spring whose stiffness follows its pressure.

    T = s (L - L_min),    s = alpha P  where there is no hysteresis

(yeh2010, Eq. 6). A muscle at its shortest length, or with no stiffness, is slack. The volume is
the one whose virtual work is this tension, ``T = -P dV/dL``, without its correction
(:mod:`pam_envs.muscle.law_correction`).
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.kernels.build import kernel
from pam_envs.muscle.effects import LengthYieldTailEffects, TemperatureEffects, ViscosityEffects
from pam_envs.muscle.law_correction import FIELDS, LawCorrection
from pam_envs.parameters import assumed, declarations, derived


@dataclass(frozen=True)
class GasSpring(LawCorrection, LengthYieldTailEffects, ViscosityEffects, TemperatureEffects):
    """The muscle of the orthosis; inverses of its law do not use the correction."""

    effects: ClassVar[tuple[tuple[str, ...], ...]] = (
        *TemperatureEffects.effects,
        *ViscosityEffects.effects,
        tuple(declarations(LengthYieldTailEffects)),
        FIELDS,
    )

    shortest_length: float = assumed(0.17, "m", 0.02, 1.0, "L_min: 5 cm below yeh2010's nominal")
    gain: float = assumed(
        1.0, "1", 0.5, 1.5, "stiffness over that of the hysteresis", neutral=1.0, spread=(0.9, 1.1)
    )
    stiffness_ratio: float = derived(
        0.0158,
        "N/(m Pa)",
        1e-4,
        1.0,
        "alpha: 158 N at 2 bar (yeh2010, section 4.1)",
        spread=(0.0142, 0.0174),
    )
    full_volume: float = derived(
        1.33e-4, "m3", 1e-6, 1e-2, "Eq. (5) corrected, at L_min: 2.43 turns of 29.4 cm"
    )

    def tension(self, stiffness: ArrayLike, length: ArrayLike) -> NDArray[np.float64]:
        """Return the tension [N] at a stiffness [N/m] and a length [m]."""
        stretch = np.maximum(0.0, np.asarray(length) - self.shortest_length)
        return np.asarray(np.maximum(0.0, stiffness) * stretch)

    def volume_at(self, length: ArrayLike) -> NDArray[np.float64]:
        """Return the inner volume [m3] at a length [m]."""
        shape = (self.shortest_length, self.stiffness_ratio, self.full_volume)
        return np.asarray(gas_volume(np.asarray(length, float), *shape))  # type: ignore[arg-type]

    def stiffness(self, tension: ArrayLike, length: ArrayLike) -> NDArray[np.float64]:
        """Return the stiffness ``T / dL`` [N/m] that gives a tension [N] at a length [m].

        Within 0.1 mm of the shortest length the value at 0.1 mm is used.
        """
        stretch = np.maximum(1e-4, np.asarray(length) - self.shortest_length)
        return np.asarray(tension) / stretch


@kernel
def stretch_of(length: float, shortest: float) -> float:
    """Return the length beyond the shortest one [m]; 0 if the muscle is slack."""
    return max(0.0, length - shortest)


@kernel
def spring_tension(stiffness: float, stretch: float) -> float:
    """Return the tension [N]."""
    return max(0.0, stiffness) * stretch


@kernel
def gas_volume(length: float, shortest: float, ratio: float, full: float) -> float:
    """Return the inner volume [m3] at a length [m]."""
    stretch = length - shortest
    return full - 0.5 * ratio * stretch * stretch
