"""Draws of the constants of the laws of braid and tube."""

import numpy as np

Constants = tuple[float, ...]


def lock(rng: np.random.Generator, area: float) -> Constants:
    """Draw stiffness [N] and width of the stop at zero strain (`laws.lock`)."""
    return rng.uniform(5500.0, 8000.0) * area, rng.uniform(0.008, 0.013)


def bundle(rng: np.random.Generator, area: float) -> Constants:
    slack = np.sort(rng.uniform(0.0, rng.uniform(0.025, 0.05), 8))
    slack[0] = 0.0
    head = (
        rng.uniform(400.0, 520.0) * area,
        rng.uniform(0.25, 0.32),
        rng.uniform(1.3, 1.7),
        rng.uniform(0.12, 0.2),
        *lock(rng, area),
        rng.uniform(0.015, 0.03),
        0.0,
    )
    return (*head, *slack.tolist())


def braid(rng: np.random.Generator, area: float) -> Constants:
    angle = np.radians(rng.uniform(25.0, 28.5))
    return (
        7.85 * area * rng.uniform(0.9, 1.1),
        float(np.cos(angle) ** 2),
        rng.uniform(0.1, 0.25),
        rng.uniform(1.5, 3.0),
        rng.uniform(22.0, 36.0) * area,
        rng.uniform(3000.0, 4500.0) * area,
        rng.uniform(0.006, 0.014),
    )


def locking(rng: np.random.Generator, area: float) -> Constants:
    return (
        rng.uniform(62.0, 78.0) * area,
        rng.uniform(0.27, 0.34),
        rng.uniform(450.0, 800.0) * area,
        rng.uniform(0.085, 0.125),
        rng.uniform(300.0, 750.0) * area,
        rng.uniform(0.5, 1.5),
        rng.uniform(0.001, 0.003),
        *lock(rng, area),
    )


def rubber(rng: np.random.Generator, area: float) -> Constants:
    return (
        7.85 * area * rng.uniform(0.9, 1.1),
        float(np.cos(np.radians(rng.uniform(24.0, 27.5))) ** 2),
        rng.uniform(7.0, 12.0) * area,
        rng.uniform(1.5, 5.0) * area,
        rng.uniform(150.0, 400.0),
        rng.uniform(1.05, 1.2),
        rng.uniform(3000.0, 4500.0) * area,
        rng.uniform(0.008, 0.013),
    )


def capped(rng: np.random.Generator, area: float) -> Constants:
    return (
        rng.uniform(63.0, 80.0) * area,
        rng.uniform(0.25, 0.3),
        rng.uniform(0.06, 0.2),
        rng.uniform(0.04, 0.07),
        rng.uniform(0.06, 0.18),
        rng.uniform(250.0, 500.0) * area,
        rng.uniform(2e3, 8e3) * area,
        *lock(rng, area),
    )


def ogden(rng: np.random.Generator, area: float) -> Constants:
    """Draw gas, angle, moduli, exponents, radii in the wall, share that contracts, and stop."""
    wall = rng.uniform(1.35, 1.7)  # squared outer radius over the inner one
    return (
        7.85 * area * rng.uniform(0.9, 1.1),
        float(np.cos(np.radians(rng.uniform(24.0, 27.0))) ** 2),
        rng.uniform(13.0, 20.0) * area,
        rng.uniform(0.4, 1.2) * area,
        rng.uniform(1.2, 1.6),
        rng.uniform(4.2, 5.2),
        1.0 + 0.2 * (wall - 1.0),
        1.0 + 0.75 * (wall - 1.0),
        rng.uniform(1.04, 1.16),
        rng.uniform(3000.0, 4500.0) * area,
        rng.uniform(0.008, 0.013),
    )


def chain(rng: np.random.Generator, area: float) -> Constants:
    """Draw two long parts of a muscle and its stiffer ends."""
    shares = np.array([0.45, 0.4, 0.15]) * rng.uniform(0.8, 1.2, 3)
    shares /= shares.sum()
    parts: list[float] = []
    for share, stiff in zip(shares.tolist(), (1.0, 1.0, rng.uniform(2.0, 3.0)), strict=True):
        cos2 = np.cos(np.radians(rng.uniform(25.5, 28.5))) ** 2
        gas = 7.85 * area * rng.uniform(0.88, 1.12)
        rubber_N = stiff * rng.uniform(130.0, 230.0) * area
        parts += [gas, float(3.0 * cos2 / (1.0 - cos2)), rubber_N, share]
    return (*parts, *lock(rng, area))


def barrel(rng: np.random.Generator, area: float) -> Constants:
    """Draw gas, angle, length of the ends, rubber around the hoop, and stop."""
    return (
        7.85 * area * rng.uniform(0.9, 1.1),
        float(np.cos(np.radians(rng.uniform(24.5, 27.5))) ** 2),
        rng.uniform(0.2, 0.45),
        rng.uniform(22.0, 36.0) * area,
        rng.uniform(0.3, 1.0),
        rng.uniform(3000.0, 4500.0) * area,
        rng.uniform(0.008, 0.013),
    )
