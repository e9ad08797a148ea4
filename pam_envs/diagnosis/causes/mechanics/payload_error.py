"""Error of the payload: an undeclared mass acts beside the declared load.

A tray, a hook or a forgotten weight adds force and inertia to every load; without a load there is
no tray, so that the unloaded curve fits. It is testable for loads with a declared tolerance: an
error significantly beyond the tolerance is an error of the payload, a smaller one is refitted.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="payload_error",
    title="an error of the payload",
    forms=(Form("tray", (Term("mass.load_error", (0.1, -0.1), scale=0.05),)),),
    signature=(
        "the error of one additional weight, equal at every load; segments without a load fit"
    ),
    neighbours=("load_dependent_compliance", "static_law"),
    experiment=(
        "The same slow triangle under five loads, one of them none: a tray adds one weight to all "
        "loads but not to the empty hook, compliance grows with the load. Or weigh the load."
    ),
    source="Assumed: trays and hooks of rigs weigh up to a few hundred grams.",
    needs=("contraction", "loads", "weighed"),
    settled="needs loads declared with a tolerance",
    sensor="scales",
    compensable=True,
)
