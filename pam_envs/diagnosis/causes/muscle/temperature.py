"""Temperature: the force of the muscle depends on its temperature.

The stiffness of rubber is proportional to absolute temperature, its losses and the friction of the
braid decrease with temperature, and cycling heats the muscle. The effective pressure changes by a
fixed share per kelvin away from 20 degrees Celsius.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="temperature",
    title="the effect of temperature",
    forms=(Form("gain", (Term("muscle.temperature_gain", (0.002, -0.002), scale=0.001),)),),
    signature="the error of the contraction is proportional to temperature times pressure",
    neighbours=("creep", "sensor_drift", "first_cycle_softening", "load_dependent_compliance"),
    experiment=(
        "Repeat a staircase while the muscle is warmed, and again when it has cooled: only "
        "heat returns to the same curve; without warming, rest as long instead of cycling."
    ),
    source="treloar1975 for the modulus of rubber; the size for a muscle is assumed.",
    needs=("contraction", "temperature"),
    settled="no temperature was recorded",
    sensor="a thermocouple on the muscle",
    compensable=True,
)
