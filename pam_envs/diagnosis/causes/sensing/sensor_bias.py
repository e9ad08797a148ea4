"""Sensor bias: a reading is off by a constant.

The zero of an amplifier, or a muscle that was not at rest when the sensor was zeroed, shifts every
reading by the same amount at all pressures and loads. An amplifier that was just switched on, or
whose supply changes, reaches its bias within 40 s; a slower change is a drift. Only the reading is
affected.
"""

from collections.abc import Callable

from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.fit.starting_values import Starts, changes_of

LONGEST = 40.0
"""Time [s] within which a reading reaches its bias."""


def _warming_up(name: str, sensor: str, size: float) -> Form:
    end = Term(f"{sensor}.drift_time", (2.0, 20.0), low=1.0, high=LONGEST, log=True, amount=False)
    return Form(name, (Term(f"{sensor}.drift", (size,), scale=size), end))


def _appearing(name: str, sensor: str, size: float, search: Callable[..., Starts]) -> Form:
    middle = Term(f"{sensor}.ramp_at", (100.0,), scale=2.0, amount=False)
    end = Term(f"{sensor}.ramp_over", (5.0,), low=1.0, high=LONGEST, log=True, amount=False)
    return Form(name, (Term(f"{sensor}.ramp", (size,), scale=size), middle, end), search)


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
        _appearing("appearing", "position", 1e-4, changes_of(0, (4.0, 25.0))),
        _appearing("appearing, pressure", "pressure", 1e3, changes_of(1, (4.0, 25.0))),
    ),
    contains=("slip_step",),
    signature="the same error at all times from a moment on, at rest without pressure too",
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
