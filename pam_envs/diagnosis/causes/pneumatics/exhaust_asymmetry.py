"""Exhaust asymmetry: the muscle exhausts at another rate than it fills.

Filling is driven by the supply, exhausting by the muscle's own pressure, through another edge of
the valve and a silencer. The lag may differ, or the flow may be choked, so that the absolute
pressure falls by at most a fixed share per second.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="exhaust_asymmetry",
    title="an exhaust unlike filling",
    forms=(
        Form(
            "lag",
            (
                Term("regulator.exhaust_ratio", (1.2, 2.0), log=True),
                Term("regulator.exhaust_taper", (0.3,), scale=0.5, amount=False),
            ),
        ),
        Form(
            "choked",
            (Term("regulator.exhaust_rate", (1.5, 5.0), low=0.2, high=99.0, log=True),),
        ),
    ),
    signature=(
        "downward steps are late or early in the pressure, upward ones the opposite or neither"
    ),
    neighbours=("dead_time", "slew_limit", "supply_droop", "creep"),
    experiment=(
        "Steps of several sizes up and down between the same levels, against the measured "
        "pressure: dead time and a rate limit act in both directions, a drooping supply only "
        "upwards, creep not in the pressure."
    ),
    source=(
        "A public record of a DMSP-10-250: lags of 50 ms up and 84 ms down, 24 % of the way left "
        "after a second; an open wrist-robot project's ITV regulator, with the flow law of ISO "
        "6358."
    ),
    needs=("exhaust",),
    sensor="a fast pressure sensor at the muscle",
    compensable=True,
)
