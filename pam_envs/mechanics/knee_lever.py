"""The zig-zag wire of the orthosis as a torsion spring, and the lever arm of the muscle.

The wire's two arms of length ``L_b`` include the angle ``theta``; the muscle, with fittings of
length ``L_a``, spans their ends (yeh2010, Fig. 4). Bending the knee opens the angle, the muscle
closes it:

    L = 2 L_b sin(theta / 2) - L_a,          dL / d theta = L_b cos(theta / 2)
    tau_a = T L_b cos(theta / 2) - kappa (theta_0 - theta)

with ``tau_a`` positive in extension. The paper's Eq. (3) has the opposite sign of ``tau_a``, and
later a squared cosine, which the virtual work of ``T`` does not.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import kernel
from pam_envs.mechanics.guide import BearingEffects
from pam_envs.parameters import assumed, derived

_GEOMETRY = "reproduces 158 N at 2 bar and 22 cm with yeh2010's range of tension and stiffness"


@dataclass(frozen=True)
class KneeLever(BearingEffects):
    """Geometry, spring and inertia of the brace.

    ``mount_angle`` is the wire's angle at a straight knee; it depends on how the brace is strapped
    on.
    """

    arm: float = assumed(0.14, "m", 0.05, 0.4, f"L_b; {_GEOMETRY}")
    fittings: float = derived(0.0094, "m", 0.0, 0.1, f"L_a; {_GEOMETRY}")
    stiffness: float = assumed(30.0, "N m/rad", 1.0, 1e3, _GEOMETRY, spread=(27.0, 33.0))
    relaxed_angle: float = derived(
        2.3422, "rad", 0.5, 3.1, "theta_0, at rest at 2 bar, 110 degrees"
    )
    mount_angle: float = assumed(
        1.7453, "rad", 0.5, 3.0, "20 % of the torque of a slow stride then takes up to 3.7 bar"
    )
    inertia: float = assumed(0.02, "kg m2", 1e-3, 0.5, "half a brace of 0.8 kg about the knee")
    damping: float = assumed(1.0, "N m s/rad", 0.05, 50.0, "brace and muscle: damping ratio 0.5")

    @property
    def full_length(self) -> float:
        """Length of the muscle in the fully open brace [m], from which its strain counts."""
        return 2.0 * self.arm - self.fittings

    def length(self, angle: ArrayLike) -> NDArray[np.float64]:
        """Return the muscle's length ``L`` [m] at an angle [rad], Eq. (4)."""
        return np.asarray(2.0 * self.arm * np.sin(0.5 * np.asarray(angle)) - self.fittings)

    def angle(self, length: ArrayLike) -> NDArray[np.float64]:
        """Return the angle [rad] at a muscle's length [m], Eq. (4)."""
        return np.asarray(2.0 * np.arcsin((np.asarray(length) + self.fittings) / (2.0 * self.arm)))

    def lever_arm(self, angle: ArrayLike) -> NDArray[np.float64]:
        """Return the lever arm of the tension [m] at an angle [rad]."""
        return np.asarray(self.arm * np.cos(0.5 * np.asarray(angle)))

    def spring_torque(self, angle: ArrayLike) -> NDArray[np.float64]:
        """Return the wire's torque [N m] at an angle [rad], positive where it opens."""
        return np.asarray(self.stiffness * (self.relaxed_angle - np.asarray(angle)))

    def torque(self, tension: ArrayLike, angle: ArrayLike) -> NDArray[np.float64]:
        """Return the assistive torque [N m], extension positive: Eq. (3), corrected."""
        return np.asarray(tension) * self.lever_arm(angle) - self.spring_torque(angle)

    def tension(self, torque: ArrayLike, angle: ArrayLike) -> NDArray[np.float64]:
        """Return the tension ``T_d`` [N] that gives an assistive torque [N m] at an angle [rad]."""
        return (self.spring_torque(angle) + np.asarray(torque)) / self.lever_arm(angle)


@kernel
def muscle_length(sine: float, arm: float, fittings: float) -> float:
    """Return the muscle's length [m]; ``sine`` is that of half the angle."""
    return 2.0 * arm * sine - fittings


@kernel
def assistive_torque(
    tension: float, cosine: float, angle: float, arm: float, stiffness: float, relaxed: float
) -> float:
    """Return the torque on the knee [N m], extension positive; ``cosine`` is of half the angle."""
    return tension * arm * cosine - stiffness * (relaxed - angle)


@kernel
def required_tension(
    angle: float, torque: float, arm: float, stiffness: float, relaxed: float
) -> float:
    """Return the tension ``T_d`` [N] for an assistive torque [N m] at an angle [rad].

    ``[kappa (theta_0 - theta) + tau_a] / (L_b cos(theta / 2))``, at least 0: a muscle cannot push.
    Within half a degree of the toggle the lever arm is that at half a degree.
    """
    _, cosine = sine_and_cosine(0.5 * angle)
    return max(0.0, stiffness * (relaxed - angle) + torque) / (arm * max(cosine, 0.00436))
