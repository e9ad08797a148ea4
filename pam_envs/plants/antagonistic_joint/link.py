"""Link of a stage of antagonistic muscles, and its nominal point."""

from dataclasses import dataclass

from pam_envs.constants import GRAVITY
from pam_envs.mechanics.guide import BearingEffects
from pam_envs.parameters import assumed, derived, published

_FORM = "a slender rod of 0.3 kg; the masses of fluidic_muscles's stages are not published"


@dataclass(frozen=True)
class Stage:
    """Limits, damping and mechanical stops of one joint.

    ``limit`` bounds the setpoint. The stop is a stiff spring beyond ``stop``, before the
    stretched muscle loses its lever arm.
    """

    damping: float = assumed(0.05, "N m s/rad", 0.0, 100.0, "of the bearing", spread=(0.02, 0.1))
    limit: float = published(
        0.5235987755982988, "rad", 0.01, 0.6, "+-30 degrees: fluidic_muscles, section 2"
    )
    stop: float = assumed(0.6108652381980153, "rad", 0.02, 0.65, "35 degrees, 5 before the toggle")
    stop_stiffness: float = assumed(
        500.0, "N m/rad", 10.0, 1e5, "10 N m press it in by about a degree"
    )


@dataclass(frozen=True)
class Link(BearingEffects, Stage):
    """The link of a single stage, which hangs from the joint; a payload is fixed to its end."""

    length: float = assumed(
        0.25, "m", 0.02, 2.0, "of fluidic_muscles's chain, as its figures suggest"
    )
    mass: float = assumed(0.3, "kg", 0.01, 20.0, _FORM, spread=(0.2, 0.5))
    centre: float = derived(0.125, "m", 0.0, 2.0, _FORM)
    gyration: float = derived(
        0.14433756729740646, "m", 0.01, 2.0, "0.25 m over the root of 3: " + _FORM
    )
    gravity: float = published(
        GRAVITY, "m/s2", 0.0, 20.0, "standard gravity; 0 for a vertical axis", neutral=0.0
    )

    @property
    def inertia(self) -> float:
        """Return the inertia about the joint [kg m2]; ``gyration`` is its radius."""
        return self.mass * self.gyration * self.gyration


@dataclass(frozen=True)
class ArmFactors:
    """Factors that all links and all joints of a chain have in common.

    The masses of fluidic_muscles's arm are not published. A link weighs what
    :class:`~pam_envs.mechanics.serial_chain.chain.LinkForm` says, unless a chain is given.
    """

    mass_factor: float = assumed(
        1.0,
        "1",
        0.05,
        20.0,
        "of masses and inertias of all links; more than a tenth and path_3 is out of torque",
        spread=(0.9, 1.1),
    )
    damping_factor: float = assumed(
        1.0,
        "1",
        0.0,
        20.0,
        "of joint_damping, which makes up a ratio of a half with the straight arm rigid",
        spread=(0.7, 1.4),
    )


@dataclass(frozen=True)
class StagePoint:
    """The co-contraction for which a stage is laid out."""

    prestress: float = assumed(
        50.0,
        "N",
        1.0,
        300.0,
        "mean force of the two muscles: enough that friction slackens none near 0",
        spread=(40.0, 70.0),
    )


@dataclass(frozen=True)
class NominalPoint(StagePoint):
    """The straight joint at its usual co-contraction, and the reduced plant about it."""

    pole: float = published(23.0, "rad/s", 1.0, 200.0, "two real poles: fluidic_muscles, Fig. 12")
    stiffness: float = derived(
        14.8, "N m/rad", 0.5, 500.0, "of the plant with muscles at this point"
    )
