"""Stick-slip: the guide sticks, breaks away and sticks again.

The dry friction of a guide is larger at rest than in motion, so that slow motion proceeds in jumps.
The load is at rest until the force exceeds the breakaway force and then jumps to an equilibrium
with the kinetic friction. Weak sticking resembles a loss that depends on direction.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.fit.starting_values import grid

_BREAKS = (0.8, 1.3, 2.1, 3.4, 5.0, 7.2, 10.0, 15.0, 25.0)
_HOLDS = (0.45, 0.7)
_SPEEDS = (5e-4, 3e-3)

CAUSE = Cause(
    name="stick_slip",
    title="stick-slip in the guide",
    forms=(
        Form(
            "Stribeck",
            (
                Term("mass.stick", (4.0,), scale=4.0),
                Term("mass.stick_kinetic", (0.4,), high=0.95, scale=1.0, amount=False),
                Term("mass.stick_speed", (5e-3,), high=0.3, log=True, amount=False),
            ),
            search=grid(_BREAKS, _HOLDS, _SPEEDS, best=5),
        ),
    ),
    signature="a saw-tooth with the sign of the direction: slow motion stops and jumps",
    neighbours=("viscous_loss", "hysteresis_drive", "hysteresis_shape", "valve_dead_band"),
    experiment=(
        "A very slow triangle, 10 s or more for each way: stick-slip gives stairs, other "
        "causes a line; the pressure is smooth, unlike with a dead band of the valve."
    ),
    source="armstrong1994; sizes are assumed, within what guides of small rigs show.",
    needs=("contraction",),
    sensor="a position sensor of higher resolution, or a load cell between muscle and load",
    # not compensable: below the breakaway force nothing moves, and noise decides where it sticks
)
