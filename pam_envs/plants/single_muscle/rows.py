"""Where each number of the single muscle stands in its rows.

A plant's numbers are rows of two matrices whose columns are environments (lanes): ``rows`` is the
state, followed by that of the hysteresis, and ``fixed`` the parameters, which all tiles of a batch
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
"""First row after the plant's state; the hysteresis's state follows."""

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
    "hysteresis.stretch",
    "hysteresis.width_per_load",
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
ELEMENTS = 12
THRESHOLD = LINEAR + 1
WEIGHT = THRESHOLD + ELEMENTS

# parameters of effects that are off in a plain plant, in the order of EFFECTS below
EFFECTS = (
    "regulator.gain",
    "regulator.slew_bend",
    "regulator.dead_band",
    "regulator.dead_close",
    "regulator.overlap",
    "regulator.overlap_leak",
    "regulator.exhaust_ratio",
    "regulator.exhaust_taper",
    "regulator.exhaust_rate",
    "regulator.leak",
    "regulator.supply_pressure",
    "regulator.supply_droop",
    "regulator.supply_time",
    "regulator.supply_recovery",
    "regulator.ring_share",
    "regulator.ring_flow",
    "regulator.ring_frequency",
    "regulator.ring_damping",
    "hysteresis.shape",
    "hysteresis.pressure_slope",
    "hysteresis.pressure_bend",
    "hysteresis.creep_1",
    "hysteresis.creep_2",
    "hysteresis.creep_3",
    "hysteresis.creep_4",
    "hysteresis.creep_time_1",
    "hysteresis.creep_time_2",
    "hysteresis.creep_time_3",
    "hysteresis.creep_time_4",
    "hysteresis.first_width",
    "hysteresis.first_loss",
    "hysteresis.first_travel",
    "hysteresis.threshold",
    "muscle.area_curve",
    "muscle.softening",
    "muscle.stiffening",
    "muscle.temperature",
    "muscle.temperature_gain",
    "muscle.load_curve",
    "muscle.load_stiffening",
    "muscle.load_stiffening_2",
    "muscle.load_stiffening_root",
    "muscle.creep_1",
    "muscle.creep_2",
    "muscle.creep_3",
    "muscle.creep_4",
    "muscle.strand_1",
    "muscle.strand_2",
    "muscle.strand_3",
    "muscle.strand_4",
    "muscle.strand_break",
    "muscle.viscosity",
    "muscle.viscosity_speed",
    "mass.carried",
    "mass.load_error",
    "mass.slack",
    "mass.stick",
    "mass.stick_kinetic",
    "mass.stick_speed",
    "mass.ring_share",
    "mass.ring_frequency",
    "mass.ring_damping",
    "position.drift",
    "position.drift_time",
    "position.ramp",
    "position.ramp_at",
    "position.ramp_over",
    "position.delay",
    "position.bow",
    "position.slip",
    "position.slip_at",
    "pressure.drift",
    "pressure.drift_time",
    "pressure.ramp",
    "pressure.ramp_at",
    "pressure.ramp_over",
    "pressure.bow",
)
(
    GAIN,
    SLEW_BEND,
    DEAD_BAND,
    DEAD_CLOSE,
    OVERLAP,
    OVERLAP_LEAK,
    EXHAUST_RATIO,
    EXHAUST_TAPER,
    EXHAUST_RATE,
    LEAK,
    SUPPLY_PRESSURE,
    SUPPLY_DROOP,
    SUPPLY_TIME,
    SUPPLY_RECOVERY,
    LINE_SHARE,
    LINE_FLOW,
    LINE_FREQUENCY,
    LINE_DAMPING,
    SHAPE,
    PRESSURE_SLOPE,
    PRESSURE_BEND,
    DRIVE_CREEP_1,
    DRIVE_CREEP_2,
    DRIVE_CREEP_3,
    DRIVE_CREEP_4,
    CREEP_TIME_1,
    CREEP_TIME_2,
    CREEP_TIME_3,
    CREEP_TIME_4,
    FIRST_WIDTH,
    FIRST_LOSS,
    FIRST_TRAVEL,
    DEAD_PRESSURE,
    AREA_CURVE,
    SOFTENING,
    STIFFENING,
    TEMPERATURE,
    TEMPERATURE_GAIN,
    LOAD_CURVE,
    LOAD_STIFFENING,
    LOAD_STIFFENING_2,
    LOAD_STIFFENING_ROOT,
    LENGTH_CREEP_1,
    LENGTH_CREEP_2,
    LENGTH_CREEP_3,
    LENGTH_CREEP_4,
    STRAND_FORCE_1,
    STRAND_FORCE_2,
    STRAND_FORCE_3,
    STRAND_FORCE_4,
    STRAND_BREAK,
    VISCOSITY,
    VISCOSITY_SPEED,
    CARRIED,
    LOAD_ERROR,
    SLACK,
    STICK,
    STICK_KINETIC,
    STICK_SPEED,
    MOUNT_SHARE,
    MOUNT_FREQUENCY,
    MOUNT_DAMPING,
    POSITION_DRIFT,
    DRIFT_TIME,
    RAMP,
    RAMP_AT,
    RAMP_OVER,
    POSITION_DELAY,
    POSITION_BOW,
    SLIP,
    SLIP_AT,
    PRESSURE_DRIFT,
    PRESSURE_DRIFT_TIME,
    PRESSURE_RAMP,
    PRESSURE_RAMP_AT,
    PRESSURE_RAMP_OVER,
    PRESSURE_BOW,
) = range(WEIGHT + ELEMENTS, WEIGHT + ELEMENTS + len(EFFECTS))
N_PARAMETERS = WEIGHT + ELEMENTS + len(EFFECTS)
NAMES = PARAMETERS + EFFECTS
"""Every parameter by name; :func:`place` says where it stands."""

# state of the effects, counted from the first row after the hysteresis's
(
    REGULATED,
    OPEN,
    FRICTION,
    TRAVEL,
    CREEP_1,
    CREEP_2,
    CREEP_3,
    CREEP_4,
    STRETCH_1,
    STRETCH_2,
    STRETCH_3,
    STRETCH_4,
    DROP,
    LINE,
    LINE_RATE,
    STRAND_1,
    STRAND_2,
    STRAND_3,
    STRAND_4,
    STUCK,
    SHOWN,
    MOUNT,
    MOUNT_RATE,
    KELVIN,
    HUNG,
    HANGS,
    POSITION,
    SEEN_POSITION,
    SEEN_PRESSURE,
) = range(29)
SEEN = 29  # positions of the last control periods, in the manner of HISTORY
N_EFFECTS = SEEN + N_HISTORY


def place(name: str) -> int:
    """Return where a parameter stands in the column that the kernels read."""
    if name in PARAMETERS:
        return PARAMETERS.index(name)
    return WEIGHT + ELEMENTS + EFFECTS.index(name)


DEPTH = 24
"""Depth of the Preisach stack of extrema."""

# integer rows
KEY_A, KEY_B, EPISODE, STEP, STACK_COUNT, MEMBER = range(6)
N_COUNTS = 6
