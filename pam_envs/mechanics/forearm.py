"""The wearer's forearm with the orthosis on it, below a hanging upper arm.

    J_w q'' = J_w q_w'' + K (q_w - q) + D (q_w' - q') + w_w (sin q_w - sin q) + felt + pushed
    J_o q'' = Q - w_o sin q - d q' - felt

The wearer moves his forearm as he intends, ``q_w``, and holds it there with a stiffness and a
damping of his own; ``felt`` is the torque that the orthosis puts on him at cuff and handle. An
orthosis that bears itself is not felt, and the intended motion is then carried out exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

from pam_envs.constants import GRAVITY
from pam_envs.mechanics.guide import BearingEffects
from pam_envs.parameters import parameter

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

    mass: float = parameter(1.65, "kg", 0.1, 5.0, "derived", _BODY, spread=(1.2, 2.2))
    centre: float = parameter(0.174, "m", 0.02, 0.5, "derived", _BODY)
    inertia: float = parameter(0.0737, "kg m2", 0.005, 0.5, "derived", _BODY, spread=(0.045, 0.11))
    stiffness: float = parameter(25.0, "N m/rad", 0.5, 200.0, "assumed", _HOLD, spread=(12.0, 45.0))
    damping: float = parameter(
        1.5, "N m s/rad", 0.05, 20.0, "assumed", "damping ratio of about a half", spread=(0.8, 2.5)
    )
    handle: float = parameter(
        0.32, "m", 0.1, 0.6, "derived", "elbow to grip: 0.146 + 0.037 of the wearer's height"
    )


@dataclass(frozen=True)
class OrthosisLink(BearingEffects):
    """The moving part of the orthosis."""

    mass: float = parameter(0.5, "kg", 0.01, 10.0, "assumed", _SHELL, spread=(0.35, 0.8))
    centre: float = parameter(0.12, "m", 0.0, 0.5, "assumed", _SHELL)
    inertia: float = parameter(0.011, "kg m2", 1e-4, 1.0, "assumed", _SHELL, spread=(0.008, 0.018))
    damping: float = parameter(
        0.1, "N m s/rad", 0.0, 20.0, "assumed", "of bearing and tubes", spread=(0.05, 0.2)
    )
    gravity: float = parameter(
        GRAVITY,
        "m/s2",
        0.0,
        20.0,
        "published",
        "standard gravity; 0 for a forearm that moves level",
        neutral=0.0,
    )
