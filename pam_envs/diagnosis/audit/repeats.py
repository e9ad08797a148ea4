"""Test whether repeated segments differ by noise alone."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from pam_envs.arrays import Array

Source = Literal["repeats", "holds", "innovations", "declared"]

DISAGREE = 1.5  # ratio above which two estimates of one noise disagree
SURELY = 2.5  # standard deviations beyond which repeats differ by more than noise
LEAST_EXCESS = 0.1  # least relative excess of such repeats
GUESSED = 0.5  # relative standard deviation of the slow part of the noise of holds
FAST = 1.15  # ratio of the scatter within a second above which the excess is noise of motion


@dataclass(frozen=True)
class Trust:
    """Reliability of the noise estimates from repeats and holds."""

    repeats: float  # relative standard deviation of the estimate from repeats
    fast: float  # ratio of the scatter of repeats to that of holds within a second

    @classmethod
    def of(cls, differences: list[Array], ends: list[Array], second: int, white: float) -> "Trust":
        """Compare pieces with ``second`` samples per second; ``white`` replaces missing holds."""
        squares = _mean_squares([d - d.mean() for d in differences], 2 * second)
        spread = np.nan
        if len(squares) > 1:
            spread = 0.5 * float(squares.std(ddof=1) / np.sqrt(len(squares)) / squares.mean())
        moving, still = _local(differences, second), _local(ends, second) if ends else white**2
        return cls(spread, float(np.sqrt(0.5 * moving / still)) if still > 0.0 else np.nan)


def _mean_squares(pieces: list[Array], size: int) -> Array:
    """Return the mean squares of stretches of ``size`` samples."""
    rows = [p[: len(p) // size * size].reshape(-1, size) for p in pieces]
    return np.concatenate([(r**2).mean(axis=1) for r in rows] or [np.zeros(0)])


def _local(pieces: list[Array], size: int) -> float:
    """Return the mean variance within detrended stretches of ``size`` samples."""
    rows = [w for p in pieces for w in p[: len(p) // size * size].reshape(-1, size)]
    if not rows:
        return 0.0
    found = np.array([np.var(detrended(w)) for w in rows])
    return float(found[found <= 4.0 * np.median(found)].mean())


def best(estimates: Mapping[str, float], declared: float | None, trust: Trust) -> Source:
    """Return the source to use: repeats, unless they differ by more than noise.

    Otherwise the larger of holds and declared noise, if the holds do not contradict the latter.
    """
    repeats, holds = estimates.get("repeats"), estimates.get("holds")
    known = holds if holds is not None else estimates.get("innovations")
    if repeats is None or known is None:
        order: tuple[Source, ...] = ("repeats", "holds", "innovations")
        return next((source for source in order if source in estimates), "declared")
    believed = declared is not None and known < declared <= DISAGREE * known
    reference = declared if believed else holds
    slow = 0.0 if believed else max(0.0, 1.0 - estimates.get("innovations", 0.0) / known)
    if reference is None or not _exceeds(repeats, reference, slow, trust):
        return "repeats"
    return "declared" if believed else "holds"


def _exceeds(repeats: float, reference: float, slow: float, trust: Trust) -> bool:
    """Return whether repeats differ by more than a reference noise.

    The share ``slow`` of the reference is uncertain. An excess within one second is noise of the
    motion, which is not visible in holds.
    """
    if repeats > DISAGREE * reference:
        return True
    allowed = max(LEAST_EXCESS, SURELY * float(np.hypot(trust.repeats, GUESSED * slow)))
    return repeats > (1.0 + allowed) * reference and trust.fast < FAST


def detrended(values: Array) -> Array:
    """Return values less their regression line."""
    x = np.arange(len(values)) - 0.5 * (len(values) - 1)
    left = values - values.mean()
    return left - x * (x @ left) / (x @ x)
