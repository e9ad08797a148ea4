"""Motions and signals in time: exact second-order steps, ring of the last values of a signal."""

from typing import Any

from pam_envs.kernels.arithmetic import TURN, decay
from pam_envs.kernels.build import kernel

N_HISTORY = 16
"""Rows of a ring, one a control period: a power of two."""
LARGEST_PHASE = 16.0
"""Largest ``abs(k - d^2 / 4) h^2`` for which the step's series hold (3e-7 relative)."""


@kernel
def series(z: float) -> tuple[float, float]:
    """Return ``cos(sqrt(z))`` and ``sin(sqrt(z)) / sqrt(z)`` for ``abs(z) <= 4``."""
    c = z * (1.0 / 479001600.0) - 1.0 / 3628800.0
    c = c * z + 1.0 / 40320.0
    c = c * z - 1.0 / 720.0
    c = c * z + 1.0 / 24.0
    c = c * z - 0.5
    c = c * z + 1.0
    s = z * (1.0 / 6227020800.0) - 1.0 / 39916800.0
    s = s * z + 1.0 / 362880.0
    s = s * z - 1.0 / 5040.0
    s = s * z + 1.0 / 120.0
    s = s * z - 1.0 / 6.0
    s = s * z + 1.0
    return c, s


@kernel
def oscillator(phase: float) -> tuple[float, float]:
    """Return ``cos(sqrt(phase))`` and ``sin(sqrt(phase)) / sqrt(phase)``, entire in ``phase``.

    Negative phases (an overdamped motion) give the hyperbolic functions.
    """
    c, s = series(0.25 * phase)
    return 2.0 * c * c - 1.0, s * c


@kernel
def oscillator_wide(phase: float) -> tuple[float, float]:
    """Return the same as :func:`oscillator` for phases up to 256, for long steps."""
    c, s = series(0.015625 * phase)
    s, c = s * c, 2.0 * c * c - 1.0
    s, c = s * c, 2.0 * c * c - 1.0
    return 2.0 * c * c - 1.0, s * c


@kernel
def damped_motion(
    velocity: float,
    acceleration: float,
    jerk: float,
    stiffness: float,
    damping: float,
    damped: float,
    h: float,
) -> tuple[float, float]:
    """Return displacement and velocity after ``h`` of ``u'' = a + j t - k u - d u'``: exact.

    The displacement starts at 0, in one unit with ``velocity``. ``stiffness`` ``k`` [1/s2], above
    zero, and ``damping`` ``d`` [1/s] are per unit mass; ``damped`` is ``exp(-d h / 2)``.
    """
    half = 0.5 * damping
    c, s = oscillator((stiffness - half * half) * h * h)
    compliance = 1.0 / stiffness
    settling = jerk * compliance
    offset = (acceleration - damping * settling) * compliance
    v0 = velocity - settling
    swing = damped * h * s
    sway = damped * half * h * s
    u = offset + settling * h - (damped * c + sway) * offset + swing * v0
    v = settling + stiffness * swing * offset + (damped * c - sway) * v0
    return u, v


@kernel
def resonator_step(
    rows: Any, j: int, state: int, was: float, now: float, turns: float, ratio: float, h: float
) -> tuple[float, float]:
    """Advance a resonator whose input went straight from ``was`` to ``now`` in ``h`` seconds.

    Its value and rate [1/s] are in the rows ``state`` and ``state + 1`` of lane ``j``, and are
    returned. ``turns`` is the natural frequency [Hz] and ``ratio`` the damping ratio.
    """
    omega = TURN * turns
    k, d = omega * omega, 2.0 * ratio * omega
    span = max(h, 1e-9)
    y, rate = rows[state][j], rows[state + 1][j]
    moved, rate = damped_motion(
        rate, k * (was - y), k * (now - was) / span, k, d, decay(0.5 * d * span), span
    )
    rows[state][j], rows[state + 1][j] = y + moved, rate
    return y + moved, rate


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
