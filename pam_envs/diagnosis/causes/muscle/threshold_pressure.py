"""Threshold pressure: the first part of the pressure does nothing.

The bladder has to be blown up until it meets the braid before any pull passes on, and a slack or
kinked muscle straightens first. In the plant pressures below the threshold are not felt, and the
rest counts from there.
"""

from __future__ import annotations

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="threshold_pressure",
    title="the threshold pressure of the muscle",
    forms=(Form("hard", (Term("hysteresis.threshold", (5e3,), scale=2e3),)),),
    signature=(
        "at low pressures the contraction starts late, with a kink, at the same pressure under "
        "every load; above it the curve fits"
    ),
    neighbours=("sensor_bias", "wire_slack", "valve_dead_band"),
    experiment=(
        "Slow ramps from rest, against the measured pressure and under several loads: slack moves "
        "with the load, a valve's dead band is not there in the measured pressure, a threshold "
        "stays."
    ),
    source=(
        "Public isometric pulse tests of 10 mm Festo muscles: about 50 kPa at full length; Martens "
        "and Boblan 2017, Actuators 6(4), 33: force maps of 10 and 20 mm muscles, which start at "
        "135 kPa at 5 % contraction."
    ),
    needs=("contraction",),
    sensor="a load cell at a blocked length, at low pressure",
    compensable=True,
)
