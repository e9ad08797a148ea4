"""Metrics of the knee brace and of a gait.

A gait is scored by phase: the tension in stance, the angle in swing. Periods in which the sensed
phase differs from the true one, by noise, count for neither.
"""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from benchmarks.scoring.group import DEGREES, EFFORT, RMS_PERCENT, Column, Group, Mask, Record, rms
from pam_envs.arrays import Array
from pam_envs.muscle.emg import EmgProxy, Reading, calibration, emg_proxy

GAIT_UNITS = {
    "angle_rms": "rad",
    "angle_rms_percent": "%",
    "switch_error": "N",
    "switch_excess": "N",
    "pressure_jump": "Pa",
    "torque_rms": "N m",
    "torque_ideal_rms": "N m",
    "over_assistance": "N m",
    "emg_effort": "1",
    "emg_ratio": "1",
    "emg_extensors_ratio": "1",
    "emg_flexors_ratio": "1",
    "emg_ratio_fitted_a": "1",
    "emg_ratio_fitted_b": "1",
    "emg_extensors_ratio_fitted_a": "1",
    "emg_extensors_ratio_fitted_b": "1",
}
"""Ratios are of the RMS with the orthosis over that without. ``emg_effort`` is of the extensors and
flexors together, saved and added activity alike: 1 for an orthosis that does nothing, about 0.8 for
one that delivers a fifth of the demand. ``emg_ratio`` is uncalibrated and
predicted; the *fitted* ones have one constant an activity, chosen to give the paper's reductions.
In all three the flexors' additional activity is added to the extensors, so that in walking a valve
that is simply open is no reduction; those *of extensors* leave it out, as the paper's electrodes
did. Reading B takes the demand to be all of Eq. (1), twice that of A, and activity to grow as the
square of torque, so that a small torque held against for long costs little. Open at 4.5 bar the
walk has 1.14, by A 1.66, by B 0.77; on stairs, where the knee asks for more than the muscle has,
all three fall below 1."""
EMG_EFFORT: Column = ("emg_effort", "EMG effort", 1.0)
_SATURATED: Column = ("saturated_time", "true pressure at capacity [%]", 100.0)
GAIT_COLUMNS: tuple[Column, ...] = (
    EMG_EFFORT,
    RMS_PERCENT,
    ("angle_rms", "swing: angle RMS [deg]", DEGREES),
    ("switch_error", "error at the switch [N]", 1.0),
    ("switch_excess", "excess after it [N]", 1.0),
    ("pressure_jump", "jump of pressure [bar]", 1e-5),
    ("torque_rms", "assistance RMS, as desired [N m]", 1.0),
    ("torque_ideal_rms", "of the true demand [N m]", 1.0),
    ("emg_ratio", "without what flexors save", 1.0),
    ("emg_extensors_ratio", "of extensors", 1.0),
    ("emg_flexors_ratio", "of flexors", 1.0),
    ("emg_ratio_fitted_a", "fitted, A", 1.0),
    ("emg_ratio_fitted_b", "fitted, B", 1.0),
    *EFFORT,
    _SATURATED,
)

JUMP_SECONDS = 0.5  # window after a switch to stance for the error of the tension
BRIEF_SECONDS = 0.1  # after a switch, in which the pressure's largest change is its jump
SWING_SECONDS = 0.3  # shortest swing before a landing: a heel that is lifted chatters


def half_range(reference: Array) -> float:
    """Return half the range of a reference; NaN where it does not move."""
    half = 0.5 * float(np.ptp(reference)) if len(reference) else 0.0
    return half if half > 0.0 else float("nan")


def landings(stance: Array, period: float) -> NDArray[np.int64]:
    """Return the first samples of stance after a swing; ``stance`` is 1 as the controller sees."""
    before = round(SWING_SECONDS / period)
    rises = np.flatnonzero(np.diff(stance) > 0.0) + 1
    return np.array([k for k in rises if k >= before and not stance[k - before : k].any()], int)


def _windows(signal: Array, starts: NDArray[np.int64], samples: int) -> Iterator[tuple[int, Array]]:
    """Yield each start that ``samples`` follow, with these samples."""
    return ((k, signal[k : k + samples]) for k in starts if k + samples <= len(signal))


def _mean(sizes: list[float]) -> float:
    return float(np.mean(sizes)) if sizes else float("nan")


def largest_after(signal: Array, starts: NDArray[np.int64], samples: int) -> float:
    """Return the mean over starts of a signal's largest later magnitude, NaN without starts."""
    return _mean([np.abs(part).max() for _, part in _windows(signal, starts, samples)])


def excess_after(signal: Array, starts: NDArray[np.int64], samples: int) -> float:
    """Return the mean over starts of the rise of a signal's size above that at the start.

    The error at the start is caused by the previous phase's controller; the excess is the transient
    of the controller that takes over. NaN without starts.
    """
    parts = _windows(signal, starts, samples)
    return _mean([np.abs(part).max() - abs(part[0]) for _, part in parts])


