"""Sensor delay: the position reading is late.

Filters of an amplifier, averaging over samples and a bus delay the reading, not the motion. The
pressure reading shows the true time.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="sensor_delay",
    title="the delay of the position sensor",
    forms=(Form("delay", (Term("position.delay", (0.02, 0.06), scale=0.01),)),),
    signature="the error is that of the same delay at every speed; the pressure fits",
    neighbours=("dead_time", "viscous_loss"),
    experiment=(
        "A sine at 0.2, 0.5, 1 and 2 Hz: a delay shifts all by one time without attenuation, a "
        "loss attenuates them and shifts the slow ones more; dead time is also in the pressure."
    ),
    source="An open wrist-robot project: readings 15 to 25 ms behind a simulation.",
    needs=("contraction",),
    sensor="an accelerometer on the load, or a camera",
    compensable=True,
)
