"""Slip: a clamp slips once.

A sleeve, a knot or a sensor's clamp moves under load by a fraction of a millimetre and holds again.
From then on the position reading is off by a constant; before, it is correct.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.fit.starting_values import step_starts

CAUSE = Cause(
    name="slip_step",
    title="the step of a clamp that slipped",
    forms=(
        Form(
            "step",
            (
                Term("position.slip", (1e-4,), scale=1e-4),
                Term("position.slip_at", (100.0,), scale=0.1, amount=False),
            ),
            search=step_starts,
        ),
    ),
    signature="one step of the contraction within a second, absent in the pressure, then constant",
    neighbours=("sensor_bias", "sensor_drift", "creep"),
    experiment=(
        "Compare the zero before and after, and repeat the segment of the step: a step stays and "
        "does not recur, a drift continues."
    ),
    source="Assumed: usual behaviour of clamps and sleeves; no published value.",
    needs=("contraction",),
    once=True,
    sensor="a second position sensor on the other side of the clamp",
    # not compensable: it happened once; the plant cannot predict the next slip
)
