"""Slack wire: the load rests on its support until the wire is tight.

With a load on a support or a sagging wire the muscle first contracts as if unloaded. It lifts the
load only after some contraction, at once or as the wire straightens, and from there the curve is
that of the load.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="wire_slack",
    title="the slack of the wire",
    forms=(
        Form(
            "unilateral",
            (
                Term("mass.slack", (2e-4, 5e-4, 1.2e-3, 3e-3, 6e-3), scale=1e-4),
                Term("mass.slack_free", (0.3,), scale=0.2, amount=False),
            ),
        ),
        Form(
            "sagging",
            (
                Term("mass.slack", (2e-4, 6e-4, 2e-3), scale=1e-4),
                Term("mass.slack_sag", (0.6,), scale=0.3, amount=False),
            ),
        ),
    ),
    signature="a steep rise, then a pause until the load is lifted, longer under larger loads",
    neighbours=("threshold_pressure", "load_dependent_compliance", "static_law"),
    experiment=(
        "Slow ramps from rest under no load and two others, and once with a tight wire: only "
        "slack disappears; a threshold is also present without a load."
    ),
    source="Public isometric tests of 10 mm Festo muscles; sizes are assumed.",
    needs=("contraction", "loads"),
    settled="the static law absorbs it at a constant load",
    sensor="a load cell between muscle and load",
    compensable=True,
)
