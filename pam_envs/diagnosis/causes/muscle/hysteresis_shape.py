"""Shape of minor loops: friction in minor loops differs from that of the major loop.

A hysteresis of play operators relates minor loops to the major one (congruence), and thresholds
that fit the major loop may be wrong for small reversals, since strands that have slid far settle
differently from those that have just reversed. In the plant, friction below its largest value is
scaled down or up with the distance from that value. In the second form a part of the friction
yields smoothly (Bouc and Wen): its minor loops are neither congruent nor closed.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="hysteresis_shape",
    title="the shape of minor loops",
    forms=(
        Form("inner loops", (Term("hysteresis.shape", (2.0, 0.5), log=True),)),
        Form(
            "yielding",
            (
                Term("hysteresis.yield_width", (3e3,), scale=1e3),
                Term("hysteresis.yield_break", (1e4, 4e4), log=True, amount=False),
                Term("hysteresis.yield_ratio", (0.5,), scale=0.3, amount=False),
                Term("hysteresis.yield_tail", (0.0,), scale=0.3, amount=False, prior=1.5),
            ),
        ),
    ),
    signature="the error starts at reversals and vanishes at full slip: only large loops fit",
    neighbours=("hysteresis_drive", "pressure_dependent_friction", "stick_slip"),
    experiment=(
        "Small triangles about half the pressure after a full cycle, once more after a small one, "
        "and again at another pressure: the effect of the shape depends only on the distance from "
        "the reversal, that of pressure-dependent friction on the pressure level."
    ),
    source=(
        "A public record of a DMSP-10-250: plays that fit the major loop to 0.6 % miss random "
        "holds by 2.8 %, refitted on the holds by 1.1 %."
    ),
    needs=("contraction",),
    settled="whole cycles hold no minor loops",
    sensor="a load cell at a blocked length, for the part that is not driven by length",
    compensable=True,
    common=True,
    by_nature=True,
    lawlike=True,
)
