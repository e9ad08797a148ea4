"""Causes that the single muscle may lack, one a file."""

from __future__ import annotations

from collections.abc import Sequence

from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.causes.mechanics import payload_error, resonance, stick_slip, wire_slack
from pam_envs.diagnosis.causes.muscle import (
    creep,
    first_cycle_softening,
    hysteresis_drive,
    hysteresis_shape,
    load_dependent_compliance,
    load_dependent_hysteresis,
    pressure_dependent_friction,
    temperature,
    threshold_pressure,
    viscous_loss,
)
from pam_envs.diagnosis.causes.pneumatics import (
    dead_time,
    exhaust_asymmetry,
    leak,
    slew_limit,
    supply_droop,
    valve_dead_band,
)
from pam_envs.diagnosis.causes.sensing import (
    sensor_bias,
    sensor_delay,
    sensor_drift,
    sensor_nonlinearity,
    slip_step,
)
from pam_envs.wording import near

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
    raise ValueError(f"no cause named {name!r}{near(name, [c.name for c in catalogue()])}")


def chosen(given: Sequence[Cause | str] | None = None) -> tuple[Cause, ...]:
    """Return causes, those given by name from the catalogue; all of it where none are given.

    Raises
    ------
    ValueError
        If there are none, if a name is not known or comes twice.
    TypeError
        If something is neither a cause nor a name.
    """
    if given is None:
        return catalogue()
    if isinstance(given, str):
        raise TypeError(f"causes is {given!r}; give a list of causes or names")
    made: list[Cause] = []
    for one in given:
        cause = by_name(one) if isinstance(one, str) else one
        if not isinstance(cause, Cause):
            raise TypeError(f"causes holds {one!r}; give a Cause or the name of one")
        if cause.name in {c.name for c in made}:
            raise ValueError(f"causes holds {cause.name!r} twice; give each once")
        made.append(cause)
    if not made:
        raise ValueError("causes is empty; name at least one, or leave it out for the catalogue")
    return tuple(made)
