"""Row indices of the knee orthosis' state and parameters.

A plant's numbers are rows of two matrices whose columns are environments (lanes): ``rows`` is the
state, followed by that of the hysteresis and that of the effects, and ``fixed`` the parameters,
which all tiles of a batch share unless they are drawn.
"""

from __future__ import annotations

from pam_envs.hysteresis.protocol import NUMBERS
from pam_envs.mechanics.guide import GUIDE
from pam_envs.parameters import row_blocks
from pam_envs.plants.core.muscle_path import PATH, PATH_NAMES, PATH_STATE, WARM
from pam_envs.plants.core.sensors import sensor_rows
from pam_envs.pneumatics.measured_dynamics import MODE_ROWS, MODES
from pam_envs.sensing.sensor import SENSOR

# state: brace and muscle, then stride and wearer
(
    ANGLE,
    VELOCITY,
    PRESSURE,
    STIFFNESS,
    SET_POINT,
    OLD_SET_POINT,
    TENSION,
    LENGTH,
    TORQUE,
    AIR,
    OLD_PRESSURE,
    OLD_AIR,
    START_PHASE,
    PHASE,
    KNEE,
    KNEE_RATE,
    KNEE_ACCELERATION,
    DEVIATION,
    DEVIATION_RATE,
    SHANK,
    ANKLE,
    GROUND_Z,
    GROUND_X,
    COP,
    DEMAND,
    ESTIMATE,
    HEEL,
    STANCE,
    HOLD,
    HOLD_RATE,
    QUADS,
    QUADS_FREE,
    FLEXORS,
    FLEXORS_FREE,
) = range(34)
MODE = 34
"""First row of the measured dynamics' modes."""
END = MODE + MODES
"""First row after the plant's state; the hysteresis state follows."""

# parameters, in the order of PARAMETERS below
PARAMETERS = (
    "regulator.max_pressure",
    "regulator.time_constant",
    "regulator.slew_rate",
    "hysteresis.width",
    "muscle.shortest_length",
    "muscle.stiffness_ratio",
    "muscle.full_volume",
    "muscle.gain",
    "lever.arm",
    "lever.fittings",
    "lever.stiffness",
    "lever.relaxed_angle",
    "lever.mount_angle",
    "lever.inertia",
    "lever.damping",
    "fixture.length",
    "leg.body_mass",
    "leg.mass",
    "leg.inertia",
    "leg.centre",
    "leg.shank",
    "leg.thigh",
    "leg.ankle_height",
    "leg.aim_height",
    "leg.damping",
    "leg.stiffness",
    "leg.hold_stiffness",
    "leg.hold_damping",
    "leg.stance_stiffness",
    "leg.stance_damping",
    "leg.habituation",
    "stride.time",
    "shoe.heel",
    "shoe.tip",
    "shoe.threshold",
    "shoe.flat_foot",
    "activation.largest_torque",
    "activation.floor",
    "activation.rise_time",
    "activation.fall_time",
    "tension.noise",
    "tension.resolution",
    "tension.bias",
    "angle.noise",
    "angle.resolution",
    "angle.bias",
    "pressure.noise",
    "pressure.resolution",
    "pressure.bias",
    "heel.noise",
    "heel.resolution",
    "heel.bias",
    "ground.noise",
    "ground.resolution",
    "ground.bias",
    "cop.noise",
    "cop.resolution",
    "cop.bias",
    "ankle.noise",
    "ankle.resolution",
    "ankle.bias",
)
(
    MAX_PRESSURE,
    TIME_CONSTANT,
    SLEW_RATE,
    LOOP_WIDTH,
    SHORTEST_LENGTH,
    STIFFNESS_RATIO,
    FULL_VOLUME,
    GAIN,
    LEVER_ARM,
    LEVER_FITTINGS,
    LEVER_STIFFNESS,
    LEVER_RELAXED_ANGLE,
    LEVER_MOUNT_ANGLE,
    LEVER_INERTIA,
    LEVER_DAMPING,
    FIXTURE_LENGTH,
    LEG_BODY_MASS,
    LEG_MASS,
    LEG_INERTIA,
    LEG_CENTRE,
    LEG_SHANK,
    LEG_THIGH,
    LEG_ANKLE_HEIGHT,
    LEG_AIM_HEIGHT,
    LEG_DAMPING,
    LEG_STIFFNESS,
    LEG_HOLD_STIFFNESS,
    LEG_HOLD_DAMPING,
    LEG_STANCE_STIFFNESS,
    LEG_STANCE_DAMPING,
    LEG_HABITUATION,
    STRIDE_TIME,
    SHOE_HEEL,
    SHOE_TIP,
    SHOE_THRESHOLD,
    SHOE_FLAT_FOOT,
    ACTIVATION_LARGEST_TORQUE,
    ACTIVATION_FLOOR,
    ACTIVATION_RISE_TIME,
    ACTIVATION_FALL_TIME,
    TENSION_NOISE,
    TENSION_RESOLUTION,
    TENSION_BIAS,
    ANGLE_NOISE,
    ANGLE_RESOLUTION,
    ANGLE_BIAS,
    PRESSURE_NOISE,
    PRESSURE_RESOLUTION,
    PRESSURE_BIAS,
    HEEL_NOISE,
    HEEL_RESOLUTION,
    HEEL_BIAS,
    GROUND_NOISE,
    GROUND_RESOLUTION,
    GROUND_BIAS,
    COP_NOISE,
    COP_RESOLUTION,
    COP_BIAS,
    ANKLE_NOISE,
    ANKLE_RESOLUTION,
    ANKLE_BIAS,
) = range(len(PARAMETERS))

SENSORS = ("tension", "angle", "pressure", "heel", "ground", "cop", "ankle")
# parameters of effects, which are off in a plain plant
EFFECTS = (
    *PATH_NAMES,
    *(f"muscle.{name}" for name in WARM._fields),
    *(f"lever.{name}" for name in GUIDE._fields),
    *(f"{sensor}.{name}" for sensor in SENSORS for name in SENSOR._fields),
)
EFFECT = row_blocks(
    len(PARAMETERS),
    path=len(PATH),
    warm=len(WARM),
    bearing=len(GUIDE),
    sensors=len(SENSORS) * len(SENSOR),
)
"""First rows of the parameters of effects."""
STATE = row_blocks(
    effective=1,
    path=PATH_STATE.end,
    stuck=1,
    sensors=sensor_rows(len(SENSORS)),
)
"""State of the effects, counted from the first row after the hysteresis."""

MODE_TABLE = EFFECT.end
"""First row of what the modes are made of."""
MODEL = MODE_TABLE + MODE_ROWS
"""First row of the hysteresis operator's numbers."""
N_PARAMETERS = MODEL + NUMBERS
NAMES = PARAMETERS + EFFECTS
"""Every parameter by name, in the order of its rows."""

# integer rows
KEY_A, KEY_B, EPISODE, STEP, STACK_COUNT, MEMBER = range(6)
N_COUNTS = 6


def place(name: str) -> int:
    """Return the row of a parameter in the column that the kernels read."""
    return NAMES.index(name)
