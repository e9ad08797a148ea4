"""Effects outside the catalogue, one set for tuning and one for the final run."""

from __future__ import annotations

import numpy as np

from .effect import Kind, Shape, put, whole
from .records import WAVES


def _gain_wander(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Let the pull of pressure wander like a random walk."""
    rng = np.random.default_rng(int(shape["seed"]))
    hertz = np.geomspace(0.01, 0.3, WAVES) * rng.uniform(0.8, 1.25, WAVES)
    size = hertz**-0.8
    put(record, wander=strength)
    record["wave_hz"][0] = hertz
    record["wave_size"][0] = size / np.sqrt(0.5 * np.sum(size**2))
    record["wave_phase"][0] = rng.uniform(0.0, 2 * np.pi, WAVES)


def _pendulum(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Swing the load like a pendulum after every motion, which changes the pull on the wire."""
    omega = 2 * np.pi * shape["hertz"]
    put(record, swing=strength, swing_omega=omega, swing_drive=shape["drive"])


TUNING = {
    # the building shakes the load all the time, with a slow beat [N]
    "vibration": Kind("shake", 1.5, {"shake_hz": (0.3, 3.0), "shake_beat": (0.02, 0.08)}),
    # another muscle fills and vents from the same supply on its own schedule [bar]
    "neighbour_crosstalk": Kind(
        "neighbour",
        0.06,
        {
            "neighbour_period": (3.0, 9.0),
            "neighbour_duty": (0.3, 0.7),
            "neighbour_decay": (0.2, 0.7),
        },
    ),
    # the position sensor holds its last value now and then, for about so long [s]
    "sensor_dropouts": Kind(
        "dropout", 0.05, {"dropout_cell": (2.5, 6.0), "dropout_seed": whole(0, 1000)}
    ),
    "gain_wander": Kind(_gain_wander, 0.004, {"seed": whole(0, 1000)}),
}
FINAL = {
    # a spring stop at a high contraction; strength is its force after 1 mm [N]
    "end_stop": Kind("stop", 0.3, {"stop_at": (0.085, 0.115)}),
    # the regulator dithers its own setpoint all the time [bar]
    "set_point_dither": Kind("dither", 0.04, {"dither_hz": (0.7, 3.5)}),
    "pendulum": Kind(_pendulum, 1.0, {"hertz": (0.6, 1.2), "drive": (0.03, 0.06)}),
    # the bladder snaps into a fold at a high strain and out of it at a low one
    "buckling": Kind("buckle", 0.006, {"buckle_up": (0.10, 0.12), "buckle_down": (0.04, 0.07)}),
    # knocks against the load at irregular times [N]
    "bumps": Kind(
        "bump",
        5.0,
        {"bump_cell": (4.0, 9.0), "bump_length": (0.06, 0.25), "bump_seed": whole(0, 1000)},
    ),
}
