"""Row indices of the elbow orthosis' state and parameters.

A plant's numbers are rows of two matrices whose columns are environments (lanes): ``rows`` is the
state, followed by that of the hysteresis and that of the effects, and ``fixed`` the parameters,
which all tiles of a batch share unless they are drawn. Of pairs, the first is that of bundle a,
which straightens the elbow.
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
    COMMAND_A,
    COMMAND_B,
    INTENT,
    INTENT_RATE,
    INTENT_ACCELERATION,
    DISTURBANCE,
    FORCE_A,
    FORCE_B,
    CONTRACTION_A,
    CONTRACTION_B,
    TORQUE,
    STIFFNESS,
    FELT,
    WEARER,
    SLACK,
    AIR_A,
    AIR_B,
    USED,
    SWITCHES,
    CLOCK,
    DRIVE,
    AT,
    LAG,
) = range(27)
"""``DRIVE``: torque of the intended motion; ``AT``: travel of the pulley, the hysteresis input."""
VALVES = 4
"""Fill and exhaust valve of bundle a, then of bundle b."""
LEFT, LIFT, OPENED = 27, 27 + VALVES, 27 + 2 * VALVES
"""First rows of the valves' state: coil time left, lift, whether open."""
END = 27 + 3 * VALVES
"""First row after the plant's state; the hysteresis state follows."""

_BUNDLE = (
    "muscles",
    "nominal_length",
    "largest_contraction",
    "passive_base",
    "passive_each",
    "pressure_base",
    "pressure_each",
    "diameter",
    "line_volume",
    "gain",
)
(
    MUSCLES,
    NOMINAL_LENGTH,
    LARGEST_CONTRACTION,
    PASSIVE_BASE,
    PASSIVE_EACH,
    PRESSURE_BASE,
    PRESSURE_EACH,
    DIAMETER,
    LINE_VOLUME,
    GAIN,
) = range(len(_BUNDLE))
"""Rows of a bundle, counted from ``BUNDLE + side * BUNDLE_ROWS``."""
BUNDLE, BUNDLE_ROWS = 0, len(_BUNDLE)

PARAMETERS = (
    *(f"{bundle}.{name}" for bundle in ("bundle_a", "bundle_b") for name in _BUNDLE),
    "regulator.max_pressure",
    "regulator.time_constant",
    "regulator.slew_rate",
    "valve.supply_pressure",
    "valve.conductance",
    "valve.critical_ratio",
    "valve.opening_time",
    "valve.closing_time",
    "valve.frequency",
    "hysteresis.loop",
    "pulley.radius",
    "pulley.lowest",
    "pulley.highest",
    "pulley.stop_stiffness",
    "link.mass",
    "link.centre",
    "link.inertia",
    "link.damping",
    "link.gravity",
    "wearer.mass",
    "wearer.centre",
    "wearer.inertia",
    "wearer.stiffness",
    "wearer.damping",
    "wearer.handle",
    "angle.noise",
    "angle.resolution",
    "angle.bias",
    "pressure.noise",
    "pressure.resolution",
    "pressure.bias",
)
(
    MAX_PRESSURE,
    TIME_CONSTANT,
    SLEW_RATE,
    SUPPLY_PRESSURE,
    CONDUCTANCE,
    CRITICAL_RATIO,
    OPENING_TIME,
    CLOSING_TIME,
    FREQUENCY,
    LOOP,
    RADIUS,
    LOWEST,
    HIGHEST,
    STOP_STIFFNESS,
    LINK_MASS,
    LINK_CENTRE,
    LINK_INERTIA,
    LINK_DAMPING,
    GRAVITY,
    WEARER_MASS,
    WEARER_CENTRE,
    WEARER_INERTIA,
    WEARER_STIFFNESS,
    WEARER_DAMPING,
    HANDLE,
    ANGLE_NOISE,
    ANGLE_RESOLUTION,
    ANGLE_BIAS,
    PRESSURE_NOISE,
    PRESSURE_RESOLUTION,
    PRESSURE_BIAS,
) = range(2 * BUNDLE_ROWS, len(PARAMETERS))

# parameters of effects, which are off in a plain plant
EFFECTS = (
    *PATH_NAMES,
    *(f"{bundle}.{name}" for bundle in ("bundle_a", "bundle_b") for name in WARM._fields),
    *(f"link.{name}" for name in GUIDE._fields),
    *(f"angle.{name}" for name in SENSOR._fields),
    *(f"pressure.{name}" for name in SENSOR._fields),
)
EFFECT = row_blocks(
    len(PARAMETERS),
    path=len(PATH),
    warm=2 * len(WARM),
    bearing=len(GUIDE),
    angle=len(SENSOR),
    pressure=len(SENSOR),
)
"""First rows of the parameters of effects."""
STATE = row_blocks(
    effective=2,
    crept=2,
    factor=2,
    paths=2 * PATH_STATE.end,
    stuck=1,
    sensors=sensor_rows(3),
)
"""State of the effects, counted from the first row after the hysteresis."""

MODEL = EFFECT.end
"""First row of the hysteresis operator's numbers."""
LARGEST_LAG = MODEL + NUMBERS
N_PARAMETERS = LARGEST_LAG + 1
NAMES = PARAMETERS + EFFECTS
"""Every parameter by name, in the order of its rows."""

# integer rows
KEY_A, KEY_B, EPISODE, STEP, MEMBER, STACK_COUNT = range(6)
N_COUNTS = 6


def place(name: str) -> int:
    """Return the row of a parameter in the column that the kernels read."""
    return NAMES.index(name)
