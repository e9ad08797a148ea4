"""Shank and foot about the knee: torque at the knee, and the wearer's hold of the path.

The shank leans forward by ``psi`` (knee ahead of the ankle), the thigh by ``beta = q - psi`` with
the knee flexion ``q``. The hip moves evenly, so that the knee's acceleration is the thigh's. The
*full balance* about the knee, extension positive,

    tau = F_z (l sin psi - r) - F_x h - m c [a_x cos psi ... ] - I psi''

is the torque that the wearer's muscles and the orthosis provide together; Eq. (1) of yeh2010 is its
first term. Off the natural pace the force leans less, with the square of the pace, and the centre
of pressure stays at the heel for longer (:func:`centre_of_pressure`).

If the orthosis pushes the knee off the wearer's path by ``e``, the wearer resists like a spring and
a damper, which are stiffer under more load on the leg; gravity on the shank acts in either
direction:

    (I + I_brace) e'' = -tau_a - K e - B e' + d(gravity) e

In stance this models the wearer's posture and not the bodies above the knee. Past the relaxed angle
of the brace's wire, where the pneumatic muscle cannot compensate the torque of the wire, the wearer
bears a share of this torque (``habituation``).

A *prescribed* wearer (``adaptation = 0``) gives up effort by all the assistance, at once. An
*adaptive* one gives up what is expected, part by part of the stride: the expectation follows the
assistance of the last strides and is forgotten (emken2007); the rest meets a stretch reflex and
both muscle groups, so that assistance that comes as a surprise saves nothing.
"""

from dataclasses import dataclass

from pam_envs.constants import GRAVITY
from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import kernel
from pam_envs.parameters import assumed, derived, published

_AIM = (
    "height that the ground's force keeps pointing at while it brakes, at another pace; "
    "least squares on the measured stride give 1.13 m; 0: the centre of pressure as measured"
)
_SCALED = "OpenSim segment masses, gait10dof18musc, scaled to the body mass"
_LEARNED = "first order in strides, emken2007; 0: the wearer is prescribed"
_SWING = "wearer in swing; of the order of measured knee impedance"
_STANCE = "gained at full body weight; of the order of measured knee impedance"


@dataclass(frozen=True)
class Leg:
    """Shank and foot of the wearer, and how he holds his knee."""

    body_mass: float = published(72.6, "kg", 20.0, 200.0, "measured subject", spread=(60.0, 85.0))
    mass: float = derived(5.1, "kg", 1.0, 15.0, _SCALED)
    inertia: float = derived(0.49, "kg m2", 0.05, 2.0, f"about the knee; {_SCALED}")
    centre: float = derived(0.263, "m", 0.05, 0.6, f"centre of mass below the knee; {_SCALED}")
    shank: float = derived(0.43, "m", 0.2, 0.7, "L_0, knee to ankle, same model")
    thigh: float = derived(0.41, "m", 0.2, 0.7, "hip to knee, same model")
    ankle_height: float = assumed(0.08, "m", 0.0, 0.2, "ankle above the sole, heel on the ground")
    aim_height: float = assumed(1.0, "m", 0.0, 2.0, _AIM, neutral=0.0, spread=(0.9, 1.15))
    damping: float = derived(0.38, "N m s/rad", 0.0, 20.0, "passive knee, pendulum: 0.35-0.42")
    stiffness: float = derived(2.8, "N m/rad", 0.0, 100.0, "passive knee, period of pendulum tests")
    hold_stiffness: float = assumed(20.0, "N m/rad", 0.0, 500.0, _SWING, spread=(12.0, 35.0))
    hold_damping: float = assumed(3.0, "N m s/rad", 0.0, 50.0, _SWING)
    stance_stiffness: float = assumed(250.0, "N m/rad", 0.0, 2e3, _STANCE, spread=(150.0, 350.0))
    stance_damping: float = assumed(12.0, "N m s/rad", 0.0, 200.0, _STANCE)
    habituation: float = assumed(
        1.0,
        "1",
        0.0,
        1.0,
        "share of the wire's torque past its relaxed angle borne by the wearer",
        spread=(0.7, 1.0),
    )
    reflex: float = assumed(
        0.0, "N m/rad", 0.0, 100.0, "stiffness of the stretch reflex of an adaptive wearer"
    )
    adaptation: float = assumed(
        0.0, "1", 0.0, 1.0, f"share of the unexpected assistance learned in a stride; {_LEARNED}"
    )
    forgetting: float = assumed(
        0.0, "1", 0.0, 1.0, f"share of the expected assistance forgotten in a stride; {_LEARNED}"
    )


@kernel
def centre_of_pressure(
    natural: float, ground_x: float, ground_z: float, quick: float, aim: float, heel: float,
    tip: float,
) -> float:  # fmt: skip
    """Return the centre of pressure [m ahead of the ankle] at another pace than the natural one.

    Horizontal forces grow with the square of the pace. The ground's force points at about the
    centre of mass, or the body would tip over: at a slow walk it is almost upright and acts at the
    heel for longer. While it drives the body ahead the centre of pressure does not move: it is
    already at the ball of the foot, and further ahead the heel would be unloaded under the whole
    body weight.

    ``natural`` [m], ``ground_x`` and ``ground_z`` (one unit) are those of the natural pace,
    ``quick`` the pace over it, ``aim`` the height [m] that the braking force points at (0: as
    measured), ``heel`` and ``tip`` the ends of the sole [m].
    """
    leaning = min(0.0, ground_x) / max(ground_z, 0.05)
    return max(heel, min(tip, natural + (1.0 - quick * quick) * aim * leaning))


@kernel
def knee_acceleration(
    thigh_angle: float, rate: float, acceleration: float, thigh: float
) -> tuple[float, float]:
    """Return the knee's acceleration [m/s2], ahead and up, below a hip that moves evenly."""
    s, c = sine_and_cosine(thigh_angle)
    r2 = rate * rate
    return thigh * (c * acceleration - s * r2), thigh * (s * acceleration + c * r2)


@kernel
def shank_torque(
    sine: float,
    cosine: float,
    ahead: float,
    up: float,
    angular: float,
    mass: float,
    centre: float,
    inertia: float,
) -> float:
    """Return the knee torque [N m] for the weight and the acceleration of shank and foot.

    ``sine, cosine`` and ``angular`` [rad/s2] are of the shank's lean, ``ahead`` and ``up`` [m/s2]
    accelerate the knee; ``mass`` [kg], ``centre`` [m] below and ``inertia`` [kg m2] about it.
    """
    return mass * centre * (ahead * cosine - (GRAVITY + up) * sine) - inertia * angular


@kernel
def gravity_stiffness(
    sine: float, cosine: float, ahead: float, up: float, mass: float, centre: float
) -> float:
    """Return the restoring torque over deviation [N m/rad] of shank and foot about their path."""
    return mass * centre * (ahead * sine + (GRAVITY + up) * cosine)


@kernel
def ground_torque(
    vertical: float, horizontal: float, cop: float, sine: float, cosine: float, shank: float,
    ankle_height: float,
) -> float:  # fmt: skip
    """Return the knee torque [N m] for the ground's force; ``sine, cosine`` of the shank's lean."""
    return vertical * (shank * sine - cop) - horizontal * (ankle_height + shank * cosine)
