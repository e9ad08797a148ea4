"""Sensor effects."""

from __future__ import annotations

import numpy as np

from .effect import Kind, Shape, coin, put, sign, uniform

BAR_PER_MM = 0.28  # the noise of the pressure sensor over that of the position sensor


def _either(shape: Shape, strength: float, name: str) -> dict[str, float]:
    """Put a strength in mm into the sensor that was drawn."""
    if shape["position"] > 0.5:
        return {f"{name}_mm": shape["sign"] * strength}
    return {f"{name}_bar": shape["sign"] * strength * BAR_PER_MM}


def _sensor_bias(record: np.ndarray, strength: float, shape: Shape) -> None:
    """An offset that appears while the electronics warm up."""
    put(record, **_either(shape, strength, "bias"))


def _sensor_drift(record: np.ndarray, strength: float, shape: Shape) -> None:
    """A reading walks off along a hyperbola or a slow sigmoid."""
    put(record, drift_time=shape["time"], drift_kind=shape["hyperbola"])
    put(record, **_either(shape, strength, "drift"))


def _sensor_delay(record: np.ndarray, strength: float, shape: Shape) -> None:
    """The position passes a cascade of filters or a moving average; strength is the delay [s]."""
    put(record, late=strength, late_kind=shape["average"], late_lags=shape["lags"])


def _sensor_nonlinearity(record: np.ndarray, strength: float, shape: Shape) -> None:
    """A reading bows over its span like a sine or like an arctangent."""
    put(record, bow_kind=shape["sine"], bow_curve=shape["curve"])
    put(record, **_either(shape, strength, "bow"))


def _sensor(rng: np.random.Generator) -> Shape:
    return {"position": coin(rng), "sign": sign(rng)}


SENSING = {
    "sensor_bias": Kind(_sensor, _sensor_bias, 0.06),
    "sensor_drift": Kind(
        lambda rng: {**_sensor(rng), "time": uniform(rng, 80.0, 250.0), "hyperbola": coin(rng)},
        _sensor_drift,
        0.1,
    ),
    "sensor_delay": Kind(
        lambda rng: {"average": coin(rng), "lags": float(rng.integers(2, 5))}, _sensor_delay, 0.006
    ),
    "sensor_nonlinearity": Kind(
        lambda rng: {**_sensor(rng), "sine": coin(rng), "curve": uniform(rng, 1.5, 4.0)},
        _sensor_nonlinearity,
        0.1,
    ),
}
