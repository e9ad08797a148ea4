"""Sensor nonlinearity: the reading deviates between the ends of its range.

Potentiometers, draw-wire sensors and bridges follow their calibration line at the ends and deviate
between them. The error is a parabola and an S that vanish at zero and at full scale. It is not
separable from a static law of the same curvature, unless that law acts at several loads. A
nonlinear pressure reading is not separable from a regulator whose pressure is not proportional to
its setpoint: the two differ only in the true pressure, and the static law absorbs that.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

TITLES = {"pressure": "the nonlinearity of the pressure sensor or of the regulator"}
"""Titles of the forms that cannot tell a sensor from a regulator."""

CAUSE = Cause(
    name="sensor_nonlinearity",
    title="the nonlinearity of a sensor",
    forms=tuple(
        Form(
            sensor,
            (
                Term(f"{sensor}.bow", (0.01, -0.01), scale=0.01),
                Term(f"{sensor}.wave", (0.01,), scale=0.01),
            ),
            title=TITLES.get(sensor, ""),
        )
        for sensor in ("position", "pressure")
    ),
    signature="a smooth function of the reading alone, whatever load, direction, rate and time",
    neighbours=("sensor_bias", "sensor_drift", "static_law"),
    experiment=(
        "Measure the same staircase against a second sensor or gauge blocks: only this "
        "separates a nonlinear position reading from the muscle's own curve, and a nonlinear "
        "pressure reading from a regulator with a nonlinear characteristic."
    ),
    source="Data sheets of proportional regulators: linearity within 1 % of full scale.",
    settled="the static law absorbs it exactly",
    sensor="a second sensor of another kind, or gauge blocks",
    # not compensable: the recording is read through the same sensor
    lawlike=True,
)
