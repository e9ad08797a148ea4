"""Load-dependent hysteresis: the width of the loop depends on the load.

A load stretches the braid, changes its angle and the force between its strands, and thus the
friction. The plant scales the hysteretic part in proportion to the load.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="load_dependent_hysteresis",
    title="hysteresis that changes with load",
    forms=(Form("linear", (Term("hysteresis.width_per_load", (-0.01, 0.02), scale=0.01),)),),
    signature="the sign of the direction at small loads and the opposite one at large loads",
    neighbours=("load_dependent_compliance", "pressure_dependent_friction", "hysteresis_drive"),
    experiment=(
        "The same slow triangle under five loads: a changing width opens or closes the loop about "
        "its middle line, a changing compliance moves that line and masks the width until it is "
        "modelled."
    ),
    source="positioning2021, Tables 3 to 5: loops of 3.3, 2.8, 2.4 mm at 0, 2.55, 4.55 kg.",
    needs=("contraction", "loads"),
    sensor="a load cell between muscle and load",
    compensable=True,
    lawlike=True,
)
