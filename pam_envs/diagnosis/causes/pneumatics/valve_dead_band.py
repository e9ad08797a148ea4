"""Dead band: the valve does not respond to small errors.

Overlap of a spool, or the gap between the switching points of a comparator, keeps the pressure
constant until the error is large enough. Small commands have no effect, and after each step the
pressure stops short on the side that it came from. A spool passes the part of the error above the
overlap, and leaks within it. A switching valve may stay open until the error is smaller: the second
parameter is the error at which it closes over that at which it opens.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.fit.starting_values import grid

_OPENS = (1.5e3, 3e3, 4.5e3, 6e3, 7.5e3, 9.5e3, 1.2e4, 1.5e4, 2e4, 3e4, 4.5e4)
_CLOSES = (0.2, 0.45, 0.7)

CAUSE = Cause(
    name="valve_dead_band",
    title="a dead band of the valve",
    forms=(
        Form("dead zone", (Term("regulator.dead_band", (3e3, 1e4, 3e4), scale=2e3),)),
        Form(
            "overlap",
            (
                Term("regulator.overlap", (3e3, 1e4, 2e4, 4e4), scale=2e3),
                Term("regulator.overlap_leak", (0.01,), log=True, amount=False),
            ),
        ),
        Form(
            "comparator",
            (
                Term("regulator.dead_band", (6e3,), scale=4e3),
                Term("regulator.dead_close", (0.3,), scale=0.5, amount=False),
            ),
            search=grid(_OPENS, _CLOSES),
        ),
    ),
    signature="settled pressures miss the command by one amount, with the sign of the last step",
    neighbours=("leak", "dead_time", "stick_slip", "threshold_pressure"),
    experiment=(
        "Sines of the command at 1 Hz with decreasing amplitudes, and an approach to one level "
        "from both sides: the dead band shows in the measured pressure, stick-slip and a "
        "threshold only in the contraction, dead time equally at any amplitude."
    ),
    source=(
        "An open wrist-robot project's identified ITV regulator: overlap of 16 to 24 kPa, gain "
        "0.15 at 4 Hz and 40 kPa; data sheets of regulators: 0.1 to 0.5 % of full scale."
    ),
    sensor="a fast pressure sensor at the valve's outlet",
    compensable=True,
)
