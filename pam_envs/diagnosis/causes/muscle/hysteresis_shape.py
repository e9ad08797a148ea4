"""Shape of the hysteresis: minor loops rub otherwise than the major one.

A hysteresis made of plays ties inner loops to the outer one (congruence), and a spread of
thresholds that fits the outer loop may be wrong for small reversals, since strands that have slid
far have settled otherwise than those that just turned. In the plant friction below its largest
value is weakened or strengthened by the part that is missing to it.
"""

from __future__ import annotations

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="hysteresis_shape",
    title="the shape of minor loops",
    forms=(Form("inner loops", (Term("hysteresis.shape", (2.0, 0.5), log=True),)),),
    signature=(
        "the error begins at reversals and has gone when the loop is fully slipped: large loops "
        "fit, small reversals are off"
    ),
    neighbours=("hysteresis_drive", "pressure_dependent_friction", "stick_slip"),
    experiment=(
        "Small triangles about half the pressure after a full cycle, once more after a small one, "
        "and again at another pressure: the shape depends on the distance from the reversal alone, "
        "friction that goes with pressure on the level."
    ),
    source=(
        "A public record of a DMSP-10-250 on a pressure regulator: plays fitted to the major loop "
        "to 0.6 % miss random holds by 2.8 %, refitted on the holds by 1.1 %."
    ),
    needs=("contraction",),
    settled="whole cycles hold no minor loops",
    sensor="a load cell at a blocked length, for the part that length does not drive",
    compensable=True,
)
