"""Draws of the constants of each static law."""

from collections.abc import Callable

import numpy as np

from .braid_draws import (
    Constants,
    barrel,
    braid,
    bundle,
    capped,
    chain,
    lock,
    locking,
    ogden,
    rubber,
)
from .elements import curve
from .fitted import MAP_PRESSURE, MAP_SHAPE, MAP_STRAIN


def _exponential(rng: np.random.Generator, area: float) -> Constants:
    top = rng.uniform(370.0, 480.0) * area
    shape = (0.466, 5.17, 0.785) if rng.random() < 0.5 else (0.52, 4.6, 0.66)
    a0, a1, a3 = (value * rng.uniform(0.93, 1.07) for value in shape)
    return (top, a0, a1, a3, rng.uniform(0.150, 0.185))


def _polynomial(rng: np.random.Generator, area: float) -> Constants:
    return (
        rng.uniform(72.0, 88.0) * area,
        rng.uniform(-3.0, -1.0) * area,
        rng.uniform(4.0, 5.0),
        rng.uniform(2.5, 5.0),
        rng.uniform(7000.0, 9500.0) * area,
        rng.uniform(0.016, 0.022),
        rng.uniform(0.002, 0.006) / area,
        rng.uniform(6e3, 14e3) * area,
    )


def _sine(rng: np.random.Generator, area: float) -> Constants:
    return (
        rng.uniform(370.0, 490.0) * area,
        rng.uniform(0.26, 0.34),
        rng.uniform(0.16, 0.26),
        *lock(rng, area),
    )


def _tangent(rng: np.random.Generator, area: float) -> Constants:
    return (
        2.543 * rng.uniform(0.97, 1.03),
        1.92 * rng.uniform(0.95, 1.05),
        2.0265,
        0.461 * rng.uniform(0.98, 1.02),
        rng.uniform(0.16, 0.2),
        0.331e-3 * rng.uniform(0.7, 1.3) / area,
        0.0123 * rng.uniform(0.85, 1.15) / area,
    )


def _sarosi(rng: np.random.Generator, area: float) -> Constants:
    return (area * rng.uniform(0.7, 1.0), rng.uniform(0.75, 1.0), rng.uniform(0.0, 2.0) * area)


def _logistic(rng: np.random.Generator, area: float) -> Constants:
    return (
        rng.uniform(0.16, 0.21),
        rng.uniform(2.2, 3.0),
        rng.uniform(0.85, 1.25),
        rng.uniform(0.008, 0.014) / area,
        rng.uniform(1300.0, 1900.0) * area,
        rng.uniform(220.0, 400.0) * area,
        rng.uniform(0.6e-4, 1.4e-4) / area,
    )


def _rational(rng: np.random.Generator, area: float) -> Constants:
    return (
        rng.uniform(380.0, 500.0) * area,
        rng.uniform(0.23, 0.29),
        rng.uniform(1.2, 1.5),
        rng.uniform(0.6, 1.0),
        rng.uniform(0.25, 0.4),
        rng.uniform(0.6, 1.4),
        rng.uniform(5000.0, 8000.0) * area,
        rng.uniform(0.008, 0.013),
    )


def _drawn(rng: np.random.Generator, area: float) -> Constants:
    """Draw pressure needed over strain, convex then concave, and force per bar over strain."""
    slopes = np.array([1.5, 1.5, 1.15, 0.8, 0.7, 0.85, 1.4, 2.2]) * rng.uniform(0.9, 1.1, 8)
    needed = np.r_[0.0, np.cumsum(0.04 * slopes * rng.uniform(24.0, 30.0))]
    needed -= curve(needed, 0, 9, 0.04, 0.0)
    strains = -0.1 + 0.08 * np.arange(6)
    per_bar = 1.0 - strains / rng.uniform(0.33, 0.42) * rng.uniform(0.9, 1.1, 6)
    per_bar *= rng.uniform(62.0, 78.0) * area
    return (*needed.tolist(), *per_bar.tolist(), rng.uniform(4000.0, 6000.0) * area)


def _hyperbolic(rng: np.random.Generator, area: float) -> Constants:
    bend, power = rng.uniform(0.09, 0.14), rng.uniform(1.0, 1.1)
    return (
        rng.uniform(150.0, 260.0) * area,
        bend,
        rng.uniform(64.0, 82.0) * area * bend * 6.0 ** (1.0 - power),
        power,
        rng.uniform(2.5e-5, 6.5e-5) / area,
        *lock(rng, area),
    )


def _spring(rng: np.random.Generator, area: float) -> Constants:
    return (
        rng.uniform(0.33, 0.38),
        rng.uniform(1.35, 1.6),
        rng.uniform(2.6, 3.3),
        rng.uniform(550.0, 800.0) * area,
        rng.uniform(90.0, 140.0) * area,
        rng.uniform(100.0, 250.0) * area,
        rng.uniform(1e3, 3e3) * area,
        *lock(rng, area),
    )


