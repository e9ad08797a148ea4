"""Where the numbers of the redundant manipulator's environment stand: rows, report, configuration.

What is there once a joint stands in blocks of ``MOST_STAGES`` rows in the state, and without gaps
in report and observation.
"""

from __future__ import annotations

from pam_envs.envs.core.step import FIRST_CHOICE, FIRST_CONFIG
from pam_envs.plants.redundant_manipulator import rows as M

MOST = M.MOST_STAGES

# the environment's own state, after the plant's
ACTION = M.END
"""First row of what the actions ask for: angles [rad], or pressures [Pa] of A and B by turns."""
OLD_ACTION = ACTION + 2 * MOST
OLD_SET_POINT = OLD_ACTION + 2 * MOST
OLD_PRESSURE = OLD_SET_POINT + 2 * MOST
READ_ANGLE = OLD_PRESSURE + 2 * MOST
READ_PRESSURE = READ_ANGLE + MOST
RATE = READ_PRESSURE + 2 * MOST
"""First row of the rates [rad/s] of the sensed angles."""
OLD_AIR, TOLD_PAYLOAD, CHANGE_TIME, CHANGE, PATH = range(RATE + MOST, RATE + MOST + 5)
RATE_TIME = 0.03
"""Time constant [s] that smooths the rates. The difference of two readings 10 ms apart is mostly
noise; this leaves a fifth of it, and is quicker than the quickest joint (1 / 23 s)."""
HYSTERESIS = PATH + 1
"""First row of the hysteresis's state."""

POSE = ("x", "y", "z", "point_x", "point_y", "point_z")
"""Position of the tool's tip [m] and direction in which it points [1], in the base's frame."""
N_POSE = len(POSE)

SCALARS = (
    "time",
    "reference",
    "output",
    "reward/position",
    "reward/pointing",
    "reward/effort",
    "reward/ended",
    "cost/angle",
    "cost/pressure",
    "margin/angle",
    "margin/pressure",
    "effort/pressure_travel",
    "effort/air",
    "sensor/output",
    "state/pointing_error",
    "state/joint_error",
    "state/payload",
    "state/slack",
    "state/path",
    "state/resting",
)
(
    TIME,
    REF,
    OUTPUT,
    R_POSITION,
    R_POINTING,
    R_EFFORT,
    R_ENDED,
    C_ANGLE,
    C_PRESSURE,
    M_ANGLE,
    M_PRESSURE,
    E_TRAVEL,
    E_AIR,
    SEEN_OUTPUT,
    S_POINTING,
    S_JOINTS,
    S_PAYLOAD,
    S_SLACK,
    S_PATH,
    S_RESTING,
    S_POSE,
) = range(len(SCALARS) + 1)
"""Places in ``info``, from its first row on."""
S_REFERENCE = S_POSE + N_POSE
FIRST_COPIED = S_REFERENCE + N_POSE

BY_JOINT = {
    "state/angle": M.ANGLE,
    "state/velocity": M.VELOCITY,
    "state/command": M.COMMAND,
    "state/torque": M.TORQUE,
    "state/stiffness": M.STIFFNESS,
    "sensor/angle": READ_ANGLE,
    "sensor/rate": RATE,
}
BY_MUSCLE = {
    "state/pressure": M.PRESSURE,
    "state/force": M.FORCE,
    "sensor/pressure": READ_PRESSURE,
}
"""Keys of ``info``, without the number of the joint, that hold rows of the state as they are."""
JOINT_ROWS, MUSCLE_ROWS = tuple(BY_JOINT.values()), tuple(BY_MUSCLE.values())

CONFIG = (
    "position_weight",
    "position_scale",
    "pointing_weight",
    "pointing_scale",
    "effort_weight",
    "soft_angle",
    "soft_pressure",
    "largest_angle",
    "prestress",
    "payload_change",
    "path_seconds",
    "rest_seconds",
    "worst_period",
)
(
    POSITION_WEIGHT,
    POSITION_SCALE,
    POINTING_WEIGHT,
    POINTING_SCALE,
    EFFORT_WEIGHT,
    SOFT_ANGLE,
    SOFT_PRESSURE,
    LARGEST_ANGLE,
    PRESTRESS,
    PAYLOAD_CHANGE,
    PATH_SECONDS,
    REST_SECONDS,
    WORST_PERIOD,
) = range(FIRST_CONFIG, FIRST_CONFIG + len(CONFIG))
CHOICES = ("elements", "mode", "payloads", "paths")
N_ELEMENTS, MODE, N_PAYLOADS, N_PATHS = range(FIRST_CHOICE, FIRST_CHOICE + len(CHOICES))
"""The one own row of the settings holds the payloads [kg] to draw from."""
MODES = ("angle", "pressures")
BY_ANGLE, BY_PRESSURE = range(len(MODES))

NOISE_ANGLE, START, NOISE_PRESSURE = 1, 3, 5
"""Random streams: of all angles, of the start, of all pressures."""


def joint_names(key: str, stages: int) -> list[str]:
    """Return the names of what every joint has."""
    return [f"{key}_{k}" for k in range(stages)]


def muscle_names(key: str, stages: int) -> list[str]:
    """Return the names of what every muscle has."""
    return [f"{key}_{k}{muscle}" for k in range(stages) for muscle in "ab"]


def info_keys(stages: int) -> tuple[str, ...]:
    """Return the keys of ``info`` in the order in which the kernels write them."""
    keys = [*SCALARS, *(f"state/{p}" for p in POSE), *(f"state/reference_{p}" for p in POSE)]
    keys += [name for key in BY_JOINT for name in joint_names(key, stages)]
    keys += [name for key in BY_MUSCLE for name in muscle_names(key, stages)]
    return (*keys, *joint_names("state/joint_reference", stages), "saturated")
