"""Softening over the first cycles: a rested muscle is stiffer and rubs more.

Filled rubber loses part of its stiffness when it is first stretched (Mullins) and gets it back in a
long rest; strands that have stuck together come loose. The first travel of the pressure is
therefore made with wider loops and less effective pressure, and both fade with the travel.
"""

from __future__ import annotations

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="first_cycle_softening",
    title="softening over the first cycles",
    forms=(
        Form(
            "width and loss",
            (
                Term("hysteresis.first_width", (0.1,), scale=0.1),
                Term("hysteresis.first_loss", (0.01,), scale=0.01),
                Term("hysteresis.first_travel", (1e6, 6e6), log=True, amount=False),
            ),
        ),
    ),
    signature=(
        "the first cycles contract less and lie further open than later ones; the error fades with "
        "the travel made, not with time"
    ),
    neighbours=("creep", "sensor_drift", "temperature"),
    experiment=(
        "Rest overnight, then cycle; rest for an hour without cycling, then cycle again: softening "
        "waits for the travel, creep and a drift do not, heat follows the duty."
    ),
    source=(
        "Mullins 1969, Rubber Chemistry and Technology 42; an open wrist-robot project: loops of "
        "80 kPa in the first cycle, 53 kPa in the second."
    ),
    needs=("contraction", "rest"),
    once=True,
    settled="cycles before the table are unknown; see the warnings for a drift",
    sensor="a load cell at a blocked length, over the first cycles",
    compensable=True,
)
