"""Tables of :mod:`pam_envs.references.gait` from measured and synthetic strides.

Run ``python -m pam_envs.identification.gait_tables`` to write them.

Angles pass through their Fourier series, so that accelerations are smooth, and are met exactly at
the knots. Forces and centres of pressure are used as spline coefficients, which smooths them by
about 1 % of a stride and keeps zero zero.
"""

import csv
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from pam_envs.arrays import Array
from pam_envs.constants import GRAVITY
from pam_envs.references.gait import ACTIVITIES, FOLDER, SIGNALS

POINTS = 100
SHANK = 0.43  # length of the shank [m] of the subject, knee to ankle
HARMONICS = 8
SHIFT = {"low": -0.06, "high": 0.2}
"""Range of the centre of pressure on the sole [m ahead of the ankle]."""

KNOTS = (0.0, 0.15, 0.3, 0.5, 0.65, 0.8, 1.0)
STAIRS: dict[str, dict[str, tuple[float, ...]]] = {
    # degrees; N m/kg; body weights. Synthetic: drawn through published peaks and ranges
    "stairs_up": {
        "knee": (62, 55, 35, 12, 30, 92, 62),
        "moment": (0.1, 1.05, 0.6, 0.05, 0.1, 0.0, 0.1),
        "ground_z": (0, 1.0, 0.85, 1.1, 0, 0, 0),
        "shank": (17, 20, 12, 5, 30, 42, 17),
        "ankle": (5, 18, 12, 0, -15, 10, 5),
    },
    "stairs_down": {
        "knee": (12, 28, 32, 60, 92, 70, 12),
        "moment": (0, 0.6, 0.5, 1.05, 0.15, 0, 0),
        "ground_z": (0, 1.4, 0.85, 0.85, 0, 0, 0),
        "shank": (-6, 12, 18, 38, 57, 30, -6),
        "ankle": (-15, 12, 18, 30, 20, 0, -15),
    },
}


def series(phase: ArrayLike, a: ArrayLike, b: ArrayLike) -> Array:
    """Return ``sum a_n cos(2 pi n phi) + b_n sin(2 pi n phi)``."""
    angle = 2.0 * np.pi * np.multiply.outer(np.asarray(phase, float), np.arange(len(np.array(a))))
    return np.asarray(np.cos(angle) @ np.array(a) + np.sin(angle) @ np.array(b))


def smooth(samples: Array, harmonics: int = HARMONICS) -> Array:
    """Return evenly spaced periodic samples through their first harmonics."""
    spectrum = np.fft.rfft(samples)
    spectrum[harmonics + 1 :] = 0.0
    return np.asarray(np.fft.irfft(spectrum, len(samples)))


def interpolating(samples: Array) -> Array:
    """Return the coefficients of the periodic cubic B-spline that meets the samples."""
    turns = np.arange(len(samples) // 2 + 1) / len(samples)
    passed = (4.0 + 2.0 * np.cos(2.0 * np.pi * turns)) / 6.0
    return np.asarray(np.fft.irfft(np.fft.rfft(samples) / passed, len(samples)))


def _filled(values: Array, known: NDArray[np.bool_]) -> Array:
    """Return periodic samples with the unknown ones on straight lines between the known."""
    where = np.flatnonzero(known)
    n = len(values)
    return np.interp(np.arange(n), where, values[where], period=n)


def walk(folder: Path = FOLDER) -> dict[str, Array]:
    """Return the coefficients of level walking from the measured stride."""
    data = np.genfromtxt(folder / "gait_walk_stride.csv", delimiter=",", names=True)[:POINTS]
    fourier = json.loads((folder / "gait_walk_fourier.json").read_text(encoding="utf-8"))
    phase = np.arange(POINTS) / POINTS
    knee = np.radians(series(phase, fourier["kn"]["a"], fourier["kn"]["b"]))
    ankle = np.radians(series(phase, fourier["an"]["a"], fourier["an"]["b"]))
    shank = smooth(np.arcsin(data["knee_minus_ankle_x_m"] / SHANK))
    on_ground = np.isfinite(data["cop_minus_ankle_m"])
    vertical = np.where(on_ground, np.maximum(0.0, data["grf_vertical_BW"]), 0.0)
    return {
        "knee": interpolating(knee),
        "shank": interpolating(shank),
        "ground_z": vertical,
        "ground_x": np.where(on_ground, data["grf_fore_aft_BW"], 0.0),
        "cop": _filled(data["cop_minus_ankle_m"], on_ground),
        "ankle": interpolating(ankle),
    }


def _drawn(values: tuple[float, ...]) -> Array:
    """Return a periodic curve without overshoot through the knots."""
    knots = np.array(KNOTS)
    wide = np.concatenate([knots[:-1] - 1.0, knots, knots[1:] + 1.0])
    level = np.concatenate([values[:-1], values, values[1:]])
    return np.asarray(PchipInterpolator(wide, level)(np.arange(POINTS) / POINTS))


def stairs(activity: str) -> dict[str, Array]:
    """Return the coefficients of a synthetic stride on stairs.

    The centre of pressure is where the drawn knee torque puts it, on the sole; there is no
    horizontal force.
    """
    drawn = {name: _drawn(values) for name, values in STAIRS[activity].items()}
    angles = {name: smooth(np.radians(drawn[name])) for name in ("knee", "shank", "ankle")}
    vertical = drawn["ground_z"]
    carries = vertical > 0.15
    arm = drawn["moment"] / (GRAVITY * np.maximum(vertical, 0.15))
    cop = np.clip(SHANK * np.sin(angles["shank"]) - arm, SHIFT["low"], SHIFT["high"])
    return {
        "knee": interpolating(angles["knee"]),
        "shank": interpolating(angles["shank"]),
        "ground_z": vertical,
        "ground_x": np.zeros(POINTS),
        "cop": _filled(cop, carries),
        "ankle": interpolating(angles["ankle"]),
    }


def tables(folder: Path = FOLDER) -> dict[str, dict[str, Array]]:
    """Return the coefficients of every activity, by signal."""
    return {"walk": walk(folder)} | {name: stairs(name) for name in ACTIVITIES[1:]}


def write(activity: str, curves: Mapping[str, Array], folder: Path = FOLDER) -> Path:
    """Write one table; the numbers have 9 decimals."""
    path = folder / f"gait_{activity}.csv"
    with open(path, "w", encoding="utf-8", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(SIGNALS)
        for k in range(POINTS):
            out.writerow([f"{curves[name][k]:.9f}" for name in SIGNALS])
    return path


if __name__ == "__main__":
    for name, made in tables().items():
        print(write(name, made))
