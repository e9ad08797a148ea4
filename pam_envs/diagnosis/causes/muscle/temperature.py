"""Temperature: a warm muscle pulls otherwise.

Rubber's stiffness goes with the absolute temperature, its losses and the braid's friction fall as
it warms, and cycling heats the muscle by itself. The effective pressure gains a fixed share with
each kelvin away from 20 degrees Celsius.
"""

from __future__ import annotations

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="temperature",
    title="the effect of temperature",
    forms=(Form("gain", (Term("muscle.temperature_gain", (0.002, -0.002), scale=0.001),)),),
    signature=(
        "the error of the contraction goes with temperature times pressure and is nothing at rest"
    ),
    neighbours=("creep", "sensor_drift", "first_cycle_softening", "load_dependent_compliance"),
    experiment=(
        "Repeat a staircase while the muscle is warmed, and again when it has cooled: only heat "
        "comes back to the same curve; without warming, rest instead of cycling for as long."
    ),
    source=(
        "Treloar, The Physics of Rubber Elasticity: a rubber's modulus goes with absolute "
        "temperature; no figure for a pneumatic muscle was found, the size is assumed."
    ),
    needs=("contraction", "temperature"),
    settled="no temperature was recorded",
    sensor="a thermocouple on the muscle",
    compensable=True,
)
