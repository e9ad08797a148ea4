"""Friction effects of pressure, strands and guide."""

from __future__ import annotations

import numpy as np

from .effect import Kind, Shape, coin, put, sign, uniform
from .records import SLIDERS


def _load_dependent_hysteresis(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Friction grows or shrinks with the load to the power 3/2."""
    put(record, load_grip=strength, load_grip_sign=shape["sign"])


def _hysteresis_shape(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Inner loops are bent, fully slipped ones stay: an odd map of the sum over all sliders."""
    put(record, map=strength, map_kind=shape["steep"])


def _hysteresis_drive(record: np.ndarray, strength: float, shape: Shape) -> None:
    """A share of the friction comes from sliders that the length drags."""
    place = (np.arange(SLIDERS) + 0.5) / SLIDERS
    density = 1.0 - np.cos(2.0 * np.pi * place ** shape["skew"])
    breaks = shape["reach"] * place
    put(record, strand=1.0 - np.exp(-strength))
    record["strand_breaks"][0] = breaks
    record["strand_stiffness"][0] = record["friction"][0] * density / float(density @ breaks)


def _pressure_dependent_friction(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Friction changes with pressure along a saturating exponential."""
    put(record, pressure_grip=shape["sign"] * strength, pressure_grip_bend=shape["bend"])


def _stick_slip(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Bristles of a guide bend, slip and ease with speed: LuGre; strength is the breakaway [N].

    They bend by so many mm before they slip; at the Stribeck speed [mm/s] half of the excess over
    the kinetic friction is gone.
    """
    put(
        record,
        breakaway=strength,
        kinetic=strength * shape["kinetic"],
        stribeck=shape["speed"],
        bristle=shape["bend"],
        oil=shape["oil"],
    )


FRICTION = {
    "load_dependent_hysteresis": Kind(
        lambda rng: {"sign": sign(rng)}, _load_dependent_hysteresis, 0.03
    ),
    "hysteresis_shape": Kind(lambda rng: {"steep": coin(rng)}, _hysteresis_shape, 1.3, 0.5),
    "hysteresis_drive": Kind(
        lambda rng: {"skew": uniform(rng, 0.6, 1.2), "reach": uniform(rng, 0.02, 0.04)},
        _hysteresis_drive,
        0.1,
    ),
    "stick_slip": Kind(
        lambda rng: {
            "kinetic": uniform(rng, 0.4, 0.8),
            "speed": uniform(rng, 0.5, 4.0),
            "bend": uniform(rng, 0.005, 0.02),
            "oil": uniform(rng, 5e-4, 2e-3),
        },
        _stick_slip,
        2.0,
    ),
    "pressure_dependent_friction": Kind(
        lambda rng: {"sign": sign(rng), "bend": uniform(rng, 2.0, 6.0)},
        _pressure_dependent_friction,
        0.1,
    ),
}
