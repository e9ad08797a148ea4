"""Load-dependent compliance: the static curve shifts or rotates with the load.

In the law of the base a load takes a proportional share of the force. A real muscle has necked ends
and compliant fittings, so that a load costs more pressure (a shift with its square) or acts on
another stiffness (passive force times a polynomial in the root of the load).
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="load_dependent_compliance",
    title="compliance that changes with load",
    forms=(
        Form("shift", (Term("muscle.load_curve", (2.0, -2.0), scale=2.0),)),
        Form(
            "stiffening",
            (
                Term("muscle.load_stiffening", (5e-4, -5e-4), scale=5e-4),
                Term("muscle.load_stiffening_2", (1e-6,), scale=1e-5),
                Term("muscle.load_stiffening_root", (1e-4,), scale=5e-3),
            ),
        ),
    ),
    signature=(
        "a smooth function of pressure that differs between loads, independent of direction and "
        "time; with the base refitted, of opposite signs at the middle load and at the outer ones"
    ),
    neighbours=(
        "payload_error",
        "load_dependent_hysteresis",
        "wire_slack",
        "temperature",
        "static_law",
    ),
    experiment=(
        "The same slow triangle under five loads, one of them none: a wrong load shifts all loads "
        "by one amount, slack ends at a certain contraction, the effect of compliance is "
        "nonlinear in the load. Three loads cannot separate a square law from a dead zone."
    ),
    source=(
        "positioning2021, Tables 3 to 5: the load enters as a shift of the pressure, 0.079 bar "
        "per kilogram, growing faster than in proportion."
    ),
    needs=("contraction", "loads"),
    sensor="a load cell between muscle and load",
    compensable=True,
    lawlike=True,
)
