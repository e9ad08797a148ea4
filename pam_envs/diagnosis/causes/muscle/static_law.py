"""Static law: the force at rest depends on pressure and length in another form.

Every muscle has its own map of force over pressure and length, from its geometry, fittings and
bladder. The base fits the coefficients of one form. This cause adds the products of polynomials
that the form lacks, as a smooth correction of the force.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.muscle.effective_area import MAP_SIZES

CAUSE = Cause(
    name="static_law",
    title="another shape of the force law",
    forms=(
        Form(
            "map",
            tuple(Term(f"muscle.{name}", (0.5,), scale=2.0, prior=10.0) for name in MAP_SIZES),
        ),
    ),
    signature="a smooth function of pressure and contraction, independent of direction and time",
    neighbours=(
        "load_dependent_compliance",
        "sensor_nonlinearity",
        "threshold_pressure",
        "wire_slack",
        "payload_error",
    ),
    contains=("load_dependent_compliance", "sensor_nonlinearity", "payload_error"),
    experiment=(
        "A slow triangle of the pressure under each of five loads: another law gives one map of "
        "force over pressure and contraction for all of them."
    ),
    source="martens2017: force maps of Festo muscles, which published laws miss by 10 to 50 N.",
    needs=("contraction",),
    settled="the table's own law is fitted to the readings",
    sensor="a load cell at blocked lengths",
    compensable=True,
    common=True,
    by_nature=True,
    lawlike=True,
)
