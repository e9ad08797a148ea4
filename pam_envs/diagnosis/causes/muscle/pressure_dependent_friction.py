"""Pressure-dependent friction: the loop is wider at one end of the pressure range.

The pressure, reduced by the effect of the load, presses the threads of the braid together, so that
their friction grows with it. In the plant the hysteresis acts on a stretched pressure scale with
uniform friction, so that the width of the loop changes along the range.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="pressure_dependent_friction",
    title="friction that changes with pressure",
    forms=(
        Form("stretch", (Term("hysteresis.stretch", (0.1, -0.1), scale=0.05),)),
        Form(
            "factor",
            (
                Term("hysteresis.pressure_slope", (0.5, -0.3), scale=0.3),
                Term("hysteresis.pressure_bend", (-0.1, 0.1), scale=0.3),
            ),
        ),
    ),
    signature="the sign of the direction at low pressures and the opposite one at high pressures",
    neighbours=("hysteresis_drive", "hysteresis_shape", "load_dependent_hysteresis", "sensor_bias"),
    experiment=(
        "Small loops of the same size at three mean pressures, under two loads: "
        "pressure-dependent friction changes the width with pressure at either load, "
        "load-dependent friction with load at every pressure, a wrong shape of minor loops "
        "changes neither."
    ),
    source=(
        "tondu2000: friction between threads is proportional to the force between them; an open "
        "wrist-robot project: 0.5 N and 15 N/MPa; least squares on positioning2021."
    ),
    needs=("contraction",),
    sensor="a load cell between muscle and load",
    compensable=True,
    common=True,
    lawlike=True,
)
