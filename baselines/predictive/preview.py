"""Memory of previewed references.

The environments preview a reference at a few times ahead. Every sample is kept, so that a horizon
ahead of the present the reference is known at every control period. Beyond it the last sample is
extended, or, of a periodic reference, the period before is repeated.

Times are in control periods from the start of the episode.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from baselines.core.controller import Rows
from pam_envs.arrays import Array
from pam_envs.kernels.build import entry


class Preview(NamedTuple):
    """Samples, shape (n_env, n_channels, size), a ring over time; present time, (n_env,)."""

    samples: Array
    step: NDArray[np.int64]


@dataclass(frozen=True)
class PreviewMemory:
    """Memory of previewed samples.

    Attributes
    ----------
    ahead : ndarray of int, shape (n_samples,)
        Times of the previewed samples from the present, the present one first.
    stride : float
        Period of the reference [control periods]; infinite if it has none.
    size : int
        Samples that are kept.
    """

    ahead: NDArray[np.int64]
    stride: float
    size: int

    @classmethod
    def make(cls, ahead: NDArray[np.int64], stride: float = math.inf) -> "PreviewMemory":
        """Return the memory for preview times and a period [control periods]."""
        kept = stride if math.isfinite(stride) else 0.0
        return cls(ahead, stride, math.ceil(kept) + 2 * int(ahead[-1]) + 8)

    def start(self, samples: Array) -> Preview:
        """Return the memory before :meth:`add` of first samples, (n_env, n_channels, n_samples)."""
        n, channels, _ = samples.shape
        filled = np.zeros((n, channels, self.size))
        dense = np.arange(self.ahead[-1] + 1)
        for row in range(n):
            for channel in range(channels):
                line = np.interp(dense, self.ahead, samples[row, channel])
                filled[row, channel, : len(dense)] = line
        return Preview(filled, np.full(n, -1))

    def add(self, seen: Preview, samples: Array) -> Preview:
        """Return the memory one period later, with its previewed samples.

        The present sample is left out if there are others: it may differ from what was planned.
        """
        kept, step, first = seen.samples.copy(), seen.step + 1, min(1, len(self.ahead) - 1)
        at = (step[:, None] + self.ahead[first:]) % self.size
        rows, channels = np.arange(len(kept))[:, None, None], np.arange(kept.shape[1])[:, None]
        kept[rows, channels, at[:, None]] = samples[:, :, first:]
        return Preview(kept, step)

    def within(self, seen: Preview, times: Array) -> Array:
        """Return times, (n_env, n_times), less the strides by which they are beyond the samples.

        Times that are unknown, before the first sample or without a period, stay.
        """
        last = (seen.step + self.ahead[-1])[:, None]
        if not math.isfinite(self.stride):
            return times
        back = times - np.ceil(np.maximum((times - last) / self.stride, 0.0)) * self.stride
        return np.where(back >= 0.0, back, times)

    def read(self, seen: Preview, times: Array) -> tuple[Array, Rows]:
        """Return samples at times, (n_env, n_times), and where it is known.

        The samples have the shape (n_env, n_channels, n_times).
        """
        n, count = times.shape
        samples = np.ascontiguousarray(seen.samples)
        found, known = np.empty((n, samples.shape[1], count)), np.empty((n, count), bool)
        stride = self.stride if math.isfinite(self.stride) else 0.0
        given = np.array(times, float, order="C")
        read_rows(samples, seen.step + self.ahead[-1], given, stride, found, known)
        return found, known


@entry
def read_rows(
    samples: Array, last: Any, times: Array, stride: float, found: Array, known: Any
) -> None:
    """Write samples at times and where they are known; ``last`` is the last time in the memory.

    ``stride`` is 0 without a period.
    """
    size = samples.shape[2]
    for i in range(len(times)):
        for j in range(times.shape[1]):
            time, end = times[i, j], float(last[i])
            if stride > 0.0 and time > end:
                late = (time - end) / stride
                strides = int(late)
                time = time - (strides + (1 if strides < late else 0)) * stride
            known[i, j] = 0.0 <= time <= end
            held = max(0.0, min(time if time >= 0.0 else end, end))
            whole = int(min(held, max(end - 1.0, 0.0)))
            part = held - whole
            for c in range(samples.shape[1]):
                low, high = samples[i, c, whole % size], samples[i, c, (whole + 1) % size]
                found[i, c, j] = (1.0 - part) * low + part * high
