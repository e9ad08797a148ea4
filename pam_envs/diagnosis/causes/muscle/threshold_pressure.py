"""Threshold pressure: the first part of the pressure has no effect.

The bladder must expand to the braid before it transmits force, and a slack or kinked muscle
straightens first. In the plant pressures below the threshold have no effect, and the threshold is
subtracted above it.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="threshold_pressure",
    title="the threshold pressure of the muscle",
    forms=(Form("hard", (Term("hysteresis.threshold", (5e3, 2e4, 5e4), scale=2e3),)),),
    signature="the contraction starts late, with a kink, at the same pressure under every load",
    neighbours=("sensor_bias", "wire_slack", "valve_dead_band", "static_law"),
    experiment=(
        "Slow ramps from rest, against the measured pressure and under several loads: slack "
        "changes with the load, a dead band is not in the pressure, a threshold is constant."
    ),
    source=(
        "Public isometric pulse tests of 10 mm Festo muscles: about 50 kPa at full length; "
        "martens2017: force maps that start at 135 kPa at 5 % contraction."
    ),
    needs=("contraction",),
    sensor="a load cell at a blocked length, at low pressure",
    compensable=True,
    lawlike=True,
)
