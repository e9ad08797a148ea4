"""Effects of the load on a muscle's static law: pressure shift and stiffening."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pam_envs.kernels.build import kernel
from pam_envs.parameters import effect


@dataclass(frozen=True, kw_only=True)
class LoadEffects:
    """Dependence of the static law on the load."""

    load_curve: float = effect("Pa/N2", -200.0, 200.0, "pressure shift over load squared")
    load_stiffening: float = effect("1/N", -0.015, 0.05, "stiffness gained per newton of load")
    load_stiffening_2: float = effect("1/N2", -2e-4, 1e-3, "the same by load squared")
    load_stiffening_root: float = effect("1/N^0.5", -0.1, 0.5, "the same by the root of the load")


@kernel
def stiffening(weight: float, linear: float, square: float, root: float) -> float:
    """Return the factor on the passive force under a weight [N]."""
    return 1.0 + (linear + square * weight) * weight + root * math.sqrt(max(0.0, weight))
