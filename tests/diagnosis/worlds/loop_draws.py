"""Draws of hysteresis operators, of the normal loop and of the loops that effects bring in."""

from collections.abc import Callable

import numpy as np

from .loops import LOOPS, SIZE

Operator = tuple[int, tuple[float, ...]]
"""Kind and flattened constants."""


def _pack(kind: str, thresholds: np.ndarray, shares: np.ndarray, others: np.ndarray) -> Operator:
    op = np.zeros((3, SIZE))
    op[0] = 1.0
    op[0, : thresholds.size] = thresholds
    op[1, : shares.size] = shares
    op[2, : others.size] = others
    return LOOPS.index(kind), tuple(op.ravel().tolist())


def stops(thresholds: np.ndarray, shares: np.ndarray, half: float) -> Operator:
    """Return parallel stops; in pressure the slope after a reversal stays positive."""
    shares = shares / shares.sum()
    steep = half * np.sum(shares / thresholds)
    if half > 0.0 and steep > 0.92:
        thresholds = thresholds * steep / 0.92
    return _pack("stops", thresholds, shares, np.zeros(0))


def geometric_stops(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw thresholds in geometric steps, most of the width in the middle ones."""
    count = int(rng.integers(4, 8))
    thresholds = np.geomspace(0.35, rng.uniform(2.0, 3.5), count) * half
    return stops(thresholds, rng.dirichlet(np.full(count, 3.0)) + 0.02, half)


def wide_stops(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw evenly spread thresholds up to several half widths: soft inner loops."""
    thresholds = np.linspace(0.3, rng.uniform(3.0, 5.0), 10) * half
    return stops(thresholds, np.exp(-thresholds / half / rng.uniform(1.5, 4.0)), half)


def bouc_wen(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw a Bouc-Wen loop in pressure, a little lopsided."""
    others = np.array([rng.uniform(1.0, 2.0), rng.uniform(0.5, 0.65), rng.uniform(0.0, 0.15)])
    return _pack("bouc_wen", np.array([half * rng.uniform(1.5, 2.3)]), np.ones(1), others)


def preisach(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw plays with outputs that bend with the level: a density skewed in its plane."""
    thresholds = np.linspace(0.1, 2.3, SIZE)
    peak, spread = rng.uniform(0.5, 0.9), rng.uniform(0.45, 0.7)
    shares = np.exp(-0.5 * (np.log(thresholds / peak) / spread) ** 2)
    shares /= shares.sum()
    thresholds = thresholds * half / np.sum(shares * thresholds)
    skew = rng.choice([-1.0, 1.0]) * rng.uniform(0.15, 0.35) * np.linspace(-1.0, 1.0, SIZE)
    skew -= np.sum(shares * skew)
    return _pack("preisach", thresholds, shares / half, skew)


def skewed_play(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw plays with rising and falling edges that change with pressure differently."""
    count = int(rng.integers(3, 7))
    thresholds = np.linspace(0.5, 2.2, count)
    shares = 0.92 * rng.dirichlet(np.full(count, 4.0))
    thresholds = thresholds * half / np.sum(shares * thresholds)
    edges = np.array([rng.uniform(0.1, 0.45), rng.uniform(-0.35, 0.1)])
    return _pack("skewed_play", thresholds, shares / half, edges)


def maxwell_slip(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw sliders that break away after a few parts of the length [mm]."""
    breaks = np.array([0.003, 0.008, 0.02, 0.04]) * length * rng.uniform(0.7, 1.3)
    return stops(breaks, np.array([0.25, 0.2, 0.15, 0.4]) * rng.uniform(0.7, 1.3, 4), 0.0)


def end_slip(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw two groups of sliders: braid at the ends (soft) and in the middle (stiff)."""
    breaks = np.array([0.002, 0.003, 0.005, 0.03, 0.06]) * length * rng.uniform(0.8, 1.2)
    return stops(breaks, np.array([0.2, 0.2, 0.15, 0.25, 0.2]), 0.0)


def iwan(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw sliders with a power law of break lengths [mm], and some that slip last of all."""
    edges = np.geomspace(0.0008, rng.uniform(0.03, 0.05), SIZE) * length
    breaks = np.r_[np.sqrt(edges[1:] * edges[:-1]), edges[-1]]
    shares = breaks ** (1.0 + rng.uniform(-0.8, -0.2)) * np.r_[np.diff(edges), 0.0]
    last = rng.uniform(0.1, 0.35)
    shares *= (1.0 - last) / shares.sum()
    shares[-1] = last
    return stops(breaks, shares, 0.0)


def coulomb(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw Coulomb friction: strands that slip after a small part of the length [mm]."""
    breaks = np.array([0.0015, 0.003, 0.007]) * length * rng.uniform(0.8, 1.3, 3)
    return stops(breaks, np.array([0.45, 0.3, 0.25]) * rng.uniform(0.8, 1.2, 3), 0.0)


def rate_weak(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw friction that rises or falls by a few per cent with the logarithm of the rate."""
    breaks = np.array([0.002, 0.006, 0.018]) * length * rng.uniform(0.8, 1.3, 3)
    shares = np.array([0.35, 0.35, 0.3]) * rng.uniform(0.8, 1.2, 3)
    rate = rng.uniform(0.006, 0.015) * (1.0 if rng.random() < 0.6 else -1.0)
    others = np.array([rate, rng.uniform(0.3, 1.0)])
    return _pack("rate_weak", breaks, shares / shares.sum(), others)


def tanh_play(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw plays between envelopes that saturate."""
    count = int(rng.integers(4, 7))
    thresholds = np.linspace(0.35, 2.4, count)
    shares = 0.92 * rng.dirichlet(np.full(count, 4.0))
    thresholds = thresholds * half / np.sum(shares * thresholds)
    up = rng.uniform(5.0, 8.0)
    others = np.array([up, up * rng.uniform(0.9, 1.1), rng.uniform(2.4, 3.6)])
    return _pack("tanh_play", thresholds, shares / half, others)


def dead_zone_play(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw plays whose sum passes five dead zones, so that the loop's width has steps."""
    count = int(rng.integers(5, 8))
    thresholds = np.linspace(0.3, 2.6, count) ** 1.2
    shares = 0.9 * rng.dirichlet(np.full(count, 4.0))
    thresholds = thresholds * half / np.sum(shares * thresholds)
    slopes = np.r_[1.0, rng.uniform(0.72, 1.0, 5)]
    zones = np.linspace(0.7, 5.0, 5) + rng.uniform(-0.3, 0.3, 5)
    others = np.r_[np.diff(slopes), zones, half]
    return _pack("dead_zone_play", thresholds, shares / half, others)


def slip_lag(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw uneven breakaways, and sliding that takes some hundredths of a second to settle."""
    count = int(rng.integers(4, 7))
    breaks = np.geomspace(0.002, rng.uniform(0.025, 0.045), count) * length
    breaks *= rng.uniform(0.75, 1.25, count)
    others = np.array([rng.uniform(20.0, 60.0), rng.uniform(0.01, 0.04), rng.uniform(3.0, 10.0)])
    return _pack("slip_lag", breaks, rng.dirichlet(np.full(count, 5.0)) + 1e-3, others)


def duhem(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw a Duhem loop that opens over another way when falling, and at another level."""
    others = [rng.uniform(0.85, 1.15), rng.uniform(0.05, 0.25), rng.uniform(-0.2, 0.1)]
    reach = np.array([half * rng.uniform(2.8, 3.3)])
    return _pack("duhem", reach, np.ones(1), np.array(others))


def elastoplastic(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw friction with a long elastic way before sliding."""
    reach = np.array([length * rng.uniform(0.006, 0.014)])
    return _pack("elastoplastic", reach, np.ones(1), np.array([rng.uniform(0.15, 0.45)]))


def ridge_play(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw plays of overlapping ramps along the pressure: each part of it has its own width."""
    centres = np.linspace(-1.2, 5.9, SIZE)
    thresholds = half / 0.76 * rng.uniform(0.8, 1.2, SIZE)
    shares = np.full(SIZE, 0.38 / half) * rng.uniform(0.95, 1.05, SIZE)
    return _pack("ridge_play", thresholds, shares, centres)


def relaxing(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw stops of which a few per cent relax within half a second."""
    breaks = np.array([0.002, 0.005, 0.012, 0.025, 0.04]) * length * rng.uniform(0.8, 1.25, 5)
    shares = np.array([0.15, 0.25, 0.25, 0.2, 0.15]) * rng.uniform(0.8, 1.2, 5)
    others = np.array([rng.uniform(0.03, 0.05), rng.uniform(0.2, 0.5)])
    return _pack("relaxing", breaks, shares / shares.sum(), others)


def back_stress(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw yield as a share of the width, and the way over which the rest builds up."""
    others = np.array([rng.uniform(0.3, 0.55), half * rng.uniform(1.2, 2.4)])
    return _pack("back_stress", np.array([half * rng.uniform(1.15, 1.5)]), np.ones(1), others)


def dahl(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw a Dahl loop in length."""
    reach = np.array([length * rng.uniform(0.004, 0.012)])
    return _pack("dahl", reach, np.ones(1), np.array([rng.uniform(0.8, 1.6)]))


def lugre(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw LuGre friction with a breakaway little above the kinetic force."""
    reach = np.array([length * rng.uniform(0.003, 0.008)])
    others = np.array([rng.uniform(0.02, 0.08), rng.uniform(3.0, 10.0)])
    return _pack("lugre", reach, np.ones(1), others)


def bouc_wen_length(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw a Bouc-Wen loop in length."""
    others = np.array([rng.uniform(0.9, 1.6), rng.uniform(0.5, 0.7), rng.uniform(0.0, 0.1)])
    reach = np.array([length * rng.uniform(0.008, 0.025)])
    return _pack("bouc_wen", reach, np.ones(1), others)


def backlash(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw one threshold: inner loops as wide as the outer one."""
    reach = half * 1.09 if length == 0.0 else length * rng.uniform(0.001, 0.0025)
    return stops(np.array([reach]), np.ones(1), half if length == 0.0 else 0.0)


def blunt(rng: np.random.Generator, half: float, length: float) -> Operator:
    """Draw a loop that opens over a long way: inner loops nearly closed."""
    reach = half * rng.uniform(3.0, 5.0) if length == 0.0 else length * rng.uniform(0.04, 0.07)
    others = np.array([rng.uniform(0.8, 1.2), 0.55, 0.0])
    return _pack("bouc_wen", np.array([reach]), np.ones(1), others)


DRAWS: dict[str, Callable[[np.random.Generator, float, float], Operator]] = {
    "geometric_stops": geometric_stops,
    "wide_stops": wide_stops,
    "bouc_wen": bouc_wen,
    "preisach": preisach,
    "skewed_play": skewed_play,
    "maxwell_slip": maxwell_slip,
    "end_slip": end_slip,
    "dahl": dahl,
    "lugre": lugre,
    "bouc_wen_length": bouc_wen_length,
    "backlash": backlash,
    "blunt": blunt,
    "iwan": iwan,
    "coulomb": coulomb,
    "rate_weak": rate_weak,
    "tanh_play": tanh_play,
    "dead_zone_play": dead_zone_play,
    "slip_lag": slip_lag,
    "duhem": duhem,
    "elastoplastic": elastoplastic,
    "ridge_play": ridge_play,
    "relaxing": relaxing,
    "back_stress": back_stress,
}