def _three_element(rng: np.random.Generator, area: float) -> Constants:
    return (
        rng.uniform(68.0, 82.0) * area,
        rng.uniform(1400.0, 1700.0) * area,
        rng.uniform(60.0, 110.0) * area,
        rng.uniform(2.0, 3.0),
        rng.uniform(0.25, 0.5),
        rng.uniform(120.0, 170.0) * area,
        *lock(rng, area),
    )


def draw_map(rng: np.random.Generator, area: float) -> Constants:
    """Draw the knots of a map [N]: a smooth base with bumps of a few per cent."""
    p = MAP_PRESSURE[0] + MAP_PRESSURE[1] * np.arange(MAP_SHAPE[0])[:, None]
    e = MAP_STRAIN[0] + MAP_STRAIN[1] * np.arange(MAP_SHAPE[1])[None, :]
    r = e / rng.uniform(0.27, 0.34)
    shape = np.sign(p) * (np.abs(p) / 6.0) ** rng.uniform(1.05, 1.2)
    base = shape * (np.maximum(1.0 - r, 0.0) ** rng.uniform(1.5, 1.9) + 0.02 * (1.0 - r))
    base = base - rng.uniform(0.16, 0.24) * (1.0 - np.exp(-9.0 * r))
    bumps = rng.normal(size=MAP_SHAPE)
    for axis in (0, 1):
        bumps = 0.5 * bumps + 0.25 * (np.roll(bumps, 1, axis) + np.roll(bumps, -1, axis))
    bumps *= np.clip(p / 3.0, 0.0, 1.0) / bumps.std()
    size = rng.uniform(0.008, 0.014)
    while True:
        knots = base + size * bumps
        if np.diff(knots[1:, :12], axis=0).min() > 0.002 and np.diff(knots, axis=1).max() < -1e-4:
            break
        size *= 0.8
        if size < 1e-4:
            knots = base
            break
    top = rng.uniform(380.0, 500.0) * area
    return tuple((top * knots).ravel().tolist())


TABLE_PRESSURES = (-1.0, 0.0, 0.6, 1.2, 2.0, 3.0, 4.0, 5.0, 6.3)
TABLE_STRAINS = (-0.06, -0.02, 0.0, 0.02, 0.05, 0.08, 0.11, 0.15, 0.19, 0.24, 0.3, 0.36)


def draw_table(rng: np.random.Generator, area: float) -> tuple[Constants, Constants]:
    """Draw a table of forces [N] with errors of measurement of a per cent."""
    p, e = np.array(TABLE_PRESSURES)[:, None], np.array(TABLE_STRAINS)[None, :]
    r = e / rng.uniform(0.29, 0.35)
    taut = p * (1.0 - rng.uniform(1.1, 1.35) * r + 0.25 * r * r)
    taut = np.where(p < 0.0, p + 0.0 * r, taut)
    knots = taut - rng.uniform(0.5, 0.8) * (1.0 - np.exp(-6.0 * r)) - rng.uniform(0.2, 0.6) * r
    error = rng.normal(size=knots.shape)
    size = rng.uniform(0.006, 0.012)
    while True:
        measured = knots + size * error * np.clip(p, 0.0, 3.0)
        rise = np.diff(measured[:, :9], axis=0).min(axis=1) / np.diff(TABLE_PRESSURES)
        if size < 1e-5:
            raise ValueError("the table of forces is not monotonic")
        if rise.min() > 0.02 and (np.diff(measured, axis=1) / np.diff(e)).max() < -0.3:
            break
        size *= 0.8
    table = np.zeros(MAP_SHAPE)
    table[1 : p.size + 1, 0], table[0, 1 : e.size + 1] = TABLE_PRESSURES, TABLE_STRAINS
    table[1 : p.size + 1, 1 : e.size + 1] = rng.uniform(66.0, 82.0) * area * measured
    return (*lock(rng, area), float(p.size), float(e.size)), tuple(table.ravel().tolist())


_DRAWS: dict[str, Callable[[np.random.Generator, float], Constants]] = {
    "exponential": _exponential,
    "polynomial": _polynomial,
    "sine": _sine,
    "bundle": bundle,
    "braid": braid,
    "tangent": _tangent,
    "sarosi": _sarosi,
    "logistic": _logistic,
    "rational": _rational,
    "locking": locking,
    "rubber": rubber,
    "capped": capped,
    "drawn": _drawn,
    "hyperbolic": _hyperbolic,
    "ogden": ogden,
    "chain": chain,
    "barrel": barrel,
    "spring": _spring,
    "three_element": _three_element,
}


def draw_law(name: str, rng: np.random.Generator, area: float) -> tuple[Constants, Constants]:
    """Draw 16 constants of a law and its map (empty for most); `area` is relative to 10 mm."""
    if name == "map":
        return (0.0,) * 16, draw_map(rng, area)
    if name == "table":
        constants, knots = draw_table(rng, area)
        return constants + (0.0,) * (16 - len(constants)), knots
    constants = tuple(float(value) for value in _DRAWS[name](rng, area))
    return constants + (0.0,) * (16 - len(constants)), ()
