"""Row indices of the single muscle's state and parameters.

A plant's numbers are rows of two matrices whose columns are environments (lanes): ``rows`` is the
state, followed by that of the hysteresis and that of the effects, and ``fixed`` the parameters,
which all tiles of a batch share unless they are drawn.
"""

from __future__ import annotations

from pam_envs.hysteresis import elements as plays
from pam_envs.hysteresis.creep import CreepEffects
from pam_envs.hysteresis.friction_effects import FirstCycles, FrictionEffects, Threshold
from pam_envs.hysteresis.protocol import NUMBERS
from pam_envs.kernels.history import N_HISTORY
from pam_envs.mechanics.guide import GuideEffects
from pam_envs.mechanics.support import MOUNT_STATE, MountEffects, SupportEffects
from pam_envs.muscle.effects import (
    LengthCreepEffects,
    LoadEffects,
    TemperatureEffects,
    ViscosityEffects,
)
from pam_envs.muscle.strands import StrandEffects
from pam_envs.parameters import declarations, named_rows, row_blocks
from pam_envs.pneumatics.regulator import AIR, AIR_STATE
from pam_envs.sensing.sensor import SENSOR

# state
CONTRACTION, VELOCITY, PRESSURE, DRIVE, SET_POINT, OLD_SET_POINT, LOAD, OLD_PRESSURE, OLD_AIR = (
    range(9)
)
# drawn at reset
REST, TOLD_LOAD, CHANGE_TIME, CHANGE = range(9, 13)
HISTORY = 13
"""First row of the ring of the last set-points."""
END = HISTORY + N_HISTORY
"""First row after the plant's state; that of the hysteresis follows."""

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

# parameters of effects, which are off in a plain plant; blocks of a component's own rows
_EFFECTS = {
    "regulator": AIR._fields,
    "hysteresis": (
        *declarations(FrictionEffects),
        *declarations(CreepEffects),
        "first_width",
        *declarations(FirstCycles),
        *declarations(Threshold),
    ),
    "muscle": (
        *("area_curve", "softening", "stiffening"),
        *declarations(TemperatureEffects),
        *declarations(LoadEffects),
        *declarations(LengthCreepEffects),
        *declarations(StrandEffects),
        *declarations(ViscosityEffects),
    ),
    "mass": (
        *("carried", "load_error"),
        *declarations(SupportEffects),
        *declarations(GuideEffects),
        *declarations(MountEffects),
    ),
    "position": SENSOR._fields,
    "pressure": SENSOR._fields,
}
EFFECTS = tuple(f"{part}.{name}" for part, names in _EFFECTS.items() for name in names)
_BLOCKS = row_blocks(len(PARAMETERS), **{part: len(names) for part, names in _EFFECTS.items()})
REGULATOR, POSITION_SENSOR, PRESSURE_SENSOR = (
    _BLOCKS.regulator,
    _BLOCKS.position,
    _BLOCKS.pressure,
)
"""First rows of the effects of regulator (``AIR``) and sensors (``SENSOR``)."""
NAMES = PARAMETERS + EFFECTS
"""Every parameter by name, in the order of its rows."""
EFFECT = named_rows(*(name.replace(".", "_") for name in NAMES))
"""Row of every parameter: ``EFFECT.muscle_viscosity`` of ``"muscle.viscosity"``."""

# derived from them once
TALL, COSINE = range(len(NAMES), len(NAMES) + 2)
MODEL = COSINE + 1
"""First row of the hysteresis operator's numbers; of play operators the rows are these."""
LINEAR, THRESHOLD, WEIGHT = MODEL + plays.LINEAR, MODEL + plays.THRESHOLD, MODEL + plays.WEIGHT
N_PARAMETERS = MODEL + NUMBERS

STATE = row_blocks(
    air=len(AIR_STATE),
    friction=1,
    travel=1,
    creep=4,
    stretch=4,
    strands=4,
    stuck=1,
    shown=1,
    mount=len(MOUNT_STATE),
    kelvin=1,
    hung=1,
    hangs=1,
    position=1,
    position_reading=1,
    position_ring=N_HISTORY,
    pressure_reading=1,
    pressure_ring=N_HISTORY,
)
"""State of the effects, counted from the first row after the hysteresis."""
N_EFFECTS = STATE.end


def place(name: str) -> int:
    """Return the row of a parameter in the column that the kernels read."""
    return NAMES.index(name)


# integer rows
KEY_A, KEY_B, EPISODE, STEP, STACK_COUNT, MEMBER = range(6)
N_COUNTS = 6
