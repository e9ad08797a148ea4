"""Length-driven friction: strands slide when the length changes, not the pressure.

Threads of the braid slide on one another as the muscle contracts. In a hysteresis of the pressure
they slide even in a blocked muscle, where they are in fact at rest. The plant has four Maxwell
elements in the length, which break away one after the other and act against the motion. In the
second form one element yields smoothly (Bouc and Wen), so that its minor loops do not close.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="hysteresis_drive",
    title="friction that is driven by length",
    forms=(
        Form(
            "strands",
            (
                *(Term(f"muscle.strand_{k}", (0.5, 2.0), scale=1.0) for k in (1, 2, 3, 4)),
                Term("muscle.strand_break", (0.02,), log=True, amount=False, prior=1.5),
                Term("muscle.strand_per_pressure", (0.0,), scale=1e-6, amount=False, prior=8.0),
            ),
        ),
        Form(
            "yielding",
            (
                Term("muscle.yield_force", (3.0,), scale=1.0),
                Term("muscle.yield_per_pressure", (0.0,), scale=1e-5, amount=False),
                Term("muscle.yield_break", (0.01, 0.03), log=True, amount=False),
                Term("muscle.yield_ratio", (0.5,), scale=0.3, amount=False),
                Term("muscle.yield_tail", (0.0,), scale=0.3, amount=False, prior=1.5),
            ),
        ),
    ),
    signature=(
        "the error has the sign of the direction and depends on the distance in length, not in "
        "pressure, since the reversal; it is present when a load changes at constant pressure"
    ),
    neighbours=(
        "hysteresis_shape",
        "pressure_dependent_friction",
        "load_dependent_hysteresis",
        "stick_slip",
        "viscous_loss",
    ),
    experiment=(
        "Ramp the pressure at a blocked length and under a constant load: friction driven by "
        "length vanishes at the blocked length. Without a clamp: small triangles at two pressures "
        "and two loads."
    ),
    source=(
        "Public isometric pulse tests of 10 and 20 mm Festo muscles: hardly any loop at full "
        "length, 6 to 13 N at 4 to 9 % contraction; vominh2011: Maxwell-slip elements in length."
    ),
    needs=("contraction",),
    settled="whole cycles do not separate length-driven from pressure-driven friction",
    sensor="a load cell at a blocked length",
    compensable=True,
    common=True,
    by_nature=True,
    lawlike=True,
)
