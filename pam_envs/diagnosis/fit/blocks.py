"""Blocks of time that are held out in turn, and gains between models on them."""

from dataclasses import dataclass

import numpy as np

from pam_envs.arrays import Array, Flags, Indices

BLOCK_SECONDS = 4.0  # length of the interleaved blocks [s]
EVERY = 3  # period of the held-out blocks: every third one


@dataclass(frozen=True)
class Blocks:
    """Blocks of time."""

    of: Indices  # (T,): block of each sample
    held_out: Flags  # (n,): blocks that are excluded from fits
    counts: Array  # (channels, n): number of readings in each block

    @classmethod
    def make(cls, time: Array, measured: Array) -> "Blocks":
        """Divide a record into blocks, every third one held out."""
        of = ((time - time[0]) / BLOCK_SECONDS + 1e-9).astype(np.int64)
        n = int(of.max()) + 1
        counts = np.stack(
            [np.bincount(of, np.isfinite(m).astype(float), minlength=n) for m in measured]
        )
        return cls(of, np.arange(n) % EVERY == EVERY - 1, counts.astype(np.float64))

    @property
    def train(self) -> Flags:
        """Training samples, shape (T,)."""
        return ~self.held_out[self.of]

    def errors(self, rows: Array) -> Array:
        """Return sums of squares of weighted residuals (channels, T), shape (channels, n)."""
        n = len(self.held_out)
        return np.stack([np.bincount(self.of, r * r, minlength=n) for r in rows])

    def means(self, errors: Array, selected: Flags | None = None) -> Array:
        """Return the mean square by channel over some blocks (default: those held out)."""
        use = self.held_out if selected is None else selected
        counts = self.counts[:, use].sum(axis=1)
        return errors[:, use].sum(axis=1) / np.maximum(counts, 1)

    def gain(self, before: Array, after: Array) -> float:
        """Return the sum over channels of ``ln(MSE_before / MSE_after)``."""
        some = self.counts.sum(axis=1) > 0
        a, b = self.means(before)[some], self.means(after)[some]
        return float(np.sum(np.log(np.maximum(a, 1e-12) / np.maximum(b, 1e-12))))

    def draws(self, number: int, seed: int) -> Indices:
        """Return the count of each block in bootstrap samples, shape (number, n)."""
        rng = np.random.default_rng(seed)
        places = np.flatnonzero(self.held_out)
        drawn = np.zeros((number, len(self.held_out)), np.int64)
        for k in range(number):
            drawn[k] = np.bincount(rng.choice(places, len(places)), minlength=drawn.shape[1])
        return drawn

    def gains(self, before: Array, after: Array, draws: Indices) -> Array:
        """Return the gain in each bootstrap sample, shape (number,)."""
        some = self.counts.sum(axis=1) > 0
        a, b = before[some] @ draws.T, after[some] @ draws.T
        return np.asarray(np.sum(np.log(np.maximum(a, 1e-12) / np.maximum(b, 1e-12)), axis=0))