def pressure_jump(pressure: Array, starts: NDArray[np.int64], samples: int) -> float:
    """Return the mean over starts of the largest subsequent change of pressure [Pa]."""
    parts = _windows(pressure, starts, samples)
    return _mean([np.abs(part - pressure[k - 1]).max() for k, part in parts])


def of_range(record: Record) -> dict[str, float]:
    """Return the error over half the reference's range, and the share of time at the capacity.

    For a gait the half-range is a constant of its track: the reference follows the sensed angle and
    thus differs between controllers.
    """
    reference = record.signals["reference"][record.tracked]
    error = record.signals["output"][record.tracked] - reference
    half = record.content.get("half_range") or half_range(reference)
    return {
        "rms_percent": 100.0 * rms(error) / half,
        "saturated_time": float(np.mean(record.signals["cost/pressure"][record.window] > 0.0)),
    }


def of_gait(record: Record) -> dict[str, float]:
    """Return the metrics of ``GAIT_UNITS``."""
    signals, window, period = record.signals, record.window, record.period
    swing = window & (signals["state/stance"] < 0.5) & (signals["sensor/stance"] < 0.5)
    path = signals["state/angle_reference"][swing]
    off = rms(signals["state/angle"][swing] - path)
    seen = signals["sensor/stance"][window]
    starts, brief = landings(seen, period), round(BRIEF_SECONDS / period)
    error = (signals["output"] - signals["reference"])[window]
    torque = signals["state/torque"]
    return {
        "angle_rms": off,
        "angle_rms_percent": 100.0 * off / half_range(path),
        "switch_error": largest_after(error, starts, 1),
        "switch_excess": excess_after(error, starts, round(JUMP_SECONDS / period)),
        "pressure_jump": pressure_jump(signals["state/pressure"][window], starts, brief),
        "torque_rms": rms((torque - signals["state/torque_reference"])[record.tracked]),
        "torque_ideal_rms": rms((torque - signals["state/torque_ideal"])[record.tracked]),
        "over_assistance": float(np.mean(signals["effort/over_assistance"][window])),
        **emg(signals, window, period, record.content["activity"]),
    }


def emg(
    signals: Mapping[str, Array], window: Mask, period: float, activity: str
) -> dict[str, float]:
    """Return the ratios of assisted to unassisted EMG proxy, for its three readings."""
    names = ("extensors", "extensors_free", "flexors", "flexors_free")
    plain = EmgProxy(*(signals[f"effort/{name}"][window] for name in names))
    ratios = {
        "emg_effort": effort_ratio(**vars(plain)),
        "emg_ratio": _ratio(plain.extensors + _more(plain), plain.extensors_free),
        "emg_extensors_ratio": _ratio(plain.extensors, plain.extensors_free),
        "emg_flexors_ratio": _ratio(plain.flexors, plain.flexors_free),
    }
    readings: tuple[Reading, ...] = ("A", "B")
    for reading in readings:
        fitted, end = _fitted(signals, window, period, activity, reading), reading.lower()
        helped = fitted.extensors + _more(fitted)
        ratios[f"emg_ratio_fitted_{end}"] = _ratio(helped, fitted.extensors_free)
        name = f"emg_extensors_ratio_fitted_{end}"
        ratios[name] = _ratio(fitted.extensors, fitted.extensors_free)
    return ratios


def effort_ratio(
    extensors: Array, extensors_free: Array, flexors: Array, flexors_free: Array
) -> float:
    """Return the RMS of all activity with the orthosis over that without, NaN if undefined."""
    return _ratio(extensors + flexors, extensors_free + flexors_free)


def _fitted(
    signals: Mapping[str, Array], window: Mask, period: float, activity: str, reading: Reading
) -> EmgProxy:
    """Return a calibrated reading of the recorded torques within a window."""
    constant = calibration(activity, reading)
    torques = (signals["state/estimate"], signals["state/torque"])
    proxy = emg_proxy(*torques, period, reading=reading, constant=constant)
    return EmgProxy(*(np.asarray(part)[window] for part in vars(proxy).values()))


def _more(proxy: EmgProxy) -> Array:
    """Return the additional activity of the flexors with the orthosis."""
    return np.maximum(0.0, proxy.flexors - proxy.flexors_free)


def _ratio(helped: Array, alone: Array) -> float:
    """Return the ratio of two RMS values, NaN if undefined."""
    return rms(helped) / rms(alone) if rms(alone) > 0.0 else float("nan")


RANGE = Group(
    "range",
    {"rms_percent": "%", "saturated_time": "1"},
    of_range,
    lambda errors: (RMS_PERCENT, *errors[:2], errors[3], *EFFORT, _SATURATED),
)
GAIT = Group(
    "gait",
    GAIT_UNITS,
    of_gait,
    lambda errors: GAIT_COLUMNS,
    needs=("activity",),
    headline=(EMG_EFFORT,),
    costs={"emg_effort": "EMG effort"},
)
