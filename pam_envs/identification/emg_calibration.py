"""Calibration of the two EMG readings to the three reductions of yeh2010.

Run ``python -m pam_envs.identification.emg_calibration`` to write them. Each constant is *fitted*
to one published figure and predicts nothing: an orthosis is assumed that delivers 20 % of Eq. (1)
exactly and at once, independently of the gait. Reading A then needs a true demand of
``0.2 / reduction`` of Eq. (1), reading B a power ``log(1 - reduction) / log(0.8)``. Behind the
eighth-order low-pass, 0.16 s late, and in stance alone, no constant of reading A would give the
published -36 % for the walk of this package (-32 % at best).
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import yaml
from scipy.optimize import brentq

from pam_envs.arrays import Array
from pam_envs.constants import GRAVITY
from pam_envs.mechanics.leg import centre_of_pressure
from pam_envs.muscle.emg import CONSTANTS, Reading, emg_proxy
from pam_envs.plants.knee_orthosis.plant import Activity, KneeOrthosis
from pam_envs.references.gait import NATURAL_STRIDE, PAPER_STRIDE, gait_curves, shared_load
from pam_envs.sensing.butterworth import PERIOD, filtered
from pam_envs.sensing.shoe import estimated_torque, heel_load

PUBLISHED: dict[Activity, float] = {
    "walk": 0.07 / 0.11 - 1.0,
    "stairs_up": -0.33,
    "stairs_down": -0.261,
}
"""Change of the EMG's RMS with the orthosis on: 0.11 to 0.07 V, and two percentages (section 5)."""
ASSISTANCE_RATIO = 0.2
RANGES: dict[Reading, tuple[float, float]] = {"A": (0.2, 3.0), "B": (0.3, 8.0)}
STRIDES = 3


def stride_torques(
    activity: Activity, stride: float = PAPER_STRIDE, changes: Mapping[str, float] | None = None
) -> tuple[Array, Array]:
    """Return Eq. (1) and the reference's assistance [N m] over one stride in steady walking.

    The reference is 20 % of Eq. (1) behind the eighth-order low-pass while the heel is loaded, and
    never less than the wire gives past its relaxed angle, where a muscle cannot push.
    """
    plant = KneeOrthosis.on_leg(activity, stride, "none").replace(changes or {})
    leg, shoe = plant.leg, plant.shoe
    n = round(stride / PERIOD)
    curves = gait_curves(activity, np.arange(STRIDES * n) / n)
    quick, sole = NATURAL_STRIDE / stride, (shoe.heel, shoe.tip)
    other = gait_curves(activity, 0.5 + np.arange(STRIDES * n) / n)["ground_z"]
    loaded = np.asarray(shared_load(curves["ground_z"], other, quick))  # type: ignore[arg-type]
    vertical = loaded * leg.body_mass * GRAVITY
    cop = [
        centre_of_pressure(r, x, z, quick, leg.aim_height, *sole)
        for r, x, z in zip(curves["cop"], curves["ground_x"], loaded, strict=True)
    ]
    torque = estimated_torque(vertical, np.array(cop), np.sin(curves["shank"]), leg.shank)  # type: ignore[arg-type]
    heel = [heel_load(f, r, *sole) for f, r in zip(vertical, cop, strict=True)]
    stance = np.array(heel) > shoe.threshold
    wire = -plant.lever.spring_torque(plant.lever.mount_angle + curves["knee"])
    desired = np.where(stance, filtered(ASSISTANCE_RATIO * torque), 0.0)
    return np.asarray(torque)[-n:], np.maximum(desired, wire)[-n:]


def change(
    activity: Activity, reading: Reading, constant: float, as_referred: bool = False
) -> float:
    """Return the change of the proxy's RMS for a constant.

    With ``as_referred`` the assistance is the reference of :func:`stride_torques`, late and in
    stance alone, instead of 20 % of Eq. (1) at once.
    """
    torque, late = stride_torques(activity)
    helped = late if as_referred else ASSISTANCE_RATIO * torque
    two = (np.tile(torque, 2), np.tile(helped, 2))
    return emg_proxy(*two, PERIOD, reading=reading, constant=constant).change


def fitted() -> dict[str, dict[Activity, float]]:
    """Return the constant of each reading and activity."""
    return {
        reading: {
            activity: round(
                brentq(
                    lambda c, a=activity, r=reading: change(a, r, c) - PUBLISHED[a],
                    *bounds,
                    xtol=1e-9,
                ),
                4,
            )
            for activity in PUBLISHED
        }
        for reading, bounds in RANGES.items()
    }


def write(path: Path = CONSTANTS) -> None:
    """Write the constants."""
    data = {
        "provenance": "fitted",
        "source": "yeh2010, section 5: EMG 0.11 to 0.07 V walking, -33 % up, -26.1 % down stairs",
        "assumed": "20 % of Eq. (1) delivered exactly and at once",
        "readings": fitted(),
    }
    path.write_text(yaml.safe_dump(data, sort_keys=False), encoding="utf-8")


if __name__ == "__main__":
    write()
    print(CONSTANTS.read_text(encoding="utf-8"))
