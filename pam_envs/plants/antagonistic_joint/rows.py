"""Row indices of the antagonistic joint's state and parameters.

A plant's numbers are rows of two matrices whose columns are environments (lanes): ``rows`` is the
state, followed by that of the hysteresis and that of the effects, and ``fixed`` the parameters,
which all tiles of a batch share unless they are drawn. Of pairs, the first is muscle A's.
"""

from __future__ import annotations

from pam_envs.hysteresis.protocol import NUMBERS
from pam_envs.mechanics.guide import GUIDE
from pam_envs.parameters import row_blocks
from pam_envs.plants.core.muscle_path import PATH, PATH_NAMES, PATH_STATE, WARM
from pam_envs.plants.core.sensors import sensor_rows
from pam_envs.sensing.sensor import SENSOR

(
    ANGLE,
    VELOCITY,
    PRESSURE_A,
    PRESSURE_B,
    SET_POINT_A,
    SET_POINT_B,
    COMMAND,
    PRESTRESS,
    DISTURBANCE,
    PAYLOAD,
    FORCE_A,
    FORCE_B,
    CONTRACTION_A,
    CONTRACTION_B,
    LAG_A,
    LAG_B,
    SLACK,
    TORQUE,
    STIFFNESS,
    AIR,
    AT_A,
    AT_B,
    STICK_A,
    STICK_B,
    STRAIGHT,
) = range(25)
"""``AT``: contraction beyond that of the straight joint (``STRAIGHT``), the hysteresis input."""
END = 25
"""First row after the plant's state; the hysteresis state follows."""

MUSCLE_PARAMETERS = (
    "regulator.max_pressure",
    "regulator.time_constant",
    "regulator.slew_rate",
    "hysteresis.width",
    "hysteresis.base",
    "hysteresis.rate",
    "muscle.area",
    "muscle.taper",
    "muscle.threshold",
    "muscle.braid_force",
    "muscle.braid_strain",
    "muscle.stiffness",
    "muscle.stretch",
    "muscle.gain",
    "muscle.imbalance",
    "muscle.viscosity",
    "muscle.rest_length",
    "muscle.diameter",
    "lever.r_u",
    "lever.r_o",
    "lever.l_u",
    "lever.l_o",
    "lever.fittings",
    "link.damping",
    "link.limit",
    "link.stop",
    "link.stop_stiffness",
    "nominal.prestress",
    "angle.noise",
    "angle.resolution",
    "angle.bias",
    "pressure.noise",
    "pressure.resolution",
    "pressure.bias",
)
"""Parameters of a stage, alone and in a chain."""
(
    MAX_PRESSURE,
    TIME_CONSTANT,
    SLEW_RATE,
    LOOP_WIDTH,
    FRICTION_BASE,
    FRICTION_RATE,
    AREA,
    TAPER,
    THRESHOLD,
    BRAID_FORCE,
    BRAID_STRAIN,
    MUSCLE_STIFFNESS,
    STRETCH,
    GAIN,
    IMBALANCE,
    VISCOSITY,
    REST_LENGTH,
    DIAMETER,
    R_U,
    R_O,
    L_U,
    L_O,
    FITTINGS,
    DAMPING,
    LIMIT,
    STOP,
    STOP_STIFFNESS,
    NOMINAL_PRESTRESS,
    ANGLE_NOISE,
    ANGLE_RESOLUTION,
    ANGLE_BIAS,
    PRESSURE_NOISE,
    PRESSURE_RESOLUTION,
    PRESSURE_BIAS,
) = range(len(MUSCLE_PARAMETERS))

PARAMETERS = (
    *MUSCLE_PARAMETERS,
    "link.length",
    "link.mass",
    "link.centre",
    "link.gyration",
    "link.gravity",
    "nominal.pole",
    "nominal.stiffness",
)
(
    PAYLOAD_ARM,
    LINK_MASS,
    LINK_CENTRE,
    LINK_GYRATION,
    GRAVITY,
    NOMINAL_POLE,
    NOMINAL_STIFFNESS,
) = range(len(MUSCLE_PARAMETERS), len(PARAMETERS))

# parameters of effects, which are off in a plain plant
EFFECTS = (
    *PATH_NAMES,
    *(f"muscle.{name}" for name in WARM._fields),
    *(f"link.{name}" for name in GUIDE._fields),
    *(f"angle.{name}" for name in SENSOR._fields),
    *(f"pressure.{name}" for name in SENSOR._fields),
)
EFFECT = row_blocks(
    len(PARAMETERS),
    path=len(PATH),
    warm=len(WARM),
    bearing=len(GUIDE),
    angle=len(SENSOR),
    pressure=len(SENSOR),
)
"""First rows of the parameters of effects."""
STATE = row_blocks(
    effective=2,
    paths=2 * PATH_STATE.end,
    stuck=1,
    sensors=sensor_rows(3),
)
"""State of the effects, counted from the first row after the hysteresis."""

MODEL = EFFECT.end
"""First row of the hysteresis operator's numbers."""
N_PARAMETERS = MODEL + NUMBERS
NAMES = PARAMETERS + EFFECTS
"""Every parameter by name, in the order of its rows."""

# integer rows
KEY_A, KEY_B, EPISODE, STEP, MEMBER, STACK_COUNT = range(6)
"""``STACK_COUNT`` has a row for each muscle."""
N_COUNTS = 7


def place(name: str) -> int:
    """Return the row of a parameter in the column that the kernels read."""
    return NAMES.index(name)
