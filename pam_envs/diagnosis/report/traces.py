"""Time series of the figures of a diagnosis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pam_envs.diagnosis.arrays import Array


@dataclass(frozen=True)
class Traces:
    """Time series of a report; arrays of shape (T,) in SI.

    Attributes
    ----------
    time, command, load : ndarray
        Time [s], command [Pa] and load [N].
    segment : ndarray of int
        Index into ``segments``.
    segments : tuple of str
        Labels of the segments.
    held_out : ndarray of bool
        Held-out samples, of which the errors are reported.
    temperature : ndarray or None
        Temperature [deg C].
    measured, base, extended : dict of str to ndarray
        Readings and simulations, by output.
    effects : dict of str to dict of str to ndarray
        Contribution of each named cause, by output.
    """

    time: Array
    segment: NDArray[np.int64]
    segments: tuple[str, ...]
    held_out: NDArray[np.bool_]
    command: Array
    load: Array
    temperature: Array | None
    measured: dict[str, Array]
    base: dict[str, Array]
    extended: dict[str, Array]
    effects: dict[str, dict[str, Array]]
