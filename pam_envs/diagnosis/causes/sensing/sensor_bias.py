"""Sensor bias: a reading is off by a constant.

The zero of an amplifier, or a muscle that was not at rest when the sensor was zeroed, shifts every
reading by the same amount at all pressures and loads. An amplifier that was just switched on needs
some seconds to reach its bias. Only the reading is affected.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term


def _warming_up(name: str, sensor: str, size: float) -> Form:
    end = Term(f"{sensor}.drift_time", (2.0,), low=1.0, high=8.0, log=True, amount=False)
    return Form(name, (Term(f"{sensor}.drift", (size,), scale=size), end))


CAUSE = Cause(
    name="sensor_bias",
    title="a bias of the sensors",
    forms=(
        Form(
            "both",
            (
                Term("position.bias", (1e-4,), scale=1e-4),
                Term("pressure.bias", (1e3,), scale=1e3),
            ),
        ),
        _warming_up("warming up", "position", 1e-4),
        _warming_up("warming up, pressure", "pressure", 1e3),
    ),
    signature="the same error at all times, at rest without pressure too",
    neighbours=(
        "sensor_drift",
        "sensor_nonlinearity",
        "slip_step",
        "creep",
        "threshold_pressure",
        "pressure_dependent_friction",
    ),
    experiment=(
        "Rest without pressure at the start and at the end: a bias is equal both times, a drift "
        "and a slip appear later, a threshold and a nonlinear sensor only under pressure."
    ),
    source="A public record of a DMSP-10-250: the pressure reads 0.3 bar off at rest.",
    settled="contractions count from each load's own rest length: a bias is gone",
    sensor="zeroing the sensors at rest without pressure",
    # not compensable: the loop follows the reading
)
