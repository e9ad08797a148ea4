"""What is scored of the knee's brace and of a gait, beyond what every family has.

Which of these a track has is written in its scenario file (``metrics: [range, gait]``). A gait is
scored by phase: the tension where the heel bears weight, the angle where it does not, each
``gate`` as it truly is. All arrays have one entry per control period and are in SI.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pam_envs.muscle.emg import calibration, emg_proxy

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

RANGE: dict[str, str] = {"rms_percent": "%", "saturated_time": "1"}
"""Error over half the range of the reference, and share of time at the capacity."""
GAIT: dict[str, str] = {
    "angle_rms": "rad",
    "angle_rms_percent": "%",
    "tension_jump": "N",
    "pressure_jump": "Pa",
    "torque_rms": "N m",
    "torque_ideal_rms": "N m",
    "over_assistance": "N m",
    "emg_ratio": "1",
    "emg_flexors_ratio": "1",
    "emg_ratio_fitted_a": "1",
    "emg_ratio_fitted_b": "1",
}
"""Of a gait. Ratios are of the RMS with the orthosis over that without: ``emg_ratio`` uncalibrated
and predicted; the two *fitted* ones with one constant an activity that was chosen to give the
paper's reductions."""

JUMP_SECONDS = 0.5
"""After a switch to stance, in which the tension's largest error is its jump."""
BRIEF_SECONDS = 0.1
"""After a switch, in which the pressure's largest change is its jump."""
SWING_SECONDS = 0.3
"""Swing before a switch that makes it one: a heel that is lifted chatters."""


def half_range(reference: Array) -> float:
    """Return half the range of a reference; NaN where it does not move."""
    half = 0.5 * float(np.ptp(reference)) if len(reference) else 0.0
    return half if half > 0.0 else float("nan")


def rms(error: Array) -> float:
    """Return the root mean square of an error, NaN of none."""
    return float(np.sqrt(np.mean(np.square(error)))) if len(error) else float("nan")


def landings(stance: Array, period: float) -> NDArray[np.int64]:
    """Return the first samples of stance after a swing that was one.

    Parameters
    ----------
    stance : (n,) array
        1 in stance, as the controller sees it.
    period : float [s]
    """
    before = round(SWING_SECONDS / period)
    rises = np.flatnonzero(np.diff(stance) > 0.0) + 1
    return np.array([k for k in rises if k >= before and not stance[k - before : k].any()], int)


def largest_after(signal: Array, starts: NDArray[np.int64], samples: int) -> float:
    """Return the mean over starts of the largest size of a signal from there on, NaN of none."""
    sizes = [np.abs(signal[k : k + samples]).max() for k in starts if k + samples <= len(signal)]
    return float(np.mean(sizes)) if sizes else float("nan")


def pressure_jump(pressure: Array, starts: NDArray[np.int64], samples: int) -> float:
    """Return the mean over starts of the largest change of pressure [Pa] from there on."""
    sizes = [
        np.abs(pressure[k : k + samples] - pressure[k - 1]).max()
        for k in starts
        if k + samples <= len(pressure)
    ]
    return float(np.mean(sizes)) if sizes else float("nan")


def of_range(signals: Mapping[str, Array], window: Mask, gate: Mask) -> dict[str, float]:
    """Return the metrics of ``RANGE``.

    Parameters
    ----------
    signals : mapping of (n,) array
    window : (n,) array of bool
        After settling.
    gate : (n,) array of bool
        Where the tension is tracked as well.
    """
    reference = signals["reference"][gate]
    error = signals["output"][gate] - reference
    return {
        "rms_percent": 100.0 * rms(error) / half_range(reference),
        "saturated_time": float(np.mean(signals["cost/pressure"][window] > 0.0)),
    }


def of_gait(
    signals: Mapping[str, Array], window: Mask, gate: Mask, period: float, activity: str
) -> dict[str, float]:
    """Return the metrics of ``GAIT``; the other parameters are those of :func:`of_range`.

    Parameters
    ----------
    period : float [s]
    activity : {"walk", "stairs_up", "stairs_down"}
        Whose constants the fitted readings take.
    """
    swing = window & (signals["state/stance"] < 0.5)
    path = signals["state/angle_reference"][swing]
    off = rms(signals["state/angle"][swing] - path)
    seen = signals["sensor/stance"][window]
    starts, brief = landings(seen, period), round(BRIEF_SECONDS / period)
    error = (signals["output"] - signals["reference"])[window]
    torque = signals["state/torque"]
    return {
        "angle_rms": off,
        "angle_rms_percent": 100.0 * off / half_range(path),
        "tension_jump": largest_after(error, starts, round(JUMP_SECONDS / period)),
        "pressure_jump": pressure_jump(signals["state/pressure"][window], starts, brief),
        "torque_rms": rms((torque - signals["state/torque_reference"])[gate]),
        "torque_ideal_rms": rms((torque - signals["state/torque_ideal"])[gate]),
        "over_assistance": float(np.mean(signals["effort/over_assistance"][window])),
        **emg(signals, window, period, activity),
    }


def emg(
    signals: Mapping[str, Array], window: Mask, period: float, activity: str
) -> dict[str, float]:
    """Return the assisted over unassisted ratios of the EMG proxy, in its three readings."""

    def ratio(reading: str, muscle: str) -> float:
        names = (f"effort/{muscle}{reading}", f"effort/{muscle}_free{reading}")
        helped, alone = (rms(signals[name][window]) for name in names)
        return helped / alone if alone > 0.0 else float("nan")

    estimate, torque = (signals[f"state/{name}"][window] for name in ("estimate", "torque"))
    constant = calibration(activity, "B")
    power_law = emg_proxy(estimate, torque, period, reading="B", constant=constant)

    return {
        "emg_ratio": ratio("", "extensors"),
        "emg_flexors_ratio": ratio("", "flexors"),
        "emg_ratio_fitted_a": ratio("_calibrated", "extensors"),
        "emg_ratio_fitted_b": 1.0 + power_law.change,
    }
