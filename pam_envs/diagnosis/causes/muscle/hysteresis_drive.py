"""What drives the hysteresis: strands rub when the length changes, not when the pressure does.

Threads of the braid slide on one another as the muscle shortens. A hysteresis of the pressure has
them slide in a blocked muscle too, where they stand still. In the plant four Maxwell elements in
the length, breaking loose one after the other, pull against the motion.
"""

from __future__ import annotations

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="hysteresis_drive",
    title="friction that is driven by length",
    forms=(
        Form(
            "strands",
            (
                *(Term(f"muscle.strand_{k}", (0.5, 2.0), scale=1.0) for k in (1, 2, 3, 4)),
                Term("muscle.strand_break", (0.02,), log=True, amount=False),
            ),
        ),
    ),
    signature=(
        "the error has the sign of the direction and depends on how far the length, not the "
        "pressure, has gone since the reversal; it differs between loads and is there when a load "
        "is changed at constant pressure"
    ),
    neighbours=(
        "hysteresis_shape",
        "pressure_dependent_friction",
        "load_dependent_hysteresis",
        "stick_slip",
        "viscous_loss",
    ),
    experiment=(
        "Ramp the pressure at a blocked length, and the same ramp under a constant load: friction "
        "that length drives vanishes in the first. Without a clamp, small triangles at low and at "
        "high pressure under two loads."
    ),
    source=(
        "Public isometric pulse tests of 10 and 20 mm Festo muscles: hardly any loop at full "
        "length, 6 to 13 N at 4 to 9 % contraction whatever the force; Vo-Minh et al. 2011, "
        "IEEE/ASME Transactions on Mechatronics 16(1): Maxwell-slip elements in the length."
    ),
    needs=("contraction",),
    settled="whole cycles do not separate length-driven from pressure-driven friction",
    sensor="a load cell at a blocked length",
    compensable=True,
)
