"""Mass on the free end of a muscle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pam_envs.mechanics.guide import GuideEffects
from pam_envs.mechanics.support import MountEffects, SupportEffects
from pam_envs.parameters import assumed, effect, published


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
        ("slack",),
        ("stick", "stick_kinetic", "stick_speed"),
        ("ring_share", "ring_frequency", "ring_damping"),
    )

    load: float = published(2.55, "kg", 0.0, 50.0, "of positioning2021", spread=(0.0, 4.55))
    moving_mass: float = assumed(
        0.25, "kg", 0.05, 5.0, "end fitting, rod and half of a 10 mm muscle", spread=(0.15, 0.5)
    )
    damping: float = assumed(
        250.0, "N s/m", 10.0, 1e4, "damping ratio 0.3 to 0.4 at 4.55 kg", spread=(120.0, 450.0)
    )
    # effects, neutral unless a recording shows them
    carried: float = assumed(1.0, "1", 0.0, 1.0, "accelerated share of the load", neutral=1.0)
    load_error: float = effect("kg", -5.0, 5.0, "what hangs beside the declared load")
