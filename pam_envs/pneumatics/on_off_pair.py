"""Pair of on/off valves, one that fills a bundle and one that empties it.

The coil of a valve is switched on for a pulse at the start of a cycle. A valve opens when its coil
has been on for ``opening_time`` and closes when it has been off for ``closing_time``: a pulse of
width ``w`` opens it for ``w - opening_time + closing_time``, and one shorter than ``opening_time``
not at all. The flow of an open valve follows ISO 6358 (:mod:`pam_envs.pneumatics.flow`). The air in
the bundle stays at 20 degrees C. A check valve keeps it out of the supply.
"""

from dataclasses import dataclass

from pam_envs.constants import ATMOSPHERE
from pam_envs.kernels.build import kernel
from pam_envs.parameters import assumed, derived, published
from pam_envs.pneumatics.flow import mass_flow

_MAKER = (
    "maker's data sheet of the V100 series, standard V114, the valve that chakarov2018 names in "
    "section 4 without further data"
)
_LOST = "a digit is lost in the copy of the " + _MAKER
_RESTORED = _LOST + "; restored so that the flow from 6 to 5 bar is the 8.4 l/min that it states"


@dataclass(frozen=True)
class OnOffValve:
    """Direct-operated 3-port valve (SMC V114), used as 2-port.

    Open for a whole cycle it fills seven muscles by some 5 kPa.
    """

    supply_pressure: float = published(
        6e5, "Pa", 5e4, 1.2e6, "gauge, 6 bar: chakarov2018, section 2", spread=(5e5, 6e5)
    )
    conductance: float = derived(
        3.7e-10,
        "m3/(s Pa)",
        1e-12,
        1e-6,
        _RESTORED + ": C = 0.037 dm3/(s bar)",
        spread=(3e-10, 4.4e-10),
    )
    critical_ratio: float = derived(
        0.11, "1", 0.0, 0.9, _RESTORED + ": b = 0.11", spread=(0.08, 0.3)
    )
    opening_time: float = assumed(
        5e-3, "s", 1e-4, 0.1, "5 ms or less; " + _LOST, spread=(3e-3, 7e-3)
    )
    closing_time: float = published(
        4e-3, "s", 1e-4, 0.1, _MAKER + ": 4 ms or less", spread=(2.5e-3, 6e-3)
    )
    frequency: float = assumed(20.0, "Hz", 1.0, 100.0, "20 cycles a second at most; " + _LOST)


@kernel
def coil_window(
    left: float, lift: float, opened: float, opening: float, closing: float, h: float
) -> tuple[float, float, float, float]:
    """Return how long a valve is open within ``h`` seconds, then new ``left, lift, opened``.

    ``left`` [s] is for how long the coil stays on; ``lift`` rises from 0, long off, to 1, on for
    ``opening`` [s]; ``opened`` is 1 while the valve is open, else 0.
    """
    on = min(left, h)
    wait = (1.0 - lift) * opening if opened < 0.5 else 0.0
    is_open = opened > 0.5 or (on > 0.0 and on >= wait)
    duration = on - wait if is_open else 0.0
    lift = min(1.0, lift + on / opening)
    off = h - on
    fall = lift * closing
    if is_open:
        duration = duration + min(off, fall)
    stays = is_open and (off <= 0.0 or off < fall)
    return duration, left - on, max(0.0, lift - off / closing), 1.0 if stays else 0.0


@kernel
def filled(
    mass: float, per_volume: float, supply: float, conductance: float, critical: float,
    duration: float,
) -> float:  # fmt: skip
    """Return the air [kg] that enters through an open valve, by the midpoint rule.

    At most what brings the chamber to the supply's absolute pressure [Pa]. ``per_volume`` is the
    chamber's pressure over its mass [Pa/kg].
    """
    room = max(0.0, supply / per_volume - mass)
    half = 0.5 * duration * mass_flow(supply, mass * per_volume, conductance, critical)
    if half >= room:
        return room
    middle = (mass + half) * per_volume
    return min(room, duration * mass_flow(supply, middle, conductance, critical))


@kernel
def emptied(
    mass: float, per_volume: float, conductance: float, critical: float, duration: float
) -> float:
    """Return the air [kg] that leaves to the atmosphere; see :func:`filled`."""
    rest = ATMOSPHERE / per_volume
    room = max(0.0, mass - rest)
    half = 0.5 * duration * mass_flow(mass * per_volume, ATMOSPHERE, conductance, critical)
    if half >= room:
        return room
    middle = (mass - half) * per_volume
    return min(room, duration * mass_flow(middle, ATMOSPHERE, conductance, critical))
