"""Every effect that can be hidden, by name."""

from __future__ import annotations

import numpy as np

from .base import Base
from .effect import Effect, Kind
from .effects_friction import FRICTION
from .effects_load import LOAD
from .effects_muscle import MUSCLE
from .effects_pneumatic import PNEUMATIC
from .effects_sensing import SENSING
from .effects_unknown import FINAL, TUNING

EFFECTS: tuple[str, ...] = (
    "creep",
    "leak",
    "valve_dead_band",
    "dead_time",
    "slew_limit",
    "sensor_bias",
    "sensor_drift",
    "sensor_delay",
    "viscous_loss",
    "temperature",
    "first_cycle_softening",
    "load_dependent_hysteresis",
    "load_dependent_compliance",
    "hysteresis_shape",
    "hysteresis_drive",
    "supply_droop",
    "stick_slip",
    "threshold_pressure",
    "exhaust_asymmetry",
    "pressure_dependent_friction",
    "sensor_nonlinearity",
    "resonance",
    "slip_step",
    "wire_slack",
    "payload_error",
)
TUNING_UNKNOWN: tuple[str, ...] = tuple(TUNING)
FINAL_UNKNOWN: tuple[str, ...] = tuple(FINAL)

_KINDS: dict[str, Kind] = {
    **PNEUMATIC,
    **FRICTION,
    **MUSCLE,
    **LOAD,
    **SENSING,
    **TUNING,
    **FINAL,
}


def draw_effect(name: str, rng: np.random.Generator) -> Effect:
    """Draw the shape of the effect called `name`."""
    if name not in _KINDS:
        raise ValueError(f"no effect is called {name!r}; there are {', '.join(_KINDS)}")
    return _KINDS[name].effect(name, rng)


def constants(base: Base, effects: list[tuple[Effect, float]], duration: float) -> np.ndarray:
    """Return the record of a rig with its effects, each with an amplitude, shape (1,).

    `duration` [s] is that of the run, which the moment of a slip is a share of.
    """
    record = base.parameters()
    for effect, amplitude in effects:
        strength = effect.strength(amplitude)
        if strength > 0.0:
            _KINDS[effect.name].write(record, strength, dict(effect.shape))
    record["slip_time"] *= duration
    return record
