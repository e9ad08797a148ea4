"""Dead time: the regulator responds late.

The command passes a bus, a converter and a pilot stage before the valve moves, and sound needs time
along the tube. The whole response is delayed, in pressure and contraction alike. A lag rounds the
corner of a step instead, so that the two are separable at a sufficient sampling rate.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="dead_time",
    title="the dead time of the regulator",
    forms=(Form("delay", (Term("regulator.dead_time", (0.01, 0.04), scale=0.01),)),),
    signature="one sharp peak at the start of a step, in pressure and contraction alike",
    neighbours=(
        "sensor_delay",
        "slew_limit",
        "valve_dead_band",
        "exhaust_asymmetry",
        "resonance",
    ),
    experiment=(
        "Steps of three sizes, up and down: dead time is the same for all of them, the delay of a "
        "rate limit grows with the size, a slow exhaust is late only downwards. A delayed "
        "position reading does not affect the pressure."
    ),
    source=(
        "A public record of a DMSP-10-250: 44 ms inflating, 96 ms deflating; an open wrist-robot "
        "project's identified ITV regulator: 5 to 105 ms over pressures."
    ),
    sensor="a fast pressure sensor at the valve's outlet",
    compensable=True,
)
