"""Leak: air escapes behind the valve.

Fittings, the bladder and the valve's seat let air out, the faster the higher the pressure. While
the valve is open the regulator makes up for it, at the price of a small error; while it is shut
nothing does. The plant loses a fixed share of its gauge pressure a second.
"""

from __future__ import annotations

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="leak",
    title="a leak behind the valve",
    forms=(Form("exponential", (Term("regulator.leak", (0.01,), high=2.0, scale=0.005),)),),
    signature=(
        "with the valve shut the pressure falls, always downwards and faster from higher "
        "pressures, and the contraction with it"
    ),
    neighbours=("creep", "sensor_drift", "valve_dead_band"),
    experiment=(
        "Shut the valve for half a minute at two pressures: only a leak takes the pressure down. "
        "With the valve open the same muscle holds, while creep and a drift go on."
    ),
    source=(
        "Public fill and leak traces of a 20 mm muscle: time constants of 75 to 250 s, 5200 s on "
        "one tight rig."
    ),
    needs=("valve_closed",),
    sensor="a flow meter in the feed, read while the pressure is held",
    compensable=True,
)
