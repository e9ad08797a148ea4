"""Rows, report, observation and configuration of the elbow orthosis kernels."""

from pam_envs.envs.core.layout import Report, computed, copied, indices
from pam_envs.envs.core.step import FIRST_CHOICE, FIRST_CONFIG
from pam_envs.parameters import declarations
from pam_envs.plants.elbow_orthosis import rows as K
from pam_envs.plants.elbow_orthosis.bundles import N_WORK
from pam_envs.references.reaches import ROWS as MOTION_ROWS
from pam_envs.tasks.torque_stiffness import OBJECTS, TorqueStiffness

# the environment's own state, after the plant's
ACTION = K.END
"""First row of the actions: two pressures [Pa], two pulse widths [s], or a torque [N m] and a
stiffness [N m/rad]."""
OLD_ACTION = ACTION + 2
OLD_COMMAND_A, OLD_COMMAND_B, OLD_A, OLD_B, OLD_USED, OLD_SWITCHES, OLD_READ = range(
    OLD_ACTION + 2, OLD_ACTION + 9
)
"""Values at the end of the previous period."""
READ_ANGLE, READ_A, READ_B = range(OLD_READ + 1, OLD_READ + 4)
"""Readings at the end of the last period."""
OBJECT, PLACE, STRENGTH, LEVEL = range(READ_B + 1, READ_B + 5)
"""Virtual object: kind, angle of a wall, torque of a weight or stiffness of a wall, stiffness
outside a wall."""
MOTION = LEVEL + 1
HYSTERESIS = MOTION + MOTION_ROWS
"""First row of the state of the hysteresis."""

REPORT = Report(
    {
        **computed("reward", "torque", "stiffness", "effort", "ended"),
        **computed("cost", "pressure", "angle"),
        **computed("margin", "pressure", "angle"),
        **computed("effort", "pressure_travel", "air", "switchings"),
        **computed("state", "stiffness_reference", "object_torque"),
        **computed("state", "torque_clipped", "stiffness_clipped"),
        **computed("sensor", "torque", "stiffness"),
        **copied("state", K, "angle", "velocity", "intent", "pressure_a", "pressure_b"),
        **copied("state", K, "command_a", "command_b", "force_a", "force_b", "torque"),
        **copied("state", K, "stiffness", "felt", "wearer", "slack"),
        "state/object": OBJECT,
        "sensor/angle": READ_ANGLE,
        "sensor/pressure_a": READ_A,
        "sensor/pressure_b": READ_B,
    },
    N_WORK,
    observed=(READ_ANGLE, None, READ_A, READ_B, K.COMMAND_A, K.COMMAND_B, None, None, None),
)
INFO, ENDED, SIGNALS = REPORT.rows, REPORT.ended, REPORT.signals
CHANNELS = 2

CONFIG = indices(
    (
        *declarations(TorqueStiffness),
        *("handle", "lowest_angle", "highest_angle", "bears", "motion_low", "motion_high"),
        *("window", "command_range", "start_share", "worst_period"),
    ),
    FIRST_CONFIG,
)
CHOICE = indices(("motion", "mode", "pulsed", "samples"), FIRST_CHOICE)
SAMPLES = len(OBJECTS)
"""Number of a reference that is given as samples of torque and stiffness."""
ACTIONS = ("pressures", "torque_stiffness")
BY_PRESSURE, BY_TORQUE = range(len(ACTIONS))
"""Meaning of the actions; with on/off valves, those of "pressures" are pulse widths."""

MODEL = indices(
    (
        *("radius", "lowest", "highest", "length_a", "reach_a", "length_b", "reach_b"),
        *("low_a", "high_a", "low_b", "high_b", "full_pressure", "weight"),
    )
)
"""Nominal model of the bundles, in the first own row of the settings. The other two rows hold
torque and stiffness where the task is given as samples."""

NOISE_ANGLE, NOISE_A, NOISE_B, START, TASK = 1, 2, 3, 5, 6
"""Random streams."""
