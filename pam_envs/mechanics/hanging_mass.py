"""Mass on the free end of a muscle, its support and its mount."""

from dataclasses import dataclass
from typing import Any, ClassVar

from pam_envs.kernels.arithmetic import decay
from pam_envs.kernels.build import kernel
from pam_envs.kernels.motion import resonator_step
from pam_envs.mechanics.guide import GuideEffects
from pam_envs.parameters import assumed, effect, named_rows, published


@dataclass(frozen=True, kw_only=True)
class SupportEffects:
    """Support that gives way under the load, or a slack wire."""

    slack: float = effect("m", 0.0, 0.02, "contraction over which the support lets the load go")
    slack_free: float = assumed(0.0, "1", 0.0, 0.95, "share of it without any load", neutral=0.0)
    slack_sag: float = assumed(
        0.0,
        "1",
        0.0,
        1.0,
        "from a straight rise of the load to a sagging wire's",
        neutral=0.0,
    )


@dataclass(frozen=True, kw_only=True)
class MountEffects:
    """Compliant mount; rigid by default."""

    ring_share: float = effect("1", -1.0, 1.0, "share of the motion behind a compliant mount")
    ring_frequency: float = assumed(7.0, "Hz", 0.5, 20.0, "of the mount")
    ring_damping: float = assumed(0.1, "1", 0.005, 2.0, "damping ratio of the mount")


@dataclass(frozen=True)
class HangingMass(MountEffects, SupportEffects, GuideEffects):
    """A load on the free end of the muscle.

    ``moving_mass`` is what moves even without a load (fitting, rod, part of the muscle): above
    zero, so that no load is a regular case. It is accelerated but was there when the contraction
    was zeroed, so its weight does not count.
    """

    effects: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("carried",),
        ("load_error",),
        ("slack", "slack_free", "slack_sag"),
        ("stick", "stick_kinetic", "stick_speed"),
        ("ring_share", "ring_frequency", "ring_damping"),
    )

    load: float = published(2.55, "kg", 0.0, 100.0, "of positioning2021", spread=(0.0, 4.55))
    moving_mass: float = assumed(
        0.25, "kg", 1e-3, 100.0, "end fitting, rod and half of a 10 mm muscle", spread=(0.15, 0.5)
    )
    damping: float = assumed(
        250.0, "N s/m", 0.1, 1e5, "damping ratio 0.3 to 0.4 at 4.55 kg", spread=(120.0, 450.0)
    )
    # effects, neutral unless a recording shows them
    carried: float = assumed(1.0, "1", 0.0, 1.0, "accelerated share of the load", neutral=1.0)
    load_error: float = effect("kg", -5.0, 5.0, "what hangs beside the declared load")


MOUNT_STATE = named_rows("position", "rate")
"""Rows of a mount's state, from the first."""


@kernel
def load_fraction(
    x: float, hangs: float, slack: float, free: float, sag: float
) -> tuple[float, float]:
    """Return the share of a load that hangs on the muscle, 0 to 1, and its slope [1/m].

    From the position ``hangs`` of the unpressurised muscle [m] on, the muscle takes the load over
    from the support within ``slack`` [m]: in a straight line after the share ``free`` of it, or as
    an exponential function for the share ``sag`` of the load.
    """
    if slack <= 0.0:
        return 1.0, 0.0
    u, width = max(0.0, (x - hangs) / slack), 1.0 - free
    straight = max(0.0, min(1.0, (u - free) / width))
    rising = 1.0 / width if 0.0 < straight < 1.0 else 0.0
    left = decay(min(40.0, u))
    bent = left if u > 0.0 else 0.0
    share = straight + sag * (1.0 - left - straight)
    return share, (rising + sag * (bent - rising)) / slack


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
