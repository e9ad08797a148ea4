"""Wearer's forearm with the orthosis on it, below a hanging upper arm.

    J_w q'' = J_w q_w'' + K (q_w - q) + D (q_w' - q') + w_w (sin q_w - sin q) + felt + pushed
    J_o q'' = Q - w_o sin q - d q' - felt

The wearer intends the motion ``q_w`` and holds the forearm there with a stiffness and a damping of
his own; ``felt`` is the torque of the orthosis on him at cuff and handle. If ``Q`` supports and
moves the orthosis exactly, ``felt`` is 0 and the forearm follows the intended motion exactly.
"""

from dataclasses import dataclass

from pam_envs.constants import GRAVITY
from pam_envs.mechanics.guide import BearingEffects
from pam_envs.parameters import assumed, derived, published

_BODY = (
    "forearm and hand of a wearer of 75 kg and 1.75 m: 0.022 of the mass, centre at 0.682 and "
    "radius of gyration at 0.827 of 0.146 of the height (Winter, Biomechanics and Motor Control "
    "of Human Movement, 4th edition, table 4.1)"
)
_HOLD = (
    "an elbow that holds its path against a load; relaxed ones are near 5, tense ones above "
    "50 N m/rad"
)
_SHELL = "half-shell, pulley and handle of the order of public devices; not published"


@dataclass(frozen=True)
class Wearer:
    """Forearm and hand, and how they are held."""

    mass: float = derived(1.65, "kg", 0.1, 5.0, _BODY, spread=(1.2, 2.2))
    centre: float = derived(0.174, "m", 0.02, 0.5, _BODY)
    inertia: float = derived(0.0737, "kg m2", 0.005, 0.5, _BODY, spread=(0.045, 0.11))
    stiffness: float = assumed(25.0, "N m/rad", 0.5, 200.0, _HOLD, spread=(12.0, 45.0))
    damping: float = assumed(1.5, "N m s/rad", 0.05, 20.0, "damping ratio 0.5", spread=(0.8, 2.5))
    handle: float = derived(0.32, "m", 0.1, 0.6, "elbow to grip: 0.146 + 0.037 of the height")


@dataclass(frozen=True)
class OrthosisLink(BearingEffects):
    """The moving part of the orthosis."""

    mass: float = assumed(0.5, "kg", 0.01, 10.0, _SHELL, spread=(0.35, 0.8))
    centre: float = assumed(0.12, "m", 0.0, 0.5, _SHELL)
    inertia: float = assumed(0.011, "kg m2", 1e-4, 1.0, _SHELL, spread=(0.008, 0.018))
    damping: float = assumed(0.1, "N m s/rad", 0.0, 20.0, "bearing and tubes", spread=(0.05, 0.2))
    gravity: float = published(
        GRAVITY, "m/s2", 0.0, 20.0, "standard; 0 for a level forearm", neutral=0.0
    )
