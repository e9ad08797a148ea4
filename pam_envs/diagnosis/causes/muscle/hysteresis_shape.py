"""Shape of minor loops: friction in minor loops differs from that of the major loop.

A hysteresis of play operators relates minor loops to the major one (congruence), and thresholds
that fit the major loop may be wrong for small reversals, since strands that have slid far settle
differently from those that have just reversed. The plant weakens or strengthens friction below its
largest value by the difference to that value.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="hysteresis_shape",
    title="the shape of minor loops",
    forms=(Form("inner loops", (Term("hysteresis.shape", (2.0, 0.5), log=True),)),),
    signature="the error starts at reversals and vanishes at full slip: only large loops fit",
    neighbours=("hysteresis_drive", "pressure_dependent_friction", "stick_slip"),
    experiment=(
        "Small triangles about half the pressure after a full cycle, once more after a small one, "
        "and again at another pressure: the shape depends on the distance from the reversal alone, "
        "friction that goes with pressure on the level."
    ),
    source=(
        "A public record of a DMSP-10-250: plays that fit the major loop to 0.6 % miss random "
        "holds by 2.8 %, refitted on the holds by 1.1 %."
    ),
    needs=("contraction",),
    settled="whole cycles hold no minor loops",
    sensor="a load cell at a blocked length, for the part that length does not drive",
    compensable=True,
)
