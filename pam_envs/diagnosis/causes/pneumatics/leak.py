"""Leak: air escapes downstream of the valve.

Fittings, bladder and valve seat leak, faster at higher pressure. With the valve open the regulator
compensates the leak at the price of a small error; with the valve closed nothing does. The plant
loses a fixed share of its gauge pressure per second.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="leak",
    title="a leak behind the valve",
    forms=(Form("exponential", (Term("regulator.leak", (0.01, 0.1), high=2.0, scale=0.005),)),),
    signature="with the valve closed pressure and contraction fall, faster from higher pressures",
    neighbours=("creep", "sensor_drift", "valve_dead_band"),
    experiment=(
        "Close the valve for half a minute at two pressures: only a leak reduces the pressure. "
        "With the valve open the muscle holds, while creep and drift continue."
    ),
    source=(
        "Public traces of a 20 mm muscle: time constants of 75 to 250 s, 5200 s on a tight rig."
    ),
    needs=("valve_closed",),
    sensor="a flow meter in the feed, read while the pressure is held",
    compensable=True,
)
