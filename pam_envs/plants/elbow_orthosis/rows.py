"""Where each number of the elbow orthosis stands in its rows (see ``single_muscle_rows``).

A plant's numbers are rows of two matrices whose columns are environments (lanes): ``rows`` is the
state, followed by that of the hysteresis, and ``fixed`` the parameters, which all tiles of a batch
share unless they are drawn. This page is the only one that counts. Of what stands twice, the
first is bundle a's, which straightens the elbow.
"""

from __future__ import annotations

from pam_envs.hysteresis.protocol import NUMBERS

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
"""``DRIVE``: torque of the intended motion; ``AT``: travel of the pulley, the hysteresis's input."""
VALVES = 4
"""Fill and exhaust valve of bundle a, then of bundle b."""
LEFT, LIFT, OPENED = 27, 27 + VALVES, 27 + 2 * VALVES
"""First rows of the valves' state: coil time left, lift, whether open."""
END = 27 + 3 * VALVES
"""First row after the plant's state; the hysteresis's state follows."""

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

MODEL = len(PARAMETERS)
"""First row of the hysteresis operator's numbers."""
LARGEST_LAG = MODEL + NUMBERS
N_PARAMETERS = LARGEST_LAG + 1
NAMES = PARAMETERS
"""Every parameter by name; :func:`place` says where it stands."""

# integer rows
KEY_A, KEY_B, EPISODE, STEP, MEMBER, STACK_COUNT = range(6)
N_COUNTS = 6


def place(name: str) -> int:
    """Return where a parameter stands in the column that the kernels read."""
    return PARAMETERS.index(name)
