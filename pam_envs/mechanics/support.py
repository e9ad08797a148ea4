"""Support under a hanging load, and the compliant mount of the whole."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pam_envs.kernels.build import kernel
from pam_envs.kernels.motion import resonator_step
from pam_envs.parameters import assumed, effect, named_rows


@dataclass(frozen=True, kw_only=True)
class SupportEffects:
    """Support that gives way under the load."""

    slack: float = effect("m", 0.0, 0.02, "contraction over which the support lets the load go")


@dataclass(frozen=True, kw_only=True)
class MountEffects:
    """Compliant mount; rigid by default."""

    ring_share: float = effect("1", -1.0, 1.0, "share of the motion behind a compliant mount")
    ring_frequency: float = assumed(7.0, "Hz", 0.5, 20.0, "of the mount")
    ring_damping: float = assumed(0.1, "1", 0.005, 2.0, "damping ratio of the mount")


MOUNT_STATE = named_rows("position", "rate")
"""Rows of a mount's state, from the first."""


@kernel
def load_fraction(x: float, hangs: float, slack: float) -> float:
    """Return the share of a load that hangs on the muscle, 0 to 1.

    From the position ``hangs`` of the unpressurised muscle [m] on, the muscle takes the load over
    from the support within ``slack`` [m].
    """
    return 1.0 if slack <= 0.0 else max(0.0, min(1.0, (x - hangs) / slack))


@kernel
def mount_step(
    rows: Any, j: int, state: int, was: float, now: float, share: float, turns: float, ratio: float,
    h: float,
) -> float:  # fmt: skip
    """Return the position [m] of a load of lane ``j`` behind the mount after ``h`` seconds.

    ``state`` is the first row of the mount (``MOUNT_STATE``); the load before the mount moves from
    ``was`` to ``now`` [m]. ``share``, ``turns`` and ``ratio`` are those of :class:`MountEffects`.
    """
    swung, _ = resonator_step(rows, j, state, was, now, turns, ratio, h)
    return (1.0 - share) * now + share * swung
