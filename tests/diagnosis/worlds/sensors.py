"""Readings: sampling with the logger's clock, effects of the sensors, noise."""

import math

import numpy as np
from numba import njit

from .forms import Effect
from .rig import Noise


@njit(cache=True)
def _mode(signal: np.ndarray, hertz: float, damping: float, dt: float) -> np.ndarray:
    """Response of a lightly damped mode of unit gain to a signal, less the signal."""
    out = np.empty_like(signal)
    rate = 2.0 * math.pi * hertz
    y, v = signal[0], 0.0
    for i in range(signal.size):
        v = (v + dt * rate * rate * (signal[i] - y)) / (1.0 + 2.0 * damping * rate * dt)
        y += dt * v
        out[i] = y - signal[i]
    return out


@njit(cache=True)
def _lagged(signal: np.ndarray, tau: float, dt: float) -> np.ndarray:
    """Signal after a first-order lag."""
    out = np.empty_like(signal)
    y = signal[0]
    for i in range(signal.size):
        y += (signal[i] - y) * dt / (tau + dt)
        out[i] = y
    return out


def late(signal: np.ndarray, form: int, delay: float, dt: float) -> np.ndarray:
    """Return a signal later by `delay` [s]: transport, or a lag with half of it as transport."""
    shift = delay if form == 0 else 0.4 * delay
    grid = np.arange(signal.size, dtype=float)
    moved = np.interp(grid - shift / dt, grid, signal)
    return moved if form == 0 else _lagged(moved, 0.6 * delay, dt)


def _grown(effect: Effect, time: np.ndarray) -> np.ndarray:
    """Course of a bias or drift of size 1 over time [-]."""
    _, sign, first, second = effect.constants
    if effect.name == "sensor_bias":
        if effect.form == 0:
            return sign * (1.0 - np.exp(-np.maximum(time - first, 0.0) / second))
        return sign / (1.0 + np.exp(-np.clip((time - first) / (0.25 * second), -60.0, 60.0)))
    if effect.form == 0:
        return sign * time / 120.0
    wave = np.sin(2 * np.pi * time / first + second) - np.sin(second)
    return sign * (0.8 * wave + 0.7 * np.sqrt(time / 200.0))


def _bent(effect: Effect, reading: np.ndarray) -> np.ndarray:
    """Error of a sensor that bends over its span, of peak about 1 [-]."""
    _, sign, span = effect.constants
    u = reading / span
    if effect.form == 0:
        return sign * 4.0 * u * (1.0 - u)
    return sign * np.sin(2 * np.pi * u)


def _slipped(effect: Effect, pressure: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Course of a clamp that gives way at the first high pressure after a time [-]."""
    start, level, width = effect.constants
    ready = np.flatnonzero((time >= start) & (pressure > level))
    if ready.size == 0:
        ready = np.flatnonzero(time >= min(start, 0.5 * time[-1]))
    since = time - time[ready[0]]
    if effect.form == 0:
        return -(since >= 0.0).astype(float)
    return -(1.0 - np.exp(-np.maximum(since, 0.0) / width))


def distort(
    effects: list[tuple[Effect, float]],
    pressure: np.ndarray,
    position: np.ndarray,
    dt: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return both readings at every step with the sensors' effects."""
    time = dt * np.arange(pressure.size)
    readings = [position, pressure]
    for effect, amplitude in effects:
        size = effect.strength(amplitude)
        if size == 0.0:
            continue
        if effect.name in ("sensor_bias", "sensor_drift"):
            channel = int(effect.constants[0])
            readings[channel] = readings[channel] + size * _grown(effect, time)
        elif effect.name == "sensor_nonlinearity":
            channel = int(effect.constants[0])
            readings[channel] = readings[channel] + size * _bent(effect, readings[channel])
        elif effect.name == "sensor_delay":
            readings[0] = late(readings[0], effect.form, size, dt)
        elif effect.name == "resonance":
            channel, hertz, damping = effect.constants
            ringing = _mode(readings[int(channel)], hertz, damping, dt)
            readings[int(channel)] = readings[int(channel)] + size * ringing
        elif effect.name == "slip_step":
            readings[0] = readings[0] + size * _slipped(effect, pressure, time)
    return readings[1], readings[0]


def dropouts(effect: Effect, rows: int, period: float) -> np.ndarray:
    """Course of a wiper that loses contact now and then [-], shape (rows,)."""
    rng = np.random.default_rng(effect.seed)
    out = np.zeros(rows)
    row = int(rng.exponential(3.0) / period)
    while row < rows:
        length = int(rng.integers(1, 6))
        shape = np.ones(length) if effect.form == 0 else np.linspace(1.0, 0.2, length)
        end = min(rows, row + length)
        out[row:end] = -rng.uniform(0.5, 2.0) * shape[: end - row]
        row += length + int(rng.exponential(3.0) / period)
    return out


def coloured(rng: np.random.Generator, count: int, share: float, period: float) -> np.ndarray:
    """Draw noise of RMS 1 of which a share of the variance is correlated over 1 s."""
    white = rng.normal(size=(2, count))
    keep = math.exp(-period)
    slow = _lagged(white[1], period * keep / (1.0 - keep), period)
    slow = slow / math.sqrt((1.0 - keep) / (1.0 + keep))
    return math.sqrt(1.0 - share) * white[0] + math.sqrt(share) * slow


def quantised(values: np.ndarray, step: float) -> np.ndarray:
    """Round to a quantum, if there is one."""
    return values if step == 0.0 else step * np.round(values / step)


def noisy(
    noise: Noise,
    position: np.ndarray,
    pressure: np.ndarray,
    seed: int,
    factor: float,
    period: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return position and pressure with noise times `factor` and quanta."""
    first, second = np.random.default_rng(seed).spawn(2)
    count = position.size
    share = noise.coloured_share
    position = position + factor * noise.position_mm * coloured(first, count, share, period)
    pressure = pressure + factor * noise.pressure_bar * coloured(second, count, share, period)
    if factor > 0.0:
        return quantised(position, noise.step_mm), quantised(pressure, noise.step_bar)
    return position, pressure
