"""Nonlinear sensor: the reading bows between its ends.

Potentiometers, strings on drums and bridges follow their calibration line at the ends and leave it
in between. The reading is a parabola that is right at zero and at full scale. It cannot be told
from a static law that bends the same way, unless that law acts at several loads.
"""

from __future__ import annotations

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="sensor_nonlinearity",
    title="the nonlinearity of a sensor",
    forms=(
        Form("position", (Term("position.bow", (0.01, -0.01), scale=0.01),)),
        Form("pressure", (Term("pressure.bow", (0.01, -0.01), scale=0.01),)),
    ),
    signature=(
        "a smooth function of the reading alone, whatever load, direction, rate or time; for the "
        "pressure, settled readings that miss the command by a bow"
    ),
    neighbours=("sensor_bias", "sensor_drift"),
    experiment=(
        "Measure the same staircase against a second sensor or gauge blocks: only that tells a "
        "bowed position reading from the muscle's own curve. A bowed pressure reading shows "
        "against the command."
    ),
    source=(
        "Data sheets of proportional regulators with sensors of their own: linearity within 1 % of "
        "full scale."
    ),
    settled="the static law absorbs it exactly",
    sensor="a second sensor of another kind, or gauge blocks",
    # not compensable: the recording is read through the same sensor
)
