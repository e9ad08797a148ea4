"""Where the numbers of the elbow's environment stand: rows, report, observation, configuration."""

from __future__ import annotations

from pam_envs.envs.core.step import FIRST_CHOICE, FIRST_CONFIG
from pam_envs.plants.elbow_orthosis import rows as K
from pam_envs.plants.elbow_orthosis.step import N_WORK
from pam_envs.references.reaches import ROWS as MOTION_ROWS
from pam_envs.tasks.torque_stiffness import OBJECTS

# the environment's own state, after the plant's
ACTION = K.END
"""First row of what the actions ask for: two pressures [Pa], two pulse widths [s], or a torque
[N m] and a stiffness [N m/rad]."""
OLD_ACTION = ACTION + 2
OLD_COMMAND_A, OLD_COMMAND_B, OLD_A, OLD_B, OLD_USED, OLD_SWITCHES, OLD_SEEN = range(
    OLD_ACTION + 2, OLD_ACTION + 9
)
"""As they were at the end of the period before."""
SEEN_ANGLE, SEEN_A, SEEN_B = range(OLD_SEEN + 1, OLD_SEEN + 4)
"""What the sensors gave at the end of the last period."""
OBJECT, PLACE, STRENGTH, LEVEL = range(SEEN_B + 1, SEEN_B + 5)
"""Virtual object: its kind, angle of a wall, torque of a weight or stiffness of a wall, stiffness
where there is no wall."""
MOTION = LEVEL + 1
HYSTERESIS = MOTION + MOTION_ROWS
"""First row of the hysteresis's state."""

COPIED = {
    "state/angle": K.ANGLE,
    "state/velocity": K.VELOCITY,
    "state/intent": K.INTENT,
    "state/pressure_a": K.PRESSURE_A,
    "state/pressure_b": K.PRESSURE_B,
    "state/command_a": K.COMMAND_A,
    "state/command_b": K.COMMAND_B,
    "state/force_a": K.FORCE_A,
    "state/force_b": K.FORCE_B,
    "state/torque": K.TORQUE,
    "state/stiffness": K.STIFFNESS,
    "state/felt": K.FELT,
    "state/wearer": K.WEARER,
    "state/slack": K.SLACK,
    "state/object": OBJECT,
    "sensor/angle": SEEN_ANGLE,
    "sensor/pressure_a": SEEN_A,
    "sensor/pressure_b": SEEN_B,
}
"""Keys of ``info`` that hold a row of the state as it is."""
COPIED_ROWS = tuple(COPIED.values())
JUDGED = (
    "time",
    "reference",
    "output",
    "reward/torque",
    "reward/stiffness",
    "reward/effort",
    "reward/ended",
    "cost/pressure",
    "cost/angle",
    "margin/pressure",
    "margin/angle",
    "effort/pressure_travel",
    "effort/air",
    "effort/switchings",
    "state/stiffness_reference",
    "state/object_torque",
    "state/torque_clipped",
    "state/stiffness_clipped",
    "sensor/torque",
    "sensor/stiffness",
)
(
    TIME,
    REF,
    OUTPUT,
    R_TORQUE,
    R_STIFFNESS,
    R_EFFORT,
    R_ENDED,
    C_PRESSURE,
    C_ANGLE,
    M_PRESSURE,
    M_ANGLE,
    E_TRAVEL,
    E_AIR,
    E_SWITCHINGS,
    S_STIFFNESS_REFERENCE,
    S_OBJECT_TORQUE,
    S_TORQUE_CLIPPED,
    S_STIFFNESS_CLIPPED,
    SENSOR_TORQUE,
    SENSOR_STIFFNESS,
    FIRST_COPIED,
) = range(N_WORK, N_WORK + len(JUDGED) + 1)
INFO = (*JUDGED, *COPIED, "saturated")
SATURATED = N_WORK + len(INFO) - 1
ENDED = N_WORK + len(INFO)
SIGNALS = ENDED + 1
"""First work row of the observation, in SI."""
COMMON_SIGNALS = 8
"""Angle, rate, two pressures, two commands, torque and stiffness as estimated; on/off valves have
the time to their next pulse behind them, then come the references."""
CHANNELS = 2

CONFIG = (
    "torque_weight",
    "torque_scale",
    "stiffness_weight",
    "stiffness_scale",
    "effort_weight",
    "soft_pressure",
    "lightest",
    "heaviest",
    "handle",
    "softest_free",
    "stiffest_free",
    "softest_held",
    "stiffest_held",
    "nearest_wall",
    "farthest_wall",
    "softest_wall",
    "stiffest_wall",
    "wall_depth",
    "lowest_angle",
    "highest_angle",
    "bears",
    "motion_low",
    "motion_high",
    "window",
    "command_range",
    "start_share",
    "worst_period",
)
(
    TORQUE_WEIGHT,
    TORQUE_SCALE,
    STIFFNESS_WEIGHT,
    STIFFNESS_SCALE,
    EFFORT_WEIGHT,
    SOFT_PRESSURE,
    LIGHTEST,
    HEAVIEST,
    HANDLE,
    SOFTEST_FREE,
    STIFFEST_FREE,
    SOFTEST_HELD,
    STIFFEST_HELD,
    NEAREST_WALL,
    FARTHEST_WALL,
    SOFTEST_WALL,
    STIFFEST_WALL,
    WALL_DEPTH,
    LOWEST_ANGLE,
    HIGHEST_ANGLE,
    BEARS,
    MOTION_LOW,
    MOTION_HIGH,
    WINDOW,
    COMMAND_RANGE,
    START_SHARE,
    WORST_PERIOD,
) = range(FIRST_CONFIG, FIRST_CONFIG + len(CONFIG))
CHOICES = ("elements", "object", "motion", "mode", "pulsed", "fixed_signals", "samples")
N_ELEMENTS, OBJECT_KIND, MOTION_KIND, MODE, PULSED, FIXED_SIGNALS, N_SAMPLES = range(
    FIRST_CHOICE, FIRST_CHOICE + len(CHOICES)
)
SAMPLES = len(OBJECTS)
"""Number of an object that is given as samples of torque and stiffness."""
ACTIONS = ("pressures", "torque_stiffness")
BY_PRESSURE, BY_TORQUE = range(len(ACTIONS))
"""What the actions are; with on/off valves, those of "pressures" are pulse widths."""

MODEL = (
    "radius",
    "lowest",
    "highest",
    "length_a",
    "reach_a",
    "length_b",
    "reach_b",
    "low_a",
    "high_a",
    "low_b",
    "high_b",
    "full_pressure",
    "weight",
)
(
    RADIUS,
    LOWEST,
    HIGHEST,
    LENGTH_A,
    REACH_A,
    LENGTH_B,
    REACH_B,
    LOW_A,
    HIGH_A,
    LOW_B,
    HIGH_B,
    FULL_PRESSURE,
    WEIGHT,
) = range(len(MODEL))
"""The first own row of the settings: what the orthosis' own program is told of its bundles. The
other two hold torque and stiffness where the task is given as samples."""

NOISE_ANGLE, NOISE_A, NOISE_B, START, TASK = 1, 2, 3, 5, 6
"""Random streams."""
