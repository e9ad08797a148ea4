"""Tracking of torque and stiffness: virtual objects, weights of the reward, limits.

The orthosis renders virtual objects to its wearer (haptic rendering). An object is a torque and a
stiffness for every angle of the elbow; flexion is positive, the upper arm hangs.

* a *weight* in the hand pulls the forearm down, ``Q = -m g l sin(q)``, at a moderate stiffness;
* a *wall* is a stiff spring beyond an angle, and nothing before it;
* *free* motion: no torque, and a low stiffness.
"""

from dataclasses import dataclass

from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import kernel
from pam_envs.parameters import assumed
from pam_envs.tasks.rewards import weight

OBJECTS = ("weight", "wall", "free", "mixed")
WEIGHT, WALL, FREE, MIXED = range(len(OBJECTS))
RANGES = (
    ("lightest", "heaviest"),
    ("softest_free", "stiffest_free"),
    ("softest_held", "stiffest_held"),
    ("nearest_wall", "farthest_wall"),
    ("softest_wall", "stiffest_wall"),
)
"""Pairs of parameters that bound the range of an episode's object."""


@dataclass(frozen=True)
class TorqueStiffness:
    """Weights, limits and objects.

    ``reward = reward/torque + reward/stiffness + reward/effort + reward/ended``.
    """

    torque_weight: float = weight(1.0, "reward per control period at an error of torque_scale")
    torque_scale: float = assumed(0.5, "N m", 1e-4, 1e3, "error that costs torque_weight")
    stiffness_weight: float = weight(
        0.2, "1 N m/rad costs as much as 0.2 N m, the torque error that it causes 0.2 rad away"
    )
    stiffness_scale: float = assumed(0.5, "N m/rad", 1e-4, 1e3, "error that costs stiffness_weight")
    effort_weight: float = weight(
        0.2, "cost of moving both setpoints over their range, or of coils that are always on"
    )
    soft_pressure: float = assumed(5.9e5, "Pa", 0.0, 1e7, "below the supply, chakarov2018")
    lightest: float = assumed(0.3, "kg", 0.0, 10.0, "lightest weight drawn: a cup")
    heaviest: float = assumed(1.5, "kg", 0.0, 10.0, "3 muscles carry 2.2 kg at 60 degrees")
    softest_free: float = assumed(2.0, "N m/rad", 0.0, 50.0, "near the least feasible at no torque")
    stiffest_free: float = assumed(3.5, "N m/rad", 0.0, 50.0, "free motion is to be soft")
    softest_held: float = assumed(3.0, "N m/rad", 0.0, 50.0, "under a weight; at times infeasible")
    stiffest_held: float = assumed(5.0, "N m/rad", 0.0, 50.0, "feasible unless the arm is straight")
    nearest_wall: float = assumed(0.8, "rad", 0.0, 3.0, "46 degrees; straighter arms are softer")
    farthest_wall: float = assumed(1.3, "rad", 0.0, 3.0, "74 degrees, within most reaches")
    softest_wall: float = assumed(5.0, "N m/rad", 0.0, 50.0, "twice the stiffness of free motion")
    stiffest_wall: float = assumed(7.0, "N m/rad", 0.0, 50.0, "nearly the largest feasible there")
    wall_depth: float = assumed(0.05, "rad", 1e-3, 1.0, "depth at which the wall is stiff")

    def __post_init__(self) -> None:
        """Check that no range of the objects is reversed."""
        for low, high in RANGES:
            first, last = getattr(self, low), getattr(self, high)
            if first > last:
                raise ValueError(
                    f"reward: {low} = {first:g} is above {high} = {last:g}; swap them, or give both"
                )

    def worst(self, torque: float, stiffness: float) -> float:
        """Return the largest cost of a control period with these errors [N m], [N m/rad]."""
        off = self.torque_weight * torque / self.torque_scale
        return off + self.stiffness_weight * stiffness / self.stiffness_scale + self.effort_weight


@kernel
def object_torque(kind: float, angle: float, place: float, strength: float) -> float:
    """Return the torque [N m] of an object of a kind (``WEIGHT``, ...) at an angle [rad].

    ``place`` is the angle of a wall, ``strength`` the largest torque of a weight [N m] or the
    stiffness of a wall [N m/rad].
    """
    if kind == WEIGHT:
        sine, _ = sine_and_cosine(angle)
        return -strength * sine
    if kind == WALL:
        return -strength * max(0.0, angle - place)
    return 0.0


@kernel
def object_stiffness(
    kind: float, angle: float, place: float, strength: float, level: float, depth: float
) -> float:
    """Return the stiffness [N m/rad] of an object (:func:`object_torque`) at an angle [rad].

    ``level`` is the stiffness without a wall, ``depth`` [rad] the angle over which it rises to the
    wall's.
    """
    if kind == WALL:
        return level + (strength - level) * max(0.0, min(1.0, (angle - place) / depth))
    return level
