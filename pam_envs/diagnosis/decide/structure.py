"""Structure of a residual: explaining variables, a flexible model, spectral peaks, whiteness.

None of this names a cause; it shows whether anything is left to explain.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter
from scipy.signal import lfilter, welch
from scipy.stats import chi2

from pam_envs.arrays import Array, Flags
from pam_envs.diagnosis.fit.blocks import Blocks

BINS = 12
LAGS = 20
FILTERS = (0.05, 0.2, 1.0, 5.0, 20.0, 60.0)  # time constants [s] of the flexible model's filters
LOWEST_PEAK = 0.15  # lowest frequency of a spectral peak [Hz]
WINDOW, NEAR, LEAST_WINDOWS = 80.0, 12, 4
"""Longest window [s] of a spectrum, bins on either side of a peak's neighbourhood, and least number
of windows: a spectrum without averaging has peaks of noise."""
MOVED = 6.0
"""Height of a peak in the spectrum of the motion above which it is due to the experiment."""
CYCLE = 5e4  # least reversal of the pressure that counts [Pa]


@dataclass(frozen=True)
class Regressors:
    """Variables that may explain a residual, each of shape (T,), and features (n, T) of them."""

    values: dict[str, Array]
    features: Array
    drive: str = "pressure"  # name of the driving signal

    @property
    def motion(self) -> Array:
        """Simulated driving signal, whose spectrum is that of the experiment, shape (T,)."""
        return self.values[self.drive]

    @classmethod
    def make(
        cls,
        time: Array,
        command: Array,
        outputs: Array,
        load: Array,
        temperature: Array | None,
        drive: str = "pressure",
    ) -> "Regressors":
        """Return the regressors of a recording and the simulated outputs (2, T).

        The outputs are the motion, and the driving signal of the size of a pressure [Pa].
        """
        x, p = outputs
        period = float(time[1] - time[0])
        rate = np.gradient(p, period)
        turns = turning_points(p)
        cycle = np.cumsum(turns) / 2.0
        values = {
            "direction": direction_of(p),
            "rate": rate,
            drive: p,
            "load": load,
            "time_since_reversal": since(turns, period),
            "time": time,
            "cycle": cycle,
        }
        if temperature is not None:
            values["temperature"] = temperature
        return cls(values, _features(command, x, values, drive), drive)


def direction_of(pressure: Array) -> Array:
    """Return +1 while inflating and -1 while deflating, by a play operator of 2 kPa."""
    state, out = pressure[0], np.empty(len(pressure))
    way = 1.0
    for i, value in enumerate(pressure):
        if value > state + 2e3:
            state, way = value - 2e3, 1.0
        elif value < state - 2e3:
            state, way = value + 2e3, -1.0
        out[i] = way
    return out


def turning_points(pressure: Array) -> Flags:
    """Return the samples at which the pressure has reversed by at least :data:`CYCLE`."""
    turned = np.zeros(len(pressure), bool)
    top = bottom = pressure[0]
    up = True
    for i, value in enumerate(pressure):
        top, bottom = max(top, value), min(bottom, value)
        if up and value < top - CYCLE:
            turned[i], up, bottom = True, False, value
        elif not up and value > bottom + CYCLE:
            turned[i], up, top = True, True, value
    return turned


def since(marks: Flags, period: float) -> Array:
    """Return the time since the last mark [s]."""
    index = np.arange(len(marks))
    last = np.maximum.accumulate(np.where(marks, index, 0))
    return np.asarray((index - last) * period, np.float64)


def low_pass(signal: Array, tau: float, period: float) -> Array:
    """Return the first-order low-pass of a signal, starting at its first value."""
    a = np.exp(-period / tau)
    filtered, _ = lfilter([1.0 - a], [1.0, -a], signal, zi=[a * signal[0]])
    return np.asarray(filtered)


def _features(command: Array, x: Array, values: dict[str, Array], drive: str) -> Array:
    time, load, p = values["time"], values["load"], values[drive]
    temperature = values.get("temperature")
    period = float(time[1] - time[0])
    way = values["direction"]
    span = max(float(time[-1] - time[0]), 1e-9)
    s = (time - time[0]) / span
    u, f = p / 6e5, load / 50.0
    e = x / max(float(np.ptp(x)), 1e-9)
    rows = [np.ones_like(s), s, s**2, s**3]
    rows += [(s > k / 8.0).astype(float) for k in range(1, 8)]
    for signal in (command / 6e5, e):
        slow = [low_pass(signal, tau, period) for tau in FILTERS]
        rows += [signal, *(signal - v for v in slow)]
    rows += [u, u**2, u**3, way, way * u, way * u**2, way * e * (1.0 - e)]
    rows += [f, f**2, f * u, f * u**2, f * way, f**2 * u, f * e]
    pace = np.gradient(e, period)
    rows += [pace, np.abs(pace), np.tanh(pace / (np.std(pace) + 1e-9)), pace * u, pace * way]
    rows += [np.exp(-values["time_since_reversal"] / t) * way for t in (0.1, 0.5, 2.0)]
    rows += [np.exp(-values["cycle"] / c) for c in (1.0, 4.0)]
    rows += [np.exp(-values["cycle"] / c) * u for c in (1.0, 4.0)]
    rows += [np.maximum(0.0, u - k) for k in (0.1, 0.25, 0.75, 0.9)]
    if temperature is not None:
        warm = (temperature - temperature.mean()) / 5.0
        rows += [warm, warm * u, warm * e]
    return np.array(rows)


def _parts(good: Flags, blocks: Blocks) -> tuple[Flags, Flags] | None:
    """Return training and held-out samples with readings, or None with too few of them."""
    train, test = good & blocks.train, good & ~blocks.train
    return None if train.sum() < 100 or test.sum() < 50 else (train, test)


def _explained(residual: Array, prediction: Array) -> float:
    """Return the share of a residual that a prediction explains, at least 0."""
    error, spread = np.mean((residual - prediction) ** 2), np.mean(residual**2)
    return float(max(0.0, 1.0 - float(error) / max(float(spread), 1e-30)))


def flexible_r2(residual: Array, regressors: Regressors, blocks: Blocks) -> float:
    """Return the share of a residual that ridge regression explains on held-out blocks."""
    parts = _parts(np.isfinite(residual), blocks)
    if parts is None:
        return 0.0
    train, test = parts
    a = regressors.features.T
    mean, scale = a[train].mean(axis=0), a[train].std(axis=0) + 1e-9
    a = (a - mean) / scale
    inner = a[train].T @ a[train]
    outer = a[train].T @ residual[train]
    ridge = 1e-3 * train.sum()
    weights = np.linalg.solve(inner + ridge * np.eye(len(inner)), outer)
    prediction = a @ weights + residual[train].mean()
    return _explained(residual[test], prediction[test])


def binned_r2(residual: Array, variable: Array, blocks: Blocks) -> float:
    """Return the share of a residual explained by its means over bins of a variable, at least 0."""
    good = np.isfinite(residual) & np.isfinite(variable)
    parts = _parts(good, blocks)
    if parts is None or np.ptp(variable[good]) == 0.0:
        return 0.0
    train, test = parts
    edges = np.unique(np.quantile(variable[train], np.linspace(0.0, 1.0, BINS + 1)[1:-1]))
    at = np.searchsorted(edges, variable)
    n = len(edges) + 1
    counts = np.bincount(at[train], minlength=n)
    means = np.bincount(at[train], residual[train], minlength=n) / np.maximum(counts, 1)
    return _explained(residual[test], means[at[test]])


def spectral_peak(
    residual: Array, period: float, motion: Array | None = None
) -> tuple[float, float]:
    """Return frequency [Hz] and relative height of the sharpest spectral peak.

    Peaks of ``motion`` are ignored: sines of an experiment leave lines in every residual, an
    external vibration does not depend on them.
    """
    frequency, heights = _heights(residual, period)
    usable = frequency > LOWEST_PEAK
    if motion is not None:
        usable &= _heights(motion, period)[1] < MOVED
    heights = np.where(usable, heights, 0.0)
    k = int(np.argmax(heights))
    return float(frequency[k]), float(heights[k])


def _heights(signal: Array, period: float) -> tuple[Array, Array]:
    """Return frequencies and the power over the median of the neighbourhood."""
    r = np.nan_to_num(signal - np.nanmean(signal))
    length = max(4 * NEAR, min(int(WINDOW / period), len(r) // LEAST_WINDOWS))
    frequency, power = welch(r, 1.0 / period, nperseg=length, noverlap=length // 2)
    near = median_filter(power, 2 * NEAR + 1, mode="reflect")
    heights = power / np.maximum(near, 1e-300)
    heights[-NEAR:] = 0.0  # no neighbourhood next to half the sampling rate
    return frequency, heights


def ljung_box(residual: Array, lags: int = LAGS) -> float:
    """Return the p-value of the Ljung-Box test of whiteness."""
    r = residual[np.isfinite(residual)]
    return pooled_ljung_box([r], lags) if len(r) >= 10 * lags else float("nan")


def pooled_ljung_box(parts: Sequence[Array], lags: int) -> float:
    """Return the p-value of the Ljung-Box test over several parts of a series."""
    parts = [part - part.mean() for part in parts]
    n, power = sum(map(len, parts)), sum(float(part @ part) for part in parts)
    sums = [sum(float(part[k:] @ part[:-k]) for part in parts) for k in range(1, lags + 1)]
    rho = np.array(sums) / max(power, 1e-300)
    statistic = n * (n + 2) * np.sum(rho**2 / (n - np.arange(1, lags + 1)))
    return float(chi2.sf(statistic, lags))
