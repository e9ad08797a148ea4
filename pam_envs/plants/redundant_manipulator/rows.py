"""Where each number of the redundant manipulator stands in its rows (see ``single_muscle_rows``).

Rows of one kind stand side by side, ``ANGLE + k`` of joint ``k``, ``PRESSURE + 2 k`` of its muscle
A and ``PRESSURE + 2 k + 1`` of its muscle B. There is room for ``MOST_STAGES`` joints, however many
a chain has. The parameters of the muscles stand where those of a single joint stand, so that the
kernels of the pair serve both.
"""

from __future__ import annotations

from pam_envs.hysteresis.protocol import NUMBERS
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
"""First row after the plant's state; the hysteresis's state follows."""

PARAMETERS = (*MUSCLE_PARAMETERS, "arm.mass_factor", "arm.damping_factor")
MASS_FACTOR, DAMPING_FACTOR = range(len(MUSCLE_PARAMETERS), len(PARAMETERS))
MODEL = len(PARAMETERS)
"""First row of the hysteresis's operator."""
JOINT_DAMPING = MODEL + NUMBERS
"""First row of the damping that each joint has beside ``link.damping`` [N m s/rad]."""
CHAIN = JOINT_DAMPING + MOST_STAGES
"""First row of the chain's parameters (``serial_chain_rows``)."""
NAMES = PARAMETERS
"""Every parameter by name; :func:`place` says where it stands."""

# integer rows
KEY_A, KEY_B, EPISODE, STEP, MEMBER, STACK_COUNT = range(6)
"""``STACK_COUNT`` has a row for each muscle."""
N_COUNTS = STACK_COUNT + 2 * MOST_STAGES


def place(name: str) -> int:
    """Return where a parameter stands in the column that the kernels read."""
    return PARAMETERS.index(name)
