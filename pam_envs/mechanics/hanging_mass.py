"""A mass that hangs from a muscle, and the locally exact step of its motion."""

from __future__ import annotations

from dataclasses import dataclass

from pam_envs.kernels.build import kernel
from pam_envs.parameters import parameter

LARGEST_PHASE = 16.0
"""Largest ``abs(k - d^2 / 4) h^2`` for which the step's series hold (3e-7 relative)."""


@dataclass(frozen=True)
class HangingMass:
    """A load on the free end of the muscle.

    ``moving_mass`` is what moves even without a load (fitting, rod, part of the muscle): above
    zero, so that no load is a regular case. It is accelerated but was there when the contraction
    was zeroed, so its weight does not count.
    """

    load: float = parameter(
        2.55,
        "kg",
        0.0,
        50.0,
        "published",
        "positioning2021: 0, 2.55 and 4.55 kg",
        spread=(0.0, 4.55),
    )
    moving_mass: float = parameter(
        0.25,
        "kg",
        0.05,
        5.0,
        "assumed",
        "end fitting, rod and half the muscle of a 10 mm size; not published",
        spread=(0.15, 0.5),
    )
    damping: float = parameter(
        250.0,
        "N s/m",
        10.0,
        1e4,
        "assumed",
        "damping ratio 0.3 to 0.4 at 4.55 kg; published values for larger muscles are higher",
        spread=(120.0, 450.0),
    )
    # effects, neutral unless a recording shows them
    carried: float = parameter(
        1.0, "1", 0.0, 1.0, "assumed", "share of the load that is accelerated", neutral=1.0
    )
    load_error: float = parameter(
        0.0, "kg", -5.0, 5.0, "assumed", "what hangs beside a load that is told", neutral=0.0
    )
    slack: float = parameter(
        0.0,
        "m",
        0.0,
        0.02,
        "assumed",
        "contraction over which the support lets the load go",
        neutral=0.0,
    )
    stick: float = parameter(
        0.0, "N", 0.0, 200.0, "assumed", "force at which the guide breaks away", neutral=0.0
    )
    stick_kinetic: float = parameter(
        0.5, "1", 0.0, 1.0, "assumed", "force while it slides, over that at which it breaks away"
    )
    stick_speed: float = parameter(
        5e-3, "m/s", 1e-4, 1.0, "assumed", "speed at which friction falls to the kinetic one"
    )
    ring_share: float = parameter(
        0.0,
        "1",
        -1.0,
        1.0,
        "assumed",
        "share of the motion behind a mount that gives or tilts",
        neutral=0.0,
    )
    ring_frequency: float = parameter(7.0, "Hz", 0.5, 20.0, "assumed", "of the mount")
    ring_damping: float = parameter(0.1, "1", 0.005, 2.0, "assumed", "damping ratio of the mount")


@kernel
def oscillator(phase: float) -> tuple[float, float]:
    """Return ``cos(sqrt(phase))`` and ``sin(sqrt(phase)) / sqrt(phase)``, entire in ``phase``.

    Negative phases (an overdamped motion) give the hyperbolic functions.
    """
    z = 0.25 * phase
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
    return 2.0 * c * c - 1.0, s * c


@kernel
def oscillator_wide(phase: float) -> tuple[float, float]:
    """Return the same as :func:`oscillator` for phases up to 256, for long steps."""
    z = 0.015625 * phase
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

    Parameters
    ----------
    velocity : float
        At the start [m/s]; the displacement starts at 0.
    acceleration, jerk : float
        ``a`` [m/s2] and ``j`` [m/s3].
    stiffness, damping : float
        ``k`` [1/s2], above zero, and ``d`` [1/s], per unit mass.
    damped : float
        ``exp(-d h / 2)``.
    h : float
        Duration [s].
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
