"""Catalogue of hidden effects.

None is the equation of the candidate that a diagnosis would explain it with:

=========================== ================================== ==================================
effect                      here, in the rig                   the candidate's form
=========================== ================================== ==================================
creep                       power law or log of time, 12 paces four Kelvin-Voigt elements
leak                        orifice, choked above 0.9 bar      exponential decay
valve_dead_band             overlapping spool: rounded onset   dead zone, or comparator that
                            and slope beyond, leaking overlap  opens and closes
dead_time                   four to six short lags             fractional delay of the command
slew_limit                  coil that saturates as tanh, or    sharp limit, blended with a soft
                            bent slope, unequal by direction   minimum of power two
sensor_bias                 offset along a parabola, over 5 s  constant, or an exponential
sensor_drift                hyperbola or sigmoid of time       exponential, smooth step or line
sensor_delay                cascade of lags or running mean    pure delay of the reading
viscous_loss                Eyring: arsinh of the speed        damping that falls as 1 over a root
temperature                 Arrhenius                          gain linear in temperature
first_cycle_softening       root exponential or power of the   exponential of the travel of the
                            travel of the length               pressure
load_dependent_hysteresis   load to the power 3/2, or inverse  linear in the load
load_dependent_compliance   stiffness by a power of the load   square shift of the pressure, or
                                                               stiffness by a polynomial
hysteresis_shape            tanh or sinh of the friction       friction over a linear form of it
hysteresis_drive            24 sliders dragged by the length   four elements with fixed ratios
supply_droop                air balances of reservoir and      pressure that falls with what was
                            swelling muscle, ISO 6358 flows    filled and returns exponentially;
                            to both, hard limit of opening     soft minimum of power two
stick_slip                  bristles (LuGre), Lorentzian       breakaway held exactly, caught at
                            Stribeck curve                     zero speed, exponential curve
threshold_pressure          softplus                           hard threshold
exhaust_asymmetry           slowed by the absolute pressure    another lag, or choked decay
pressure_dependent_friction saturating exponential, in exp     stretched scale, or a parabola
sensor_nonlinearity         sine or arctangent                 parabola
resonance                   travelling waves in a closed tube; one mode of second order, of the
                            two modes of bracket and foot       line or of the mount
slip_step                   sigmoid or exponential in time     straight ramp
wire_slack                  stretched exponential of the       straight ramp of the position
                            strain
payload_error               scales wrong by a factor, tray on  constant extra mass wherever the
                            a soft rest, rub of its guide      declared load is above zero
=========================== ================================== ==================================
"""

from __future__ import annotations

import numpy as np

from .base import Base
from .effect import Effect
from .effects import CATALOGUE
from .effects_unknown import FINAL, TUNING

EFFECTS, TUNING_UNKNOWN, FINAL_UNKNOWN = tuple(CATALOGUE), tuple(TUNING), tuple(FINAL)
_KINDS = {**CATALOGUE, **TUNING, **FINAL}


def draw_effect(name: str, rng: np.random.Generator) -> Effect:
    """Draw the shape of the effect called `name`."""
    if name not in _KINDS:
        raise ValueError(f"no effect is called {name!r}; there are {', '.join(_KINDS)}")
    return _KINDS[name].effect(name, rng)


def constants(base: Base, effects: list[tuple[Effect, float]], duration: float) -> np.ndarray:
    """Return the record of a rig with its effects, each with an amplitude, shape (1,).

    The time of a slip is a share of the duration of the run [s].
    """
    record = base.parameters()
    for effect, amplitude in effects:
        effect.enter(record, amplitude)
    record["slip_time"] *= duration
    return record
