"""Ranges and largest errors of torque and stiffness of an elbow orthosis."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pam_envs.parameters import declarations
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis

LEAST_RANGES, ROUND = (30.0, 15.0), 5.0
"""Smallest ranges of torque [N m] and stiffness [N m/rad], and the step of rounding."""


def _corners(plant: ElbowOrthosis) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return torque and stiffness at the corners of the pressures, over all angles."""
    return plant.corners(np.linspace(*plant.hard_limits, 49))


def signal_ranges(plant: ElbowOrthosis) -> tuple[float, float]:
    """Return the ranges of the signals of torque [N m] and stiffness [N m/rad].

    The largest values at any corner of the pressures, rounded up.
    """
    return tuple(  # type: ignore[return-value]
        max(least, ROUND * math.ceil(float(np.abs(values).max()) / ROUND))
        for values, least in zip(_corners(plant), LEAST_RANGES, strict=True)
    )


def largest_errors(plant: ElbowOrthosis) -> tuple[float, float]:
    """Return upper bounds of the errors of torque [N m] and stiffness [N m/rad].

    References are between the corners of the nominal bundles; the true bundles can be stronger by
    the largest allowed gain.
    """
    torques, stiffnesses = _corners(plant)
    strongest = declarations(plant.bundle_a)["gain"].high
    return strongest * float(np.ptp(torques)), strongest * float(stiffnesses.max())
