"""Where each number of the single muscle stands in its rows.

A plant's numbers are rows of two matrices whose columns are environments (lanes): ``rows`` is the
state, followed by that of the memory, and ``fixed`` the parameters, which all tiles of a batch
share unless they are drawn. This page is the only one that counts.
"""

from __future__ import annotations

# state
CONTRACTION, VELOCITY, PRESSURE, DRIVE, SET_POINT, OLD_SET_POINT, LOAD, OLD_PRESSURE, OLD_AIR = (
    range(9)
)
# drawn at reset
REST, TOLD_LOAD, CHANGE_TIME, CHANGE = range(9, 13)
# set-points of the last control periods: that of period k stands in row HISTORY + k % N_HISTORY
HISTORY = 13
N_HISTORY = 16  # a power of two
END = HISTORY + N_HISTORY
"""First row after the plant's state; the memory's state follows."""

# parameters, in the order of PARAMETERS below
PARAMETERS = (
    "regulator.max_pressure",
    "regulator.dead_time",
    "regulator.time_constant",
    "regulator.slew_rate",
    "muscle.rest_length",
    "muscle.diameter",
    "muscle.braid_angle",
    "muscle.area",
    "muscle.area_taper",
    "muscle.braid_force",
    "muscle.braid_strain",
    "muscle.stiffness",
    "muscle.hardening",
    "mass.load",
    "mass.moving_mass",
    "mass.damping",
    "position.noise",
    "position.resolution",
    "position.bias",
    "pressure.noise",
    "pressure.resolution",
    "pressure.bias",
    "memory.stretch",
    "memory.width_per_load",
)
(
    MAX_PRESSURE,
    DEAD_TIME,
    TIME_CONSTANT,
    SLEW_RATE,
    REST_LENGTH,
    DIAMETER,
    BRAID_ANGLE,
    AREA,
    AREA_TAPER,
    BRAID_FORCE,
    BRAID_STRAIN,
    STIFFNESS,
    HARDENING,
    NOMINAL_LOAD,
    MOVING_MASS,
    DAMPING,
    POSITION_NOISE,
    POSITION_RESOLUTION,
    POSITION_BIAS,
    PRESSURE_NOISE,
    PRESSURE_RESOLUTION,
    PRESSURE_BIAS,
    STRETCH,
    WIDTH_PER_LOAD,
) = range(len(PARAMETERS))
# derived from them once
TALL, COSINE, LINEAR = range(len(PARAMETERS), len(PARAMETERS) + 3)
ELEMENTS = 8
THRESHOLD = LINEAR + 1
WEIGHT = THRESHOLD + ELEMENTS
N_PARAMETERS = WEIGHT + ELEMENTS

DEPTH = 24
"""Depth of the Preisach stack of extrema."""

# integer rows
KEY_A, KEY_B, EPISODE, STEP, STACK_COUNT, MEMBER = range(6)
N_COUNTS = 6
