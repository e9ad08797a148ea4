"""Where each number of the single muscle stands in its rows.

A plant's numbers are rows of a matrix whose columns are environments (lanes): first the state,
then the parameters, then what memory needs. This page is the only one that counts.
"""

from __future__ import annotations

from pam_envs.pneumatics.regulator import DELAY_PERIODS

# state
CONTRACTION, VELOCITY, PRESSURE, DRIVE, SET_POINT, LOAD, OLD_PRESSURE, OLD_AIR = range(8)
HISTORY = 8  # set-points of this and the last control periods, newest first
N_HISTORY = DELAY_PERIODS + 1
# drawn at reset
REST, TOLD_LOAD, CHANGE_TIME, CHANGE = range(HISTORY + N_HISTORY, HISTORY + N_HISTORY + 4)
N_STATE = HISTORY + N_HISTORY + 4

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
) = range(N_STATE, N_STATE + len(PARAMETERS))
# derived from them once
TALL, COSINE, LINEAR = range(N_STATE + len(PARAMETERS), N_STATE + len(PARAMETERS) + 3)
ELEMENTS = 8
THRESHOLD = LINEAR + 1
WEIGHT = THRESHOLD + ELEMENTS
END = WEIGHT + ELEMENTS
"""First row after the plant's state and parameters."""

N_PARAMETERS = END - N_STATE
DEPTH = 24
"""Depth of the Preisach stack of extrema."""

# integer rows
KEY_A, KEY_B, EPISODE, STEP, STACK_COUNT, MEMBER = range(6)
N_COUNTS = 6
