"""Supply of compressed air: a throat that limits the flow, and a reservoir that droops."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pam_envs.constants import ATMOSPHERE
from pam_envs.kernels.build import kernel
from pam_envs.parameters import assumed, effect

AMPLE = 2e7
"""Supply pressure [Pa] that limits nothing."""


@dataclass(frozen=True, kw_only=True)
class SupplyEffects:
    """Supply of a regulator, without limit by default."""

    supply_pressure: float = assumed(AMPLE, "Pa", 5e4, AMPLE, "reservoir at rest", neutral=AMPLE)
    supply_droop: float = effect("1", 0.0, 5.0, "supply pressure lost over pressure filled")
    supply_time: float = assumed(0.01, "s", 0.001, 5.0, "filling time at full flow")
    supply_recovery: float = assumed(10.0, "s", 0.1, 1e3, "filling time of the empty reservoir")


@kernel
def norm_8(a: float, b: float) -> float:
    """Return the eighth root of the sum of eighth powers: a slightly rounded maximum."""
    a2, b2 = a * a, b * b
    a4, b4 = a2 * a2, b2 * b2
    return math.sqrt(math.sqrt(math.sqrt(a4 * a4 + b4 * b4)))


@kernel
def supplied(
    pressure: float, reached: float, rest: float, drop: float, time: float, h: float
) -> float:
    """Return the pressure [Pa] after ``h`` seconds, limited by the flow of the supply.

    ``reached`` is the pressure without the limit, ``rest`` the supply pressure at rest, ``drop``
    its drop, ``time`` the ``supply_time`` [s]. The flow is choked, and goes with the root of the
    difference near the supply's pressure.
    """
    supply = rest - drop
    most = (supply + ATMOSPHERE) / time
    head = math.sqrt(max(0.0, supply - pressure))
    head = max(0.0, head - h * most / math.sqrt(2.0 * max(1.0, supply + ATMOSPHERE)))
    throat = max(0.0, min(h * most, supply - head * head - pressure))
    filling = max(1e-9, reached - pressure)
    share = throat / norm_8(filling, throat)  # the narrower of valve and throat, hardly rounded
    ample = reached <= pressure or rest >= AMPLE
    return reached if ample else pressure + filling * share


@kernel
def supply_drop(
    drop: float, filled: float, rest: float, droop: float, recovery: float, h: float
) -> float:
    """Return the drop of the supply pressure [Pa] after a muscle was filled by ``filled`` [Pa].

    The reservoir is filled through an orifice, as the root of the drop.
    """
    lacks = math.sqrt(drop + droop * max(0.0, filled))
    full = math.sqrt(0.5 * (rest + ATMOSPHERE))
    lacks = max(0.0, lacks - full * h / recovery)
    return lacks * lacks
