"""How far torque and stiffness of an elbow orthosis reach, and how far off they can be."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pam_envs.parameters import declarations
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis

LEAST_RANGES, ROUND = (30.0, 15.0), 5.0
"""Torque [N m] and stiffness [N m/rad] that the signals reach at least, and a multiple of which
they do."""


def _corners(plant: ElbowOrthosis) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return torque and stiffness at the corners of the pressures, over all angles."""
    return plant.corners(np.linspace(*plant.hard_limits, 49))


def signal_ranges(plant: ElbowOrthosis) -> tuple[float, float]:
    """Return the largest torque [N m] and stiffness [N m/rad] that signals can show.

    The largest at any corner of the pressures, rounded up: nothing that the nominal bundles can do
    is cut off.
    """
    return tuple(  # type: ignore[return-value]
        max(least, ROUND * math.ceil(float(np.abs(values).max()) / ROUND))
        for values, least in zip(_corners(plant), LEAST_RANGES, strict=True)
    )


def largest_errors(plant: ElbowOrthosis) -> tuple[float, float]:
    """Return more than torque [N m] and stiffness [N m/rad] can ever be off.

    References lie between the corners of the nominal bundles; true ones can be stronger by the
    largest gain that is allowed.
    """
    torques, stiffnesses = _corners(plant)
    strongest = declarations(plant.bundle_a)["gain"].high
    return strongest * float(np.ptp(torques)), strongest * float(stiffnesses.max())
