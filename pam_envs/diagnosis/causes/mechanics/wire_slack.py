"""Slack wire: the load rests on its support until the wire is tight.

With a load on a support or a sagging wire the muscle first contracts as if unloaded. It lifts the
load only after some contraction, and from there the curve is that of the load.
"""

from __future__ import annotations

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="wire_slack",
    title="the slack of the wire",
    forms=(Form("unilateral", (Term("mass.slack", (2e-4, 5e-4, 1.2e-3), scale=1e-4),)),),
    signature=(
        "near rest the contraction rises early and steeply, then pauses until the load is "
        "lifted; the pause is longer under larger loads and absent without one"
    ),
    neighbours=("threshold_pressure", "load_dependent_compliance"),
    experiment=(
        "Slow ramps from rest under no load and two others, and once with a tight wire: only "
        "slack disappears; a threshold is also present without a load."
    ),
    source=(
        "Public isometric pulse tests of 10 mm Festo muscles, where slack adds to the pressure at "
        "which a pull begins; sizes are assumed."
    ),
    needs=("contraction", "loads"),
    settled="the static law absorbs it at a constant load",
    sensor="a load cell between muscle and load",
    compensable=True,
)
