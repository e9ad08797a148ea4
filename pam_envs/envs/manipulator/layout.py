"""Rows, report and configuration of the redundant manipulator kernels.

Quantities of every joint are blocks of ``MOST_STAGES`` rows in the state, and consecutive in report
and observation.
"""

from pam_envs.envs.core.layout import Report, computed, indices
from pam_envs.envs.core.step import FIRST_CHOICE, FIRST_CONFIG
from pam_envs.plants.redundant_manipulator import rows as M
from pam_envs.plants.redundant_manipulator.step import work_rows

MOST = M.MOST_STAGES

# the environment's own state, after the plant's
ACTION = M.END
"""First row of the actions: angles [rad], or pressures [Pa] of A and B alternately."""
OLD_ACTION = ACTION + 2 * MOST
OLD_SET_POINT = OLD_ACTION + 2 * MOST
OLD_PRESSURE = OLD_SET_POINT + 2 * MOST
READ_ANGLE = OLD_PRESSURE + 2 * MOST
READ_PRESSURE = READ_ANGLE + MOST
RATE = READ_PRESSURE + 2 * MOST
"""First row of the rates [rad/s] of the sensed angles."""
OLD_AIR, DECLARED_PAYLOAD, CHANGE_TIME, CHANGE, PATH = range(RATE + MOST, RATE + MOST + 5)
RATE_TIME = 0.03
"""Time constant [s] of the filtered rates: leaves a fifth of the noise of the difference of two
readings 10 ms apart, and is shorter than that of the fastest joint (1 / 23 s)."""
HYSTERESIS = PATH + 1
"""First row of the state of the hysteresis."""

POSE = ("x", "y", "z", "point_x", "point_y", "point_z")
"""Position of the tool's tip [m] and direction in which it points [1], in the base's frame."""
N_POSE = len(POSE)

ENTRIES: dict[str, int | None] = {
    **computed("reward", "position", "pointing", "effort", "ended"),
    **computed("cost", "angle", "pressure"),
    **computed("margin", "angle", "pressure"),
    **computed("effort", "pressure_travel", "air"),
    **computed("sensor", "output"),
    **computed("state", "pointing_error", "joint_error"),
    "state/payload": M.PAYLOAD,
    "state/slack": M.SLACK,
    "state/path": PATH,
    **computed("state", "resting"),
    **computed("state", *POSE),
    **computed("state", *(f"reference_{name}" for name in POSE)),
}
"""Entries of ``info`` for any number of joints."""
INFO = indices(("time", "reference", "output", *ENTRIES))
"""Index of each of them in ``info``: its work rows depend on the number of joints."""

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
"""First row of the state of further entries, by key without the number of the joint."""

CONFIG = indices(
    (
        *("position_weight", "position_scale", "pointing_weight", "pointing_scale"),
        *("effort_weight", "soft_angle", "soft_pressure", "largest_angle", "prestress"),
        *("payload_change", "path_seconds", "rest_seconds", "worst_period"),
    ),
    FIRST_CONFIG,
)
CHOICE = indices(("mode", "payloads", "paths"), FIRST_CHOICE)
"""The own row of the settings holds the payloads [kg] to draw from."""
MODES = ("angle", "pressures")
BY_ANGLE, BY_PRESSURE = range(len(MODES))

NOISE_ANGLE, START, NOISE_PRESSURE = 1, 3, 5
"""Random streams: of all angles, of the start, of all pressures."""


def joint_names(key: str, stages: int) -> list[str]:
    """Return the names of a quantity of every joint."""
    return [f"{key}_{k}" for k in range(stages)]


def muscle_names(key: str, stages: int) -> list[str]:
    """Return the names of a quantity of every muscle."""
    return [f"{key}_{k}{muscle}" for k in range(stages) for muscle in "ab"]


def report_for(stages: int) -> Report:
    """Return the report for a number of joints."""
    entries = dict(ENTRIES)
    for key, row in BY_JOINT.items():
        entries |= {name: row + k for k, name in enumerate(joint_names(key, stages))}
    for key, row in BY_MUSCLE.items():
        entries |= {name: row + k for k, name in enumerate(muscle_names(key, stages))}
    entries |= dict.fromkeys(joint_names("state/joint_reference", stages))
    observed = (
        *range(READ_ANGLE, READ_ANGLE + stages),
        *range(RATE, RATE + stages),
        *range(READ_PRESSURE, READ_PRESSURE + 2 * stages),
        DECLARED_PAYLOAD,
        *[None] * N_POSE,
        *range(ACTION, ACTION + 2 * stages),
    )
    return Report(entries, work_rows(stages), observed)
