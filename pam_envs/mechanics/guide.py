"""Dry friction of a guide or a bearing: stick-slip motion with the Stribeck effect."""

from dataclasses import dataclass
from typing import Any, ClassVar

from pam_envs.kernels.arithmetic import decay
from pam_envs.kernels.build import kernel
from pam_envs.kernels.motion import damped_motion
from pam_envs.parameters import assumed, effect, parameter_rows


@dataclass(frozen=True, kw_only=True)
class GuideEffects:
    """Dry friction of the guide of a load."""

    stick: float = effect("N", 0.0, 200.0, "force at which the guide breaks away")
    stick_kinetic: float = assumed(0.5, "1", 0.0, 1.0, "sliding friction over breakaway friction")
    stick_speed: float = assumed(5e-3, "m/s", 1e-4, 1.0, "Stribeck speed")


@dataclass(frozen=True, kw_only=True)
class BearingEffects:
    """Dry friction of a joint's bearing."""

    effects: ClassVar[tuple[tuple[str, ...], ...]] = (("stick", "stick_kinetic", "stick_speed"),)

    stick: float = effect("N m", 0.0, 50.0, "torque at which the bearing breaks away")
    stick_kinetic: float = assumed(0.5, "1", 0.0, 1.0, "sliding friction over breakaway friction")
    stick_speed: float = assumed(0.05, "rad/s", 1e-3, 10.0, "Stribeck speed")


GUIDE = parameter_rows(GuideEffects)
"""Rows of a guide's or a bearing's effects, from the first."""


@kernel
def stick_slip_step(
    velocity: float, stuck: float, push: float, jerk: float, stiffness: float, damping: float,
    most: float, kinetic: float, pace: float, h: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Return displacement, velocity and whether the guide holds after ``h`` seconds.

    The guide holds until the push exceeds the breakaway friction; in motion the friction falls with
    speed towards the kinetic one (Stribeck). It holds again where the velocity passes zero.

    ``stuck`` is 1 where the guide holds at the start, else 0. Push (at the predicted middle), jerk,
    stiffness and damping describe the motion without friction, per unit mass (``damped_motion``);
    ``most``, ``kinetic`` and ``pace`` are the breakaway friction per unit mass, the kinetic share
    and the Stribeck speed.
    """
    end = push + jerk * h
    held = stuck > 0.0 and most > 0.0
    side = 1.0 if (end if held or velocity == 0.0 else velocity) > 0.0 else -1.0
    rubs = most * (kinetic + (1.0 - kinetic) * decay(min(40.0, abs(velocity) / pace)))
    a = push + 0.5 * stiffness * h * velocity - side * rubs
    dx, after = damped_motion(velocity, a, jerk, stiffness, damping, decay(0.5 * damping * h), h)
    turned = most > 0.0 and after * side < 0.0
    share = velocity / (velocity - after) if turned and velocity * side > 0.0 else 0.0
    dx = 0.5 * velocity * share * h if turned else dx
    rests = held and abs(end) <= most
    stops = rests or turned
    return 0.0 if rests else dx, 0.0 if stops else after, 1.0 if stops else 0.0


# placeholders of a plant whose bearing sticks: the row that says whether it holds, and the first of
# its effects (``GUIDE``)
STUCK = BEARING = 0


@kernel
def turn(
    rows: Any, fixed: Any, j: int, velocity: float, acceleration: float, jerk: float,
    stiffness: float, damping: float, per_inertia: float, h: float,
) -> tuple[float, float]:  # fmt: skip
    """Return the turn [rad] of a joint in ``h`` seconds and its velocity [rad/s] after it."""
    damped = decay(0.5 * damping * h)
    return damped_motion(velocity, acceleration, jerk, stiffness, damping, damped, h)


@kernel
def turn_on_bearing(
    rows: Any, fixed: Any, j: int, velocity: float, acceleration: float, jerk: float,
    stiffness: float, damping: float, per_inertia: float, h: float,
) -> tuple[float, float]:  # fmt: skip
    """Return the same as :func:`turn` on a bearing that sticks and slips."""
    push = acceleration - 0.5 * stiffness * h * velocity
    most = fixed[BEARING + GUIDE.stick][j] * per_inertia
    kinetic, pace = fixed[BEARING + GUIDE.stick_kinetic][j], fixed[BEARING + GUIDE.stick_speed][j]
    dx, after, rows[STUCK][j] = stick_slip_step(
        velocity, rows[STUCK][j], push, jerk, stiffness, damping, most, kinetic, pace, h
    )
    return dx, after
