"""Causes that the single muscle may lack, one a file."""

from __future__ import annotations

from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.causes import (
    creep,
    dead_time,
    exhaust_asymmetry,
    first_cycle_softening,
    hysteresis_drive,
    hysteresis_shape,
    leak,
    load_dependent_compliance,
    load_dependent_hysteresis,
    payload_error,
    pressure_dependent_friction,
    resonance,
    sensor_bias,
    sensor_delay,
    sensor_drift,
    sensor_nonlinearity,
    slew_limit,
    slip_step,
    stick_slip,
    supply_droop,
    temperature,
    threshold_pressure,
    valve_dead_band,
    viscous_loss,
    wire_slack,
)

_FILES = (
    creep,
    leak,
    valve_dead_band,
    dead_time,
    slew_limit,
    sensor_bias,
    sensor_drift,
    sensor_delay,
    viscous_loss,
    temperature,
    first_cycle_softening,
    load_dependent_hysteresis,
    load_dependent_compliance,
    hysteresis_shape,
    hysteresis_drive,
    supply_droop,
    stick_slip,
    threshold_pressure,
    exhaust_asymmetry,
    pressure_dependent_friction,
    sensor_nonlinearity,
    resonance,
    slip_step,
    wire_slack,
    payload_error,
)


def catalogue() -> tuple[Cause, ...]:
    """Return every cause; the order does not matter to a diagnosis."""
    return tuple(file.CAUSE for file in _FILES)


def by_name(name: str) -> Cause:
    """Return one cause of the catalogue.

    Raises
    ------
    ValueError
        If there is none of that name.
    """
    for cause in catalogue():
        if cause.name == name:
            return cause
    raise ValueError(
        f"no cause named {name!r}; there are: {', '.join(c.name for c in catalogue())}"
    )
