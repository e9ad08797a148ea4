"""Error of the payload: something hangs beside the load that is told.

A tray, a hook or a forgotten weight pulls and is accelerated with every load. Where nothing hangs
there is no tray, so that the unloaded curve fits. It takes loads that are declared to a tolerance:
what surely lies beyond it is an error of the payload, what lies within is refitted.
"""

from __future__ import annotations

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="payload_error",
    title="an error of the payload",
    forms=(Form("tray", (Term("mass.load_error", (0.1, -0.1), scale=0.05),)),),
    signature=(
        "every loaded segment is off by the effect of one further weight, which is the same at all "
        "loads; segments without a load fit"
    ),
    neighbours=("load_dependent_compliance",),
    experiment=(
        "The same slow triangle under five loads, one of them none: a tray shifts all loads by one "
        "weight and spares the empty hook, compliance grows with the load. Or weigh what hangs."
    ),
    source=(
        "Assumed: trays and hooks of rigs weigh up to a few hundred grams; it is told from a gain "
        "of the static map by changing the mass."
    ),
    needs=("contraction", "loads", "weighed"),
    settled="needs loads declared with a tolerance",
    sensor="scales",
    compensable=True,
)
