"""First-cycle softening: a rested muscle is stiffer and has more friction.

Filled rubber loses part of its stiffness at the first stretch (Mullins effect) and recovers it in a
long rest; strands that adhere to one another come loose. The first travel of the pressure therefore
has more passive force or less effective pressure, and wider loops, which decay with the travel.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="first_cycle_softening",
    title="softening over the first cycles",
    forms=(
        Form(
            "stiffness",
            (
                Term("hysteresis.first_stiffness", (50.0,), scale=50.0),
                Term("hysteresis.first_width", (0.1,), scale=0.1),
                Term("hysteresis.first_travel", (1e6, 6e6), log=True, amount=False),
            ),
        ),
        Form(
            "width and loss",
            (
                Term("hysteresis.first_width", (0.1,), scale=0.1),
                Term("hysteresis.first_loss", (0.01,), scale=0.01),
                Term("hysteresis.first_travel", (1e6, 6e6), log=True, amount=False),
            ),
        ),
    ),
    signature="the first cycles contract less, with wider loops; it decays with travel, not time",
    neighbours=("creep", "sensor_drift", "temperature"),
    experiment=(
        "Rest overnight, then cycle; rest for an hour without cycling, then cycle again: softening "
        "depends on the travel, creep and drift on time, heat on the duty."
    ),
    source="mullins1969; an open wrist-robot project: a first loop of 80 kPa, a second of 53.",
    needs=("contraction", "rest"),
    once=True,
    settled="cycles before the table are unknown; see the warnings for a drift",
    sensor="a load cell at a blocked length, over the first cycles",
    compensable=True,
)
