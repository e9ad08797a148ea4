"""Row indices of the redundant manipulator's state and parameters.

Rows of one kind are neighbours, ``ANGLE + k`` of joint ``k``, ``PRESSURE + 2 k`` of its muscle
A and ``PRESSURE + 2 k + 1`` of its muscle B. There is room for ``MOST_STAGES`` joints, however many
a chain has. The parameters of the muscles have the rows of those of a single joint, so that the
kernels of the pair serve both.
"""

from __future__ import annotations

from pam_envs.hysteresis.protocol import NUMBERS
from pam_envs.parameters import row_blocks
from pam_envs.plants.antagonistic_joint.rows import (
    ANGLE_BIAS,
    ANGLE_NOISE,
    ANGLE_RESOLUTION,
    DAMPING,
    LIMIT,
    MAX_PRESSURE,
    MUSCLE_PARAMETERS,
    NOMINAL_PRESTRESS,
    PRESSURE_BIAS,
    PRESSURE_NOISE,
    PRESSURE_RESOLUTION,
    REST_LENGTH,
    SLEW_RATE,
    STOP,
    TIME_CONSTANT,
)
from pam_envs.plants.core.muscle_path import PATH, PATH_NAMES, PATH_STATE, WARM
from pam_envs.plants.core.sensors import sensor_rows
from pam_envs.sensing.sensor import SENSOR

__all__ = [
    "ANGLE_BIAS",
    "ANGLE_NOISE",
    "ANGLE_RESOLUTION",
    "DAMPING",
    "LIMIT",
    "MAX_PRESSURE",
    "NOMINAL_PRESTRESS",
    "PRESSURE_BIAS",
    "PRESSURE_NOISE",
    "PRESSURE_RESOLUTION",
    "REST_LENGTH",
    "SLEW_RATE",
    "STOP",
    "TIME_CONSTANT",
]

MOST_STAGES = 8

# a row for each joint
(
    ANGLE,
    VELOCITY,
    COMMAND,
    PRESTRESS,
    DISTURBANCE,
    TORQUE,
    STIFFNESS,
    MIDDLE,
    MIDDLE_RATE,
    CHANGE,
) = range(0, 10 * MOST_STAGES, MOST_STAGES)
"""``MIDDLE`` and its rate are predictions; ``CHANGE`` is that of the velocity in a sub-step."""
# a row for each muscle
PRESSURE, SET_POINT, FORCE, CONTRACTION, LAG, AT, STICK = range(
    10 * MOST_STAGES, 24 * MOST_STAGES, 2 * MOST_STAGES
)
PAYLOAD, SLACK, AIR, STRAIGHT, SHARE = range(24 * MOST_STAGES, 24 * MOST_STAGES + 5)
"""``SHARE`` is the payload over the links' common factor (see :func:`swing` of the kernels)."""
END = SHARE + 1
"""First row after the plant's state; the hysteresis state follows."""

PARAMETERS = (*MUSCLE_PARAMETERS, "arm.mass_factor", "arm.damping_factor")
MASS_FACTOR, DAMPING_FACTOR = range(len(MUSCLE_PARAMETERS), len(PARAMETERS))
# parameters of effects, which are off in a plain plant
EFFECTS = (
    *PATH_NAMES,
    *(f"muscle.{name}" for name in WARM._fields),
    *(f"angle.{name}" for name in SENSOR._fields),
    *(f"pressure.{name}" for name in SENSOR._fields),
)
EFFECT = row_blocks(
    len(PARAMETERS),
    path=len(PATH),
    warm=len(WARM),
    angle=len(SENSOR),
    pressure=len(SENSOR),
)
"""First rows of the parameters of effects."""
STATE = row_blocks(
    effective=2 * MOST_STAGES,
    paths=2 * MOST_STAGES * PATH_STATE.end,
    sensors=sensor_rows(3 * MOST_STAGES),
)
"""State of the effects, counted from the first row after the hysteresis."""

MODEL = EFFECT.end
"""First row of the hysteresis operator."""
JOINT_DAMPING = MODEL + NUMBERS
"""First row of the damping that each joint has beside ``link.damping`` [N m s/rad]."""
CHAIN = JOINT_DAMPING + MOST_STAGES
"""First row of the chain's parameters (``serial_chain_rows``)."""
NAMES = PARAMETERS + EFFECTS
"""Every parameter by name, in the order of its rows."""

# integer rows
KEY_A, KEY_B, EPISODE, STEP, MEMBER, STACK_COUNT = range(6)
"""``STACK_COUNT`` has a row for each muscle."""
N_COUNTS = STACK_COUNT + 2 * MOST_STAGES


def place(name: str) -> int:
    """Return the row of a parameter in the column that the kernels read."""
    return NAMES.index(name)
