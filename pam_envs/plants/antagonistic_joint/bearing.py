"""Static load check: the weights that the muscles bear at the angles of a plan."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.plants.antagonistic_joint.statics import PairPlant

SMALLEST_ARM = 1e-12


class UnbearableLoad(ValueError):
    """The muscles cannot hold the weight at an angle of the plan."""


def bearable_payload(plant: PairPlant, angles: ArrayLike, by_pressure: bool = False) -> float:
    """Return the largest payload [kg] that is borne at all angles (k, n) [rad]; below 0 if none is.

    ``by_pressure``: pressures are set, so that the limits of angle setpoints do not apply.
    """
    low, high = plant.torque_range(angles, by_pressure)
    empty = plant.weight_torque(angles)
    each = plant.weight_torque(angles, 1.0) - empty
    if np.any(empty > high) or np.any(empty < low):
        return -1.0
    room = np.where(each > 0.0, high - empty, empty - low)
    return float(np.min(room / np.maximum(np.abs(each), SMALLEST_ARM)))


def check_borne(
    plant: PairPlant, angles: ArrayLike, payload: float, where: str, by_pressure: bool = False
) -> None:
    """Raise :class:`UnbearableLoad` where the muscles cannot hold a plan's angles (k, n) [rad].

    ``payload`` is the heaviest [kg], ``where`` the subject of the error's sentence.
    """
    low, high = plant.torque_range(angles, by_pressure)
    needed_torque = plant.weight_torque(angles, payload)
    short = np.maximum(needed_torque - high, low - needed_torque)
    pose, joint = np.unravel_index(int(np.argmax(short)), short.shape)
    if short[pose, joint] <= 0.0:
        return
    needed = float(needed_torque[pose, joint])
    there = float((high if needed > high[pose, joint] else low)[pose, joint])
    most = bearable_payload(plant, angles, by_pressure)
    remedy = (
        f"give it a payload of {most:.3g} kg or less, payload_change included"
        if most >= 0.0
        else "nor is it borne without a payload: take lighter links, or smaller angles"
    )
    raise UnbearableLoad(
        f"{where}, pose {pose}: with {payload:g} kg of payload joint {joint} needs "
        f"{abs(needed):.3g} N m at {np.degrees(np.asarray(angles)[pose, joint]):.1f} degrees and "
        f"its muscles exert {np.sign(needed) * there + 0.0:.3g} N m there at most; {remedy}"
    )
