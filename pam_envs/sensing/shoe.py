"""The pressure shoe: load on the heel, stance or swing, and the paper's estimate of knee torque."""

from dataclasses import dataclass

from pam_envs.constants import GRAVITY
from pam_envs.kernels.build import kernel
from pam_envs.parameters import assumed, effect, published

HEEL_CELLS = 3.0
"""Load cells near the heel (yeh2010, section 4.2)."""


@dataclass(frozen=True)
class Shoe:
    """Stiff sole on load cells; those of the heel distinguish stance from swing."""

    heel: float = assumed(-0.05, "m", -0.15, 0.05, "heel cells, ahead of the ankle: behind it")
    tip: float = assumed(
        0.28,
        "m",
        0.1,
        0.4,
        "ahead of the ankle; a leg with its heel free bears under half of the body weight",
    )
    threshold: float = published(5.0, "kg", 0.1, 50.0, "yeh2010, section 4.2: mean heel load")
    flat_foot: float = effect(
        "1", 0.0, 1.0, "0: q_a is the shank's inclination; 1: the angle of the ankle"
    )


@kernel
def heel_load(vertical: float, cop: float, heel: float, tip: float) -> float:
    """Return the mean load [kg] on a heel cell of a sole that rests on heel and tip."""
    share = max(0.0, min(1.0, (tip - cop) / (tip - heel)))
    return max(0.0, vertical) * share / (GRAVITY * HEEL_CELLS)


@kernel
def estimated_torque(vertical: float, cop: float, inclination_sine: float, shank: float) -> float:
    """Return ``tau_w = f (L_0 cos q_a - r)`` [N m], yeh2010, Eq. (1).

    ``inclination_sine`` is ``cos q_a``, the sine of the shank's lean from the vertical.
    """
    return vertical * (shank * inclination_sine - cop)
