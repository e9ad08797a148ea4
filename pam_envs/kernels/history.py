"""Ring of the last values of a signal, one a control period, in rows of the state."""

from typing import Any

from pam_envs.kernels.build import kernel

N_HISTORY = 16
"""Rows of a ring: a power of two."""


@kernel
def note(rows: Any, ring: int, j: int, step: int, value: float) -> None:
    """Write the value of control period ``step`` into the ring that begins at row ``ring``."""
    rows[ring + (step & (N_HISTORY - 1))][j] = value


@kernel
def noted(rows: Any, ring: int, j: int, step: int, back: int) -> float:
    """Return the value of ``back`` control periods before ``step``, at most ``N_HISTORY - 1``."""
    return rows[ring + ((step + N_HISTORY - back) & (N_HISTORY - 1))][j]  # type: ignore[no-any-return]


@kernel
def fill_ring(rows: Any, ring: int, j: int, value: float) -> None:
    """Begin the ring of a signal that was constant."""
    for k in range(N_HISTORY):
        rows[ring + k][j] = value
