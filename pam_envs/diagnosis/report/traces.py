"""What the figures of a diagnosis draw."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Traces:
    """What a report draws; arrays of shape (T,) in SI.

    Attributes
    ----------
    time, command, load : ndarray
        [s], [Pa], [N].
    segment : ndarray of int
        Index into ``segments``.
    segments : tuple of str
        Labels.
    held_out : ndarray of bool
        Samples of the kinds of experiment that the reported errors are of.
    temperature : ndarray or None
        [deg C].
    measured, base, extended : dict of str to ndarray
        By output.
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
